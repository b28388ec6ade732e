"""Scenarios: what a run does, read from YAML and checked as a whole before anything starts."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Literal

import yaml
from pydantic import Field, field_validator

from fivebar_control.controllers.adaptive_gain import AdaptiveGainSettings
from fivebar_control.controllers.laws import SCHEMES, Scheme
from fivebar_control.controllers.unified import UnifiedSettings
from fivebar_control.estimation.ekf import EkfSettings
from fivebar_control.estimation.estimator import Drives
from fivebar_control.estimation.homing import Homing, check_declared, homing_at
from fivebar_control.trajectory.planner import Plan, PlanRefused, ZoneRule, plan_motion
from fivebar_description.imu import ImuDescription
from fivebar_description.interface import NANOSECONDS
from fivebar_description.parameters import FiveBar, NotNegative, Positive, load_robot
from fivebar_description.share import share_file
from fivebar_description.strict_yaml import InputError, StrictModel, read_yaml
from fivebar_sim.options import ImuOptions, PlantOptions

Sign = Literal[-1, 1]
Pair = Annotated[tuple[float, float], Field(strict=False)]
Gain = NotNegative


class Zone(StrictModel):
    """Section `zone`: how wide the blending zones are."""

    rule: Literal["ballistic", "fixed"] = "ballistic"
    duration_ms: Positive = 40.0
    epsilon: Annotated[float, Field(gt=0, lt=0.5)] = 0.05

    def as_rule(self) -> ZoneRule:
        """Return the rule for the planner."""
        return ZoneRule(self.duration_ms / 1e3, self.epsilon if self.rule == "fixed" else None)


class GainsSection(StrictModel):
    """Section `gains`: kp in 1/s^2, kd in 1/s."""

    kp: Gain = 2500.0
    kd: Gain = 100.0
    kp_vhc: Gain = 2500.0
    kd_vhc: Gain = 100.0


class UnifiedSection(StrictModel):
    """Section `unified`: of the controller unified; its torque limit is the plant's."""

    kp: Gain = UnifiedSettings().kp
    kd: Gain = UnifiedSettings().kd
    weight: Positive = UnifiedSettings().weight


class AdaptiveGainSection(StrictModel):
    """Section `adaptive_gain`: of the controller multi_joint (4.1.3)."""

    enabled: bool = True
    alpha: Annotated[float, Field(ge=1.0)] = AdaptiveGainSettings().alpha
    error_limit: NotNegative = AdaptiveGainSettings().error_limit
    keep_damping: bool = AdaptiveGainSettings().keep_damping

    def as_settings(self) -> AdaptiveGainSettings | None:
        """Return the settings for the law, None where the adaptive gain is off."""
        return AdaptiveGainSettings(self.alpha, self.error_limit, self.keep_damping) if self.enabled else None


class PlantSection(StrictModel):
    """Section `plant`: how the simulated robot differs from its parameter file."""

    mass_scale: Positive = 1.0
    inertia_scale: Positive = 1.0
    friction_scale: NotNegative = 1.0
    torque_limit: Positive | None = 10.0
    torque_quantum: NotNegative = 0.0
    encoder_counts: Annotated[int, Field(gt=0)] | None = None
    delay_samples: Annotated[int, Field(ge=0, le=100)] = 0
    seed: Annotated[int, Field(ge=0)] = 0

    def as_options(self) -> PlantOptions:
        """Return the options for the plant."""
        return PlantOptions(**self.model_dump())


class ImuSection(StrictModel):
    """Section `imu`: the simulated IMU, and what the listener knows of it (all but the noise)."""

    noise: NotNegative = 0.0
    gravity: float = ImuDescription().gravity
    bias: Annotated[tuple[float, float, float], Field(strict=False)] = ImuDescription().bias
    bandwidth_hz: NotNegative = ImuDescription().bandwidth_hz
    range: Positive = ImuDescription().range
    mount_x: float = ImuDescription().mount_x
    mount_y: float = ImuDescription().mount_y
    roll: float = ImuDescription().roll
    pitch: float = ImuDescription().pitch
    yaw: float = ImuDescription().yaw

    def description(self) -> ImuDescription:
        """Return what the listener knows."""
        return ImuDescription(**self.model_dump(exclude={"noise"}))

    def as_options(self) -> ImuOptions:
        """Return the options for the plant."""
        return ImuOptions(self.description(), self.noise)


class EkfSection(StrictModel):
    """Section `ekf`: what the estimator assumes; see `EkfSettings` for each."""

    acceleration_noise: Positive = EkfSettings().acceleration_noise
    disturbance_rate: NotNegative = EkfSettings().disturbance_rate
    disturbance_initial: NotNegative = EkfSettings().disturbance_initial
    homing_tolerance: Positive = EkfSettings().homing_tolerance
    mirror_deviations: NotNegative = EkfSettings().mirror_deviations
    dwell_limit: Positive = EkfSettings().dwell_limit

    def as_settings(self) -> EkfSettings:
        """Return the settings for the estimator."""
        return EkfSettings(**self.model_dump())


class Scenario(StrictModel):
    """One run. Every field but the name, the waypoints and the controller has a default."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$")]
    controller: Literal["ctc", "multi_joint", "multi_cartesian", "multi_model_ctc", "unified"] = "multi_cartesian"
    robot: str = "dextar"
    working_mode: Annotated[tuple[Sign, Sign], Field(strict=False)] = (1, -1)
    waypoints: Annotated[tuple[Pair, ...], Field(strict=False, min_length=2)]
    segment_duration: Positive | Annotated[tuple[Positive, ...], Field(strict=False)] = 1.0
    time_law: Literal["quintic", "criterion"] = "quintic"
    rate_hz: Annotated[int, Field(ge=50, le=10_000)] = 500
    zone: Zone = Zone()
    vhc_resolution: Literal["min_norm", "full_friction", "full_inverse"] = "full_friction"
    gains: GainsSection = GainsSection()
    unified: UnifiedSection = UnifiedSection()
    adaptive_gain: AdaptiveGainSection = AdaptiveGainSection()
    plant: PlantSection = PlantSection()
    imu: ImuSection = ImuSection()
    estimator: Literal["none", "ekf"] = "none"
    ekf: EkfSection = EkfSection()
    tracking_error_limit: Positive = 0.05

    @field_validator("rate_hz")
    @classmethod
    def _divides_a_second(cls, rate_hz: int) -> int:
        if NANOSECONDS % rate_hz != 0:
            raise ValueError("expected a rate that divides 1e9, so that stamps are whole nanoseconds")
        return rate_hz

    def durations(self) -> tuple[float, ...]:
        """Return one duration (s) per segment.

        Raises:
            PlanRefused: a list was given whose length is not the number of segments.
        """
        segments = len(self.waypoints) - 1
        if isinstance(self.segment_duration, float | int):
            return (float(self.segment_duration),) * segments
        if len(self.segment_duration) != segments:
            raise PlanRefused(
                f"segment_duration: {len(self.segment_duration)} given for {segments} segments:"
                " expected one number or one per segment"
            )
        return self.segment_duration

    def five_bar(self) -> FiveBar:
        """Return the robot that the controllers believe in."""
        return load_robot(self.robot)

    def plan(self) -> Plan:
        """Return the checked motion.

        Raises:
            PlanRefused: the motion cannot be made.
        """
        return plan_motion(
            self.five_bar(),
            self.working_mode,
            self.waypoints,
            self.durations(),
            self.rate_hz,
            self.zone.as_rule(),
            self.time_law,
        )

    @property
    def estimated(self) -> bool:
        """Whether the controllers work from the two motors' encoders alone."""
        return self.estimator == "ekf"

    @property
    def lead_samples(self) -> int:
        """Samples from a measurement to the moment that its answer is for: an estimator predicts over the delay."""
        return self.plant.delay_samples if self.estimated else 0

    def drives(self) -> Drives:
        """Return what the estimator knows of encoders and drives."""
        return Drives(self.plant.encoder_counts, self.plant.delay_samples, self.plant.torque_limit)

    def homing(self) -> Homing:
        """Return the posture in which the robot starts, as the estimator is told."""
        (x, y), (mode1, mode2) = self.waypoints[0], self.working_mode
        return homing_at(self.five_bar(), mode1, mode2, x, y)

    def unified_settings(self) -> UnifiedSettings:
        """Return the settings of the law without switching."""
        limit = self.plant.torque_limit
        return UnifiedSettings(**self.unified.model_dump(), torque_limit=math.inf if limit is None else limit)

    def scheme(self) -> Scheme:
        """Return how the controller is put together."""
        return SCHEMES[self.controller]

    def to_yaml(self) -> str:
        """Return the scenario as run, with every default written out."""
        return yaml.safe_dump(self.model_dump(mode="json"), sort_keys=False)


def scenario_directory() -> Path:
    """Return the folder of the shipped scenarios."""
    return share_file("fivebar_bringup", "config", "scenarios")


def shipped_scenarios() -> list[str]:
    """Return the names of the shipped scenarios."""
    return sorted(path.stem for path in scenario_directory().glob("*.yaml"))


def load_scenario(name_or_path: str) -> Scenario:
    """Read a scenario by the name of a shipped one or by path, and check that its motion can be made.

    Raises:
        InputError: there is no such scenario, it is malformed, or its motion is refused.
    """
    path = Path(name_or_path)
    if path.suffix not in (".yaml", ".yml"):
        path = scenario_directory() / f"{name_or_path}.yaml"
        if not path.is_file():
            raise InputError(
                f"scenario {name_or_path!r}: expected a path to a .yaml file or one of {', '.join(shipped_scenarios())}"
            )
    scenario = read_yaml(path, Scenario)
    try:
        scenario.plan()
        if scenario.estimated:
            check_declared(scenario.five_bar(), scenario.homing())
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    return scenario
