# SPDX-License-Identifier: Apache-2.0
"""The result of a calibration beside the geometry that it started from, and the files that follow from it."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from fivebar_bringup.scenario import Scenario
from fivebar_control.calibration.closure import BASE_1, BASE_2, GEOMETRY, ZERO_1, ZERO_2, locus_rows
from fivebar_control.calibration.mounting import Mounting, tilt_angle
from fivebar_control.calibration.observability import Unseen
from fivebar_control.calibration.parameters import CAMERA, PARAMETERS
from fivebar_control.calibration.passive import PassiveZero
from fivebar_control.calibration.result import CONFIDENCE, QUANTILE, Calibration
from fivebar_description.robot_file import Lengths, RobotFile
from fivebar_description.sensors import KnownSensors
from fivebar_description.strict_yaml import yaml_text
from fivebar_description.tolerances import EXACT, UNIFORM, Tolerances
from fivebar_sim.effects.links import with_another_model

INTERVALS = f"{100.0 * CONFIDENCE:.0f} % intervals"

LEAST_LENGTH, LEAST_ZERO = 2e-5, 2e-4
"""Least tolerances (m, rad) of a calibrated robot: what heat and eccentric encoders change."""

UNITS = {
    **dict.fromkeys(GEOMETRY[:ZERO_1], ("mm", 1e3)),
    **dict.fromkeys(("zero_1", "zero_2", "play_1", "play_2"), ("mrad", 1e3)),
    **dict.fromkeys(("compliance_1", "compliance_2"), ("mrad/Nm", 1e3)),
    "gyro_bias": ("mrad/s", 1e3),
    "gyro_scale": ("%", 1e2),
    "imu_delay": ("ms", 1e3),
    **dict.fromkeys(CAMERA[:2], ("mm", 1e3)),
    "camera_turn": ("mrad", 1e3),
    "camera_delay": ("ms", 1e3),
}
"""Unit that each parameter is shown in, and how many of it are one SI unit."""


class CalibratedParameter(NamedTuple):
    """One parameter with the half width of its interval, what it was before and within which bounds, in `unit`."""

    name: str
    unit: str
    value: float
    half_width: float
    before: float
    half_width_before: float

    def text(self) -> str:
        """Return value and interval, to two digits of the interval."""
        places = min(max(1 - math.floor(math.log10(self.half_width)), 0), 6) if self.half_width > 0.0 else 6
        return f"{round(self.value, places) + 0.0:.{places}f} ± {self.half_width:.{places}f}"


class CalibrationResult(NamedTuple):
    """A calibrated robot.

    Attributes:
        start: the robot file before.
        bag: what it was calibrated from.
        calibration: what the fit says.
        unseen: what the recording does not show.
        mounting: of the IMU, None without an accelerometer.
        touched: number of touched points.
        scenario: that of the run, None where the bag lies in none.
        passive: the zero of the encoder on a passive joint, None without one.
    """

    start: RobotFile
    bag: Path
    calibration: Calibration
    unseen: list[Unseen]
    mounting: Mounting | None
    touched: int
    scenario: Scenario | None
    passive: PassiveZero | None = None

    def parameters(self) -> list[CalibratedParameter]:
        """Return the parameters in the order of `PARAMETERS`, those of a sensor only where there is one."""
        calibration = self.calibration
        rows = zip(
            self._names(),
            calibration.values.tolist(),
            calibration.half_widths.tolist(),
            calibration.start.tolist(),
            (QUANTILE * calibration.before).tolist(),
            strict=True,
        )
        shown = self._names() if calibration.turning is not None else GEOMETRY
        result = []
        for name, *figures in rows:
            unit, factor = UNITS[name]
            if name in shown:
                result.append(CalibratedParameter(name, unit, *(factor * figure for figure in figures)))
        return result

    def _names(self) -> tuple[str, ...]:
        return (*PARAMETERS, *CAMERA)[: len(self.calibration.values)]

    def tolerances(self) -> Tolerances:
        """Return tolerances that, taken as independent, give the elbow gap its interval and what transmissions yield.

        They do so all over the Type 2 locus, in other working modes too, of which a motion shows less than of its own.
        Lengths and zeros are known less well one by one than what matters on the locus, a sum of them.
        """
        calibration = self.calibration
        widths = np.array(
            [
                calibration.half_widths[some].max()
                for some in (slice(0, BASE_1), slice(BASE_1, ZERO_1), slice(ZERO_1, ZERO_2 + 1))
            ]
        )
        each = widths.repeat((4, 2, 2)) / QUANTILE
        rows = locus_rows(calibration.values[: len(GEOMETRY)])
        sought = np.hypot(calibration.locus_half_widths() / QUANTILE, calibration.yielding)
        share = float(np.max(sought / np.sqrt(np.sum((rows * each) ** 2, axis=1))))
        length, base, zero = (UNIFORM / QUANTILE * share * widths).tolist()
        scale = UNIFORM * math.sqrt(calibration.covariance[GYRO_SCALE, GYRO_SCALE])
        return Tolerances(
            length=float(f"{max(length, LEAST_LENGTH):.2g}"),
            base=float(f"{max(base, LEAST_LENGTH):.2g}"),
            zero=float(f"{max(zero, LEAST_ZERO):.2g}"),
            gyro_scale=float(f"{max(scale, 1e-3):.2g}"),
            passive_zero=self._passive_tolerance(),
        )

    def _passive_tolerance(self) -> float:
        """Return the tolerance (rad) of the zero of the passive joint's encoder, where it was found."""
        if self.passive is None:
            return self.start.tolerances.passive_zero
        return float(f"{max(UNIFORM / QUANTILE * self.passive.half_width, LEAST_ZERO):.2g}")

    def robot_file(self) -> RobotFile:
        """Return the calibrated robot: its origin is in the middle between the motor axes."""
        value = dict(zip(self._names(), self.calibration.values.tolist(), strict=True))
        return self.start.model_copy(
            update={
                "name": f"{self.start.name}_calibrated",
                "lengths_m": Lengths(
                    a=round(value["base_2"] - value["base_1"], 8),
                    **{name: round(value[name], 8) for name in ("l_11", "l_12", "l_21", "l_22")},
                ),
                "tolerances": self.tolerances(),
                "sensors": self.sensors(),
            }
        )

    def sensors(self) -> KnownSensors:
        """Return what is known of the sensors.

        The offset of the IMU's clock, 0 where the interval contains it, and the zero of the passive joint's encoder.
        The lag of the gyroscope's low-pass, if the run's scenario says that it has one, is not the clock's.
        """
        known = self.start.sensors
        if self.passive is not None:
            known = known._replace(passive_zero=round(self.passive.value, 6))
        if self.calibration.turning is None:
            return known
        delay, half = float(self.calibration.values[IMU_DELAY]), float(self.calibration.half_widths[IMU_DELAY])
        if self.scenario is not None:
            delay -= self.scenario.imu.gyro_lag(1.0 / self.scenario.rate_hz)
        return known._replace(imu_clock=round(delay, 6) if abs(delay) > half else 0.0)

    def zeros(self) -> tuple[float, float]:
        """Return the encoders' zeros (rad): the readings where the angles are 0."""
        return float(self.calibration.values[ZERO_1]), float(self.calibration.values[ZERO_2])

    def origin(self) -> float:
        """Return where (m) the middle between the motor axes lies in the frame before."""
        return float(0.5 * (self.calibration.values[BASE_1] + self.calibration.values[BASE_2]))

    def calibrated_scenario(self, robot: str) -> Scenario | None:
        """Return the run's scenario for the calibrated robot; None where its robot's errors are not simulated.

        The simulated robot stays the same: what differs between it and its file is now less. Its encoders' zeros are
        those that are left once `home_offset_rad` has been corrected.
        """
        if self.scenario is None or (not any(self.scenario.plant.links) and not any(self.scenario.plant.encoders)):
            return None
        plant, before, after = self.scenario.plant, self.start.five_bar(), self.robot_file().five_bar()
        links = with_another_model(plant.links, before, after)
        zero_q11, zero_q21 = self.zeros()
        encoders = plant.encoders._replace(
            zero_1=plant.encoders.zero_1 - zero_q11, zero_2=plant.encoders.zero_2 - zero_q21
        )
        return self.scenario.model_copy(
            update={
                "robot": robot,
                "plant": plant._replace(links=links, encoders=encoders),
                "tolerances": EXACT,
            }
        )

    def parameter_file(self) -> str:
        """Return the robot file as YAML, its intervals in a comment."""
        rows = self.parameters()
        width = max(len(row.name) for row in rows)
        lines = [f"Calibrated from {self.bag}, starting from {self.start.name}: {INTERVALS}"]
        lines += [f"  {row.name:<{width}}  {row.text()} {row.unit}" for row in rows]
        lines += [f"Not seen: {direction.words}" for direction in self.unseen]
        zero_q11, zero_q21 = self.zeros()
        lines.append(
            f"Encoder zeros: add {-zero_q11:+.6f} to home_offset_rad of q11 and {-zero_q21:+.6f} to that of q21."
        )
        if self.passive is not None:
            zero = f"{1e3 * self.passive.value:.2f} ± {1e3 * self.passive.half_width:.2f} mrad"
            lines.append(f"Zero of the encoder on the passive joint of leg {self.passive.leg}: {zero}")
        # neither a path nor a name may end the comment
        lines = ["# " + "".join(letter if letter.isprintable() else "?" for letter in line) for line in lines]
        return "\n".join(lines) + "\n" + yaml_text(self.robot_file().model_dump(mode="json", exclude_none=True))

    def mounting_rows(self) -> list[tuple[str, str]]:
        """Return the IMU's mounting in words."""
        if self.mounting is None:
            return []
        mounting = self.mounting
        rows = [
            (name, f"{value:.4f} ± {half:.4f} rad")
            for name, (value, half) in (("roll", mounting.roll), ("pitch", mounting.pitch), ("yaw", mounting.yaw))
        ]
        rows += [
            (name, f"{1e3 * value:.2f} ± {1e3 * half:.2f} mm")
            for name, (value, half) in (("mount_x", mounting.mount_x), ("mount_y", mounting.mount_y))
        ]
        tilt, half = (1e3 * tilt_angle(part) for part in mounting.tilt)
        rows.append(("tilt of the base", f"{tilt:.1f} ± {half:.1f} mrad"))
        return rows

    def as_json(self) -> dict[str, Any]:
        """Return all results for a file, in SI units."""
        calibration = self.calibration
        return {
            "robot": self.start.name,
            "bag": str(self.bag),
            "samples": len(calibration.times),
            "confidence": CONFIDENCE,
            "parameters": {
                name: {"value": value, "half_width": half, "before": start}
                for name, value, half, start in zip(
                    self._names(),
                    calibration.values.tolist(),
                    calibration.half_widths.tolist(),
                    calibration.start.tolist(),
                    strict=True,
                )
                if calibration.turning is not None or name in GEOMETRY
            },
            "elbow_gap_before_m": calibration.gaps_before().tolist(),
            "elbow_gap_half_widths_m": calibration.gap_half_widths().tolist(),
            "elbow_gap_anywhere_half_width_m": float(np.max(calibration.locus_half_widths())),
            "not_seen": [{"words": direction.words, "share": direction.share} for direction in self.unseen],
            "tolerances": self.tolerances()._asdict(),
            "origin_x_m": self.origin(),
            "mounting": None if self.mounting is None else self.mounting._asdict(),
            "passive_zero": None if self.passive is None else self.passive._asdict(),
            "touched_points": self.touched,
            "camera_positions": calibration.seen,
            "misfit": calibration.misfit,
            "colour": calibration.colour,
            "yielding_m": calibration.yielding,
        }


GYRO_SCALE = PARAMETERS.index("gyro_scale")
IMU_DELAY = PARAMETERS.index("imu_delay")
