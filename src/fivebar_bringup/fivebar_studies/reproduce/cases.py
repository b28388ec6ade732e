# SPDX-License-Identifier: Apache-2.0
"""The runs of a reproduction: a case names a run and gives its scenario."""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

from fivebar_bringup.report.thesis import CARTESIAN, MIDDLE, MULTIPLE, Waypoints
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_control.trajectory.time_laws import CRITERION, QUINTIC
from fivebar_description.camera import CameraSettings
from fivebar_description.imu import ImuSettings

JOINT = "multi_joint"
CTC, MULTI_MODEL = "ctc", "multi_model_ctc"

EARLY: Waypoints = ((0.0, 0.105), (0.0, 0.02))
LATE: Waypoints = ((0.0, 0.15), (0.0, 0.07))
"""Through the locus far from half of the way, where the fifth-order polynomial is far from the dynamic criterion."""

PLANTS: dict[str, dict[str, Any]] = {
    "nominal": {},
    "mass +10 %": {"mass_scale": 1.1},
    "inertia −10 %": {"inertia_scale": 0.9},
    "friction × 0.8": {"friction_scale": 0.8},
    "friction × 1.2": {"friction_scale": 1.2},
    "one sample of delay": {"delay_samples": 1},
}
"""Differences of the simulated robot from the controllers' model."""

NOMINAL, DELAY = "nominal", "one sample of delay"
PERTURBED = ("mass +10 %", "inertia −10 %", "friction × 0.8", "friction × 1.2")

EPSILONS = (0.02, 0.05, 0.1)
"""Fixed half widths of the blending zone, as the thesis has one."""

DEFAULT, MIN_NORM = "default", "min_norm"


def fixed(epsilon: float, resolution: str = "") -> str:
    """Return the name of a variant with a fixed zone, and with another resolution of the torque than the default."""
    return f"{resolution} ε = {epsilon:g}".strip()


VARIANTS: dict[str, dict[str, Any]] = {
    DEFAULT: {},
    MIN_NORM: {"vhc_resolution": "min_norm"},
    **{fixed(epsilon): {"zone": {"rule": "fixed", "epsilon": epsilon}} for epsilon in EPSILONS},
    **{
        fixed(epsilon, MIN_NORM): {"vhc_resolution": "min_norm", "zone": {"rule": "fixed", "epsilon": epsilon}}
        for epsilon in EPSILONS
    },
}
"""Zone and resolution of the law on the locus."""


class ReproductionCase(NamedTuple):
    """One run of a reproduction.

    Attributes:
        controller: name of the controller.
        motion: name of the motion, see :func:`waypoints`.
        duration: of each segment (s).
        plant: one of `PLANTS`.
        variant: one of `VARIANTS`.
        time_law: how the reference passes along a segment.
        imu: whether the IMU is the one of the shipped scenario imu_middle instead of a perfect one.
        adaptive_gain: whether multi_joint has its adaptive gain.
        camera: whether a camera sees the robot, whose pictures are rendered.
    """

    controller: str = CARTESIAN
    motion: str = "middle"
    duration: float = 1.0
    plant: str = NOMINAL
    variant: str = DEFAULT
    time_law: str = QUINTIC
    imu: bool = False
    adaptive_gain: bool = True
    camera: bool = False

    @property
    def label(self) -> str:
        """The case in words."""
        parts = [self.controller, self.motion, f"{self.duration:g} s"]
        parts += [self.plant] if self.plant != NOMINAL else []
        parts += [self.variant] if self.variant != DEFAULT else []
        parts += ["criterion time law"] if self.time_law == CRITERION else []
        parts += ["simulated IMU"] if self.imu else []
        parts += ["camera"] if self.camera else []
        parts += [] if self.adaptive_gain else ["no adaptive gain"]
        return ", ".join(parts)

    def scenario(self) -> Scenario:
        """Return what to run."""
        return Scenario(
            name=f"{self.motion}-{self.controller}",
            controller=self.controller,
            waypoints=waypoints(self.motion),
            segment_duration=self.duration,
            time_law=self.time_law,
            plant=PLANTS[self.plant],  # type: ignore[arg-type]
            imu=rig_imu() if self.imu else ImuSettings(),
            adaptive_gain={"enabled": self.adaptive_gain},  # type: ignore[arg-type]
            camera=CameraSettings(on=self.camera),
            **VARIANTS[self.variant],
        )


@cache
def waypoints(motion: str) -> Waypoints:
    """Return the waypoints (m) of a motion by its name; others than these four are shipped scenarios."""
    known = {"middle": MIDDLE, "multiple": MULTIPLE, "early": EARLY, "late": LATE}
    return known[motion] if motion in known else load_scenario(motion).waypoints


@cache
def rig_imu() -> ImuSettings:
    """Return the IMU of the simulated rig: noisy, biased, slow, and mounted beside the platform point and turned."""
    return load_scenario("imu_middle").imu


class ReproductionExtent(NamedTuple):
    """How much is run: durations of the segments (s), and plants besides the nominal one."""

    durations: tuple[float, ...]
    perturbed: tuple[str, ...]

    def grid(
        self, controller: str, motions: tuple[str, ...] = ("middle", "multiple"), **other: Any
    ) -> list[ReproductionCase]:
        """Return a controller's cases on motions with every duration."""
        return [
            ReproductionCase(controller, motion, duration, **other) for motion in motions for duration in self.durations
        ]


FULL = ReproductionExtent((0.5, 1.0, 2.0, 3.0), PERTURBED)
QUICK = ReproductionExtent((1.0,), ("friction × 1.2",))
"""Covers everything in a fraction of the time."""

SHOWN = 1.0
"""Duration of the segments (s) of the runs that are drawn."""
