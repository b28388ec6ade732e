"""Scenarios: what a run does, read from YAML and checked as a whole before anything starts."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import chain
from pathlib import Path
from typing import Annotated, Any, Literal, cast

from pydantic import Field, field_validator, model_validator

from fivebar_control.estimation.ekf import EkfSettings
from fivebar_control.estimation.estimator import Drives
from fivebar_control.estimation.homing import Homing, check_declared, homing_at
from fivebar_control.laws.adaptive_gain import AdaptiveGain
from fivebar_control.laws.ctc import CtcSettings
from fivebar_control.laws.gains import Gains
from fivebar_control.laws.law import Law, TunedLaw
from fivebar_control.laws.multi_model import ReducedCtcSettings
from fivebar_control.laws.registry import CONTROLLERS, Controller, TunedController, controller_problem, find_controller
from fivebar_control.laws.unified import UnifiedSettings
from fivebar_control.laws.vhc_cartesian import RESOLUTION, VhcCartesianSettings
from fivebar_control.laws.vhc_joint import VhcJointSettings
from fivebar_control.safety.stages import Area, SafetySettings
from fivebar_control.trajectory.planner import Plan, PlanRefused, ZoneRule, plan_motion
from fivebar_description.imu import ImuDescription
from fivebar_description.interface import NANOSECONDS
from fivebar_description.parameters import FiveBar, NotNegative, Positive, load_robot
from fivebar_description.settings import Section, Setting, read_settings
from fivebar_description.share import share_file
from fivebar_description.strict_yaml import InputError, StrictModel, read_yaml, yaml_text
from fivebar_sim.options import ImuOptions, PlantOptions

Sign = Literal[-1, 1]
Pair = Annotated[tuple[float, float], Field(strict=False)]
Mode = Annotated[tuple[Sign, Sign], Field(strict=False)]


class Zone(StrictModel):
    """Section `zone`: how wide the blending zones are."""

    rule: Literal["ballistic", "fixed"] = "ballistic"
    duration_ms: Positive = 40.0
    epsilon: Annotated[float, Field(gt=0, lt=0.5)] = 0.05

    def as_rule(self) -> ZoneRule:
        """Return the rule for the planner."""
        return ZoneRule(self.duration_ms / 1e3, self.epsilon if self.rule == "fixed" else None)


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


class SafetySection(StrictModel):
    """Section `safety`: what the last node before the drives allows, see `SafetySettings` for each.

    Attributes:
        torque_limit: Nm; None for that of the plant.
        torque_rate_limit: Nm/s; None for no limit.
        workspace: x_min, x_max, y_min, y_max (m); None for wherever both legs reach.
        type1_margin: of no effect with `working_modes`, a motion that may meet Type 1.
        stop_cycles: in real time, cycles within which the robot is stopped once a node is lost.
    """

    torque_limit: Positive | None = None
    torque_rate_limit: Positive | None = None
    joint_speed_limit: Positive = SafetySettings().joint_speed_limit
    workspace: Annotated[tuple[float, float, float, float], Field(strict=False)] | None = None
    type1_margin: Annotated[float, Field(ge=0.0, lt=1.0)] = SafetySettings().type1_margin
    rest_speed: Positive = SafetySettings().rest_speed
    stop_cycles: Annotated[int, Field(ge=2, le=10_000)] = 3

    @field_validator("workspace")
    @classmethod
    def _has_an_inside(cls, bounds: tuple[float, float, float, float] | None) -> Area | None:
        if bounds is None:
            return None
        area = Area(*bounds)
        if not (area.x_min < area.x_max and area.y_min < area.y_max):
            raise ValueError("expected x_min < x_max and y_min < y_max")
        return area


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
    """Section `ekf`: what the estimator assumes, see `EkfSettings` for each.

    With `feed_forward` the laws that have no observer of their own make up for the disturbance that it finds.
    """

    acceleration_noise: Positive = EkfSettings().acceleration_noise
    disturbance_rate: NotNegative = EkfSettings().disturbance_rate
    disturbance_initial: NotNegative = EkfSettings().disturbance_initial
    homing_tolerance: Positive = EkfSettings().homing_tolerance
    mirror_deviations: NotNegative = EkfSettings().mirror_deviations
    dwell_limit: Positive = EkfSettings().dwell_limit
    feed_forward: bool = True

    def as_settings(self) -> EkfSettings:
        """Return the settings for the estimator."""
        return EkfSettings(**self.model_dump(exclude={"feed_forward"}))


CONTROLLER = Setting(
    f"Who makes the motion: {', '.join(CONTROLLERS)}, or my_package.my_law:LAW for a law from elsewhere.",
    check=controller_problem,
)


class Scenario(StrictModel):
    """One run. Every field but the name, the waypoints and the controller has a default."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$")]
    controller: Annotated[str, CONTROLLER] = "multi_cartesian"
    robot: str = "dextar"
    working_mode: Mode = (1, -1)
    working_modes: Annotated[tuple[Mode, ...], Field(strict=False)] | None = None
    waypoints: Annotated[tuple[Pair, ...], Field(strict=False, min_length=2)]
    segment_duration: Positive | Annotated[tuple[Positive, ...], Field(strict=False)] = 1.0
    time_law: Literal["quintic", "criterion", "septic"] = "quintic"
    rate_hz: Annotated[int, Field(ge=50, le=10_000)] = 500
    zone: Zone = Zone()
    vhc_resolution: Annotated[str, RESOLUTION] = "full_friction"
    gains: Section[Gains] = Gains()
    unified: Section[UnifiedSettings] = UnifiedSettings()
    adaptive_gain: Section[AdaptiveGain] = AdaptiveGain()
    law: dict[str, Any] = Field(default_factory=dict)
    plant: PlantSection = PlantSection()
    imu: ImuSection = ImuSection()
    estimator: Literal["none", "ekf"] = "none"
    ekf: EkfSection = EkfSection()
    safety: SafetySection = SafetySection()
    tracking_error_limit: Positive = 0.05

    @model_validator(mode="after")
    def _settings_of_its_law(self) -> Scenario:
        if self.law and not self._takes_section_law():
            raise ValueError(f"law: controller {self.controller} takes its settings from sections of their own")
        self.tuned()
        return self

    @field_validator("rate_hz")
    @classmethod
    def _divides_a_second(cls, rate_hz: int) -> int:
        if NANOSECONDS % rate_hz != 0:
            raise ValueError("expected a rate that divides 1e9, so that stamps are whole nanoseconds")
        return rate_hz

    @model_validator(mode="after")
    def _may_meet_type1(self) -> Scenario:
        if self.working_modes is None:
            return self
        if len(self.working_modes) != len(self.waypoints):
            raise ValueError(
                f"working_modes: {len(self.working_modes)} given for {len(self.waypoints)} waypoints:"
                " expected one pair of signs per waypoint"
            )
        if self.working_modes[0] != self.working_mode:
            raise ValueError(
                f"working_modes: begins with {list(self.working_modes[0])}: expected the working_mode"
                f" {list(self.working_mode)}, in which the robot starts"
            )
        if not self.scheme().meets_type_1:
            able = ", ".join(one.name for one in CONTROLLERS.values() if one.meets_type_1)
            raise ValueError(
                f"working_modes: controller {self.controller} cannot meet Type 1: expected controller {able}"
            )
        if self.estimated:
            raise ValueError(
                "working_modes: estimator ekf follows the platform in one working mode: expected estimator none"
            )
        return self

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
        plan = plan_motion(
            self.five_bar(),
            self.signs(),
            self.waypoints,
            self.durations(),
            self.rate_hz,
            self.zone.as_rule(),
            self.time_law,
            self.min_authority,
        )
        if any(meeting.leg == 2 for meeting in plan.meetings):
            raise PlanRefused(
                "working_modes: leg 2 meets Type 1, but it carries the IMU, whose check follows one working mode of"
                " that leg: expected only leg 1 to be stretched"
            )
        return plan

    def signs(self) -> tuple[int, ...]:
        """Return the working mode as the planner takes it: two signs, or two for every waypoint."""
        return self.working_mode if self.working_modes is None else tuple(chain.from_iterable(self.working_modes))

    @property
    def estimated(self) -> bool:
        """Whether the controllers work from the two motors' encoders alone."""
        return self.estimator == "ekf"

    @property
    def makes_up(self) -> bool:
        """Whether the laws make up for the disturbance torques that the estimator finds."""
        return self.estimated and self.ekf.feed_forward and not self.scheme().observes_disturbance

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

    def _takes_section_law(self) -> bool:
        return any(law.name not in SECTIONS for law in self.scheme().laws)

    def tuned(self) -> TunedController:
        """Return the controller with the settings of its laws; where these have a torque limit, by default the drives'.

        Raises:
            InputError: the section `law` does not fit the law.
        """
        scheme = self.scheme()
        return TunedController(scheme, *(TunedLaw(law, self._settings_of(law)) for law in scheme.laws))

    def _settings_of(self, law: Law) -> tuple[Any, ...]:
        settings: Any = (
            SECTIONS[law.name](self) if law.name in SECTIONS else read_settings(self.law, law.settings, "law")
        )
        if getattr(settings, "torque_limit", 0.0) is None:
            settings = settings._replace(torque_limit=self.plant.torque_limit)
        return cast(tuple[Any, ...], settings)

    @property
    def torque_limit(self) -> float | None:
        """Largest torque (Nm) that a motor can get: the lesser of the last node's limit and the drives', if any."""
        limits = [limit for limit in (self.safety.torque_limit, self.plant.torque_limit) if limit is not None]
        return min(limits, default=None)

    def safety_settings(self) -> SafetySettings:
        """Return what the last node before the drives allows."""
        safety = self.safety
        return SafetySettings(
            torque_limit=math.inf if self.torque_limit is None else self.torque_limit,
            torque_rate_limit=math.inf if safety.torque_rate_limit is None else safety.torque_rate_limit,
            joint_speed_limit=safety.joint_speed_limit,
            workspace=None if safety.workspace is None else Area(*safety.workspace),
            type1_margin=safety.type1_margin if self.working_modes is None else 0.0,
            tracking_error_limit=self.tracking_error_limit,
            rest_speed=safety.rest_speed,
        )

    @property
    def min_authority(self) -> float:
        """Least |n . v1| of a crossing that the controller can take."""
        return self.scheme().min_authority

    def scheme(self) -> Controller:
        """Return how the controller is put together."""
        return find_controller(self.controller)

    def to_yaml(self) -> str:
        """Return the scenario as run, with every default written out."""
        return yaml_text(self.model_dump(mode="json"))


SECTIONS: dict[str, Callable[[Scenario], tuple[Any, ...]]] = {
    "ctc": lambda scenario: CtcSettings(scenario.gains.kp, scenario.gains.kd),
    "reduced_ctc": lambda scenario: ReducedCtcSettings(scenario.gains.kp_vhc, scenario.gains.kd_vhc),
    "vhc_cartesian": lambda scenario: VhcCartesianSettings(
        scenario.gains.kp_vhc, scenario.gains.kd_vhc, scenario.vhc_resolution
    ),
    "vhc_joint": lambda scenario: VhcJointSettings(
        scenario.gains.kp_vhc, scenario.gains.kd_vhc, scenario.vhc_resolution, *scenario.adaptive_gain
    ),
    "unified": lambda scenario: scenario.unified,
}
"""Laws whose settings come from sections of their own; the others take the section `law`."""


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
