"""The scenario, the file of a run, as the control chain reads it: what the robot is to do, and by which settings.

Of the simulated robot only what the controllers are told of its drives belongs here: the section `plant` of a scenario
has more keys, which the nodes of the simulation read.
"""

from __future__ import annotations

import functools
import math
import re
from itertools import chain
from typing import Annotated, Any, Literal, Self

from pydantic import Field, PrivateAttr, model_validator

from fivebar_control.estimation.constants import Drives
from fivebar_control.estimation.ekf import EkfSettings
from fivebar_control.estimation.homing import Homing, homing_at
from fivebar_control.laws.adaptive_gain import AdaptiveGain
from fivebar_control.laws.ctc import CtcSettings
from fivebar_control.laws.gains import Gains
from fivebar_control.laws.law import Law, TunedLaw
from fivebar_control.laws.multi_model import ReducedCtcSettings
from fivebar_control.laws.registry import (
    CONTROLLERS,
    OF_CONTROLLER,
    Controller,
    TunedController,
    controller_problem,
    find_controller,
    stays_unopened,
    unopened_controller,
)
from fivebar_control.laws.robot_sizes import sizes_of_law
from fivebar_control.laws.unified import UnifiedSettings
from fivebar_control.laws.vhc_cartesian import RESOLUTION, VhcCartesianSettings
from fivebar_control.laws.vhc_joint import VhcJointSettings
from fivebar_control.model.geometry import inverse_geometry
from fivebar_control.model.state import JointAngles
from fivebar_control.planning.limits import Risk
from fivebar_control.planning.predicted_estimate import Sensing
from fivebar_control.planning.ride_through import longest_hold
from fivebar_control.safety.stages import SafetySettings
from fivebar_control.scenario.robot_defaults import robot_defaults
from fivebar_control.trajectory.desired import desired_at
from fivebar_control.trajectory.path_distance import PATH, TIMED
from fivebar_control.trajectory.planner import QUINTIC, Plan, PlanRefused, TimeLaw, ZoneSettings, plan_motion
from fivebar_control.trajectory.rounded import BLEND_RADIUS
from fivebar_description.camera import NO_CAMERA, CameraSettings
from fivebar_description.forbidden import NamedBounds, kept_clear_of, numbers_of
from fivebar_description.imu import ImuSettings
from fivebar_description.loads import NO_LOADS, Loads
from fivebar_description.parameters import FiveBar, laden
from fivebar_description.physical_bounds import Duration
from fivebar_description.robot_file import ElbowsPass, load_robot, read_robot
from fivebar_description.scenario_file import ESTIMATOR, with_defaults, with_drives_of_robot
from fivebar_description.sensors import LONGEST_LATENCY, KnownSensors, PassiveEncoder, Sensors
from fivebar_description.settings import Keys, Section, Setting, read_settings, setting_named
from fivebar_description.shared_settings import DRIVE_TORQUE_LIMIT, WORKING_MODE, RateHz, Robot
from fivebar_description.strict_yaml import NEWEST, Format, InputError, StrictModel, yaml_text
from fivebar_description.tolerances import EXACT, Tolerances

Sign = Literal[-1, 1]
Pair = Annotated[tuple[float, float], Field(strict=False)]
Mode = Annotated[tuple[Sign, Sign], WORKING_MODE]

TRACKING_ERROR_LIMIT = setting_named(SafetySettings, "tracking_error_limit")
"""One of the safety settings, but a key outside of the section `safety`."""


def _file_name(name: str) -> str | None:
    if re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_.-]*", name):
        return None
    return "expected a letter or digit, then letters, digits, '_', '.' or '-'"


def _ends_in_signs(place: tuple[float, ...]) -> str | None:
    return None if all(sign in (-1.0, 1.0) for sign in place[2:]) else "expected x, y, and two signs, each +1 or -1"


DECLARED, SEEN = "declared", "seen"
"""How the place and the modes are known in which the robot starts."""

CONTROLLER = Setting(
    "Controller of the run, such as multi_cartesian or unified (`fivebar compare --help` names all), or"
    " my_package.my_law:LAW for a law from elsewhere.",
    check=controller_problem,
)


SECTIONS = ("ctc", "reduced_ctc", "vhc_cartesian", "vhc_joint", "unified")
"""Laws whose settings come from sections of their own; the others take the section `law`."""

_planned = functools.lru_cache(maxsize=16)(plan_motion)
"""The planner, which a run asks for its plan again and again."""

_held = functools.lru_cache(maxsize=16)(longest_hold)

LEAST_STOP_CYCLES = 3
"""Bridge, blender and drives notice what is missing one after the other, so that the one reports it that knows what."""


class ControlScenario(StrictModel):
    """One run. Every field but the name, the waypoints and the controller has a default."""

    format: Format = NEWEST
    name: Annotated[str, Setting("Name of the run, and of its directory.", check=_file_name)]
    controller: Annotated[str, CONTROLLER] = "multi_cartesian"
    robot: Robot = "dextar"
    working_mode: Mode = (1, -1)
    working_modes: Annotated[
        tuple[Mode, ...] | None,
        Setting("The working mode at each waypoint, for motions that may meet Type 1; controller `unified` only."),
    ] = None
    waypoints: Annotated[
        tuple[Pair, ...],
        Setting(
            "The points x, y through which the platform goes, at rest in each that `blend_radius` does not round, from"
            " where it starts; with `start: seen` those after the start.",
            "m",
        ),
    ]
    start: Annotated[
        str,
        Setting(
            "How the place and the modes at the start are known: declared by the first waypoint and working_mode, or"
            " seen by the camera before the motion is planned.",
            choices=(DECLARED, SEEN),
        ),
    ] = DECLARED
    stands: Annotated[
        Annotated[tuple[float, float, float, float], Field(strict=False)] | None,
        Setting(
            "Where the simulated robot is put: x, y (m) and its working mode; by default where the motion begins. The"
            " planner does not know it.",
            check=_ends_in_signs,
        ),
    ] = None
    segment_duration: Annotated[
        Duration | Annotated[tuple[Duration, ...], Field(strict=False)],
        Setting("Duration of each segment: one number for all, or a list with one per segment.", "s"),
    ] = 1.0
    time_law: TimeLaw = QUINTIC
    blend_radius: Annotated[float | Annotated[tuple[float, ...], Field(strict=False)], BLEND_RADIUS] = 0.0
    rate_hz: RateHz = 500
    zone: Section[ZoneSettings] = ZoneSettings()
    vhc_resolution: Annotated[str, RESOLUTION] = "full_friction"
    gains: Section[Gains] = Gains()
    unified: Section[UnifiedSettings] = UnifiedSettings()
    adaptive_gain: Section[AdaptiveGain] = AdaptiveGain()
    law: Annotated[dict[str, Any], Setting("Settings of the law of a controller from elsewhere.")] = Field(
        default_factory=dict
    )
    drives_file: Annotated[
        str,
        Setting(
            "Configuration of the robot's drives, by shipped name or by path, where `--drives` names no other: the"
            " drives that a rehearsal emulates, or real ones. By default those of the robot's interface."
        ),
    ] = ""
    plant: Annotated[Drives, Keys(others=True)] = Drives(torque_limit=DRIVE_TORQUE_LIMIT)
    imu: Section[ImuSettings] = ImuSettings()
    sensors: Section[Sensors] = Sensors()
    camera: Section[CameraSettings] = NO_CAMERA
    estimator: Annotated[str, ESTIMATOR] = "none"
    ekf: Section[EkfSettings] = EkfSettings()
    tolerances: Section[Tolerances] = EXACT
    loads: Section[Loads] = NO_LOADS
    safety: Annotated[SafetySettings, Keys(without=(TRACKING_ERROR_LIMIT.name,))] = SafetySettings()
    tracking_error_limit: Annotated[float, TRACKING_ERROR_LIMIT.setting] = TRACKING_ERROR_LIMIT.default
    error_tolerance: Annotated[
        float,
        Setting(
            "Distance of the platform from the reference up to which a run succeeds; the"
            " predicted run has to stay within half of it.",
            "m",
            at_least=1e-6,
            at_most=10.0,
        ),
    ] = 0.002
    judge: Annotated[
        str,
        Setting(
            "By what a run succeeds: its distance from the reference at the time of each sample, or from the path,"
            " whatever the time. In both cases it has to end at the goal.",
            choices=(TIMED, PATH),
        ),
    ] = TIMED
    risk: Section[Risk] = Risk()
    force: Annotated[
        bool, Setting("Run the motion although the screen refuses it, as for a demonstration of what goes wrong.")
    ] = False
    _law_unopened: bool = PrivateAttr(default=False)
    _payload: float = PrivateAttr(default=0.0)

    @model_validator(mode="before")
    @classmethod
    def _sized(cls, content: Any) -> Any:
        filled, file = with_drives_of_robot(content)
        if file is not None:
            for section, values in robot_defaults(file, filled.get("estimator") == "ekf").items():
                filled = with_defaults(filled, section, values)
        return filled

    @model_validator(mode="after")
    def _settings_of_its_law(self) -> ControlScenario:
        self._law_unopened = stays_unopened(self.controller)
        if self._law_unopened:
            return self
        if self.law and not self._takes_section_law():
            raise ValueError(f"law: controller {self.controller} takes its settings from sections of their own")
        self.tuned()
        return self

    # before what looks at the first waypoint
    @model_validator(mode="after")
    def _starts_somewhere(self) -> ControlScenario:
        seen = self.start == SEEN
        if len(self.waypoints) < (1 if seen else 2):
            raise ValueError(f"waypoints: {len(self.waypoints)} given: expected at least {'one' if seen else 'two'}")
        if not seen:
            return self
        if self.working_modes is not None:
            raise ValueError("start: seen: the working mode is not known before: expected no working_modes")
        if not (self.estimated and self.camera.on and self.camera.pictures):
            raise ValueError("start: seen: expected estimator ekf, and camera: {on: true} with pictures")
        if self.stands is None:
            raise ValueError("start: seen: expected stands, where the simulated robot is put")
        return self

    @model_validator(mode="after")
    def _may_meet_type1(self) -> ControlScenario:
        if self.working_modes is None:
            return self
        if self.rounded:
            raise ValueError("blend_radius: a motion with working_modes rests at each waypoint: expected 0")
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

    @model_validator(mode="after")
    def _gyroscope_in_time(self) -> ControlScenario:
        if not self.gyro:
            return self
        lag = self.imu.gyro_lag(1.0 / self.rate_hz)
        if self.imu.latency + lag > LONGEST_LATENCY:
            raise ValueError(
                f"imu.gyro_bandwidth_hz: {self.imu.gyro_bandwidth_hz:g}: a low-pass that lags behind by"
                f" {1e3 * lag:.1f} ms makes readings older than {1e3 * LONGEST_LATENCY:g} ms with a latency of"
                f" {1e3 * self.imu.latency:g} ms, and the estimator leaves these out: expected a higher cut-off"
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

    def blend_radii(self) -> tuple[float, ...]:
        """Return the blend radius (m) at each waypoint between the first and the last, or one number for all."""
        return (float(self.blend_radius),) if isinstance(self.blend_radius, float | int) else self.blend_radius

    @property
    def rounded(self) -> bool:
        """Whether the path rounds corners."""
        return any(self.blend_radii())

    def five_bar(self) -> FiveBar:
        """Return the robot that the controllers believe in."""
        robot = load_robot(self.robot)
        return laden(robot, self._payload) if self._payload else robot

    def carrying(self, payload: float) -> Self:
        """Return the same with a payload (kg) on the platform from the start on, of which the file says nothing."""
        copy = self.model_copy()
        copy._payload = payload
        return copy

    def plan(self) -> Plan:
        """Return the checked motion.

        Raises:
            PlanRefused: the motion cannot be made.
        """
        plan = _planned(
            self.five_bar(),
            self.signs(),
            self.waypoints,
            self.durations(),
            self.rate_hz,
            self.zone.as_rule(),
            self.time_law,
            self.min_authority,
            self.blend_radii(),
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
    def gyro(self) -> bool:
        """Whether the estimator uses the gyroscope."""
        return self.estimated and self.ekf.gyro

    @property
    def sees(self) -> bool:
        """Whether the estimator uses the camera."""
        return self.estimated and self.camera.on and (self.ekf.camera or self.ekf.seen_start)

    @property
    def reads_late(self) -> bool:
        """Whether the estimator takes readings that come after their samples."""
        return bool(self.gyro or self.passive.leg or self.sees)

    @property
    def passive(self) -> PassiveEncoder:
        """The encoder on a passive joint; its leg is 0 where there is none."""
        return self.sensors.passive_encoder

    def known_sensors(self) -> KnownSensors:
        """Return what the robot's file says of its sensors, and by how much the gyroscope's low-pass lags behind."""
        return read_robot(self.robot).sensors.lagging(self.imu.gyro_lag(1.0 / self.rate_hz))

    def known_within(self) -> Tolerances:
        """Return how exactly the robot is known: by the section `tolerances`, by default as its file says."""
        return self.tolerances if self.tolerances != EXACT else read_robot(self.robot).tolerances

    def to_bear(self) -> Loads:
        """Return the loads that the robot has to bear: those of the section `loads`, by default of its file."""
        return self.loads if self.loads != NO_LOADS else read_robot(self.robot).loads

    @property
    def declares_errors(self) -> bool:
        """Whether tolerances or loads are declared, within which robots can be drawn."""
        return self.to_bear().declared or self.known_within().declared

    @property
    def compensates_disturbance(self) -> bool:
        """Whether the laws compensate the disturbance torques that the estimator finds."""
        return self.estimated and self.ekf.feed_forward and not self.scheme().observes_disturbance

    @property
    def lead_samples(self) -> int:
        """Samples from a measurement to the moment that its answer is for: an estimator predicts over the delay."""
        return self.plant.delay_samples if self.estimated else 0

    def drives(self) -> Drives:
        """Return what the estimator knows of encoders and drives."""
        return Drives(self.plant.encoder_counts, self.plant.delay_samples, self.plant.torque_limit)

    def sensing(self) -> Sensing | None:
        """Return what the estimator has to work with; None without one."""
        if not self.estimated:
            return None
        every = self.imu.schedule(self.rate_hz).every
        return Sensing(
            self.drives(), self.ekf, self.known_within(), every, self.passive, self.camera.every(self.rate_hz)
        )

    def homing(self) -> Homing:
        """Return the posture in which the robot starts, as the estimator takes it."""
        (x, y), (mode1, mode2) = self.waypoints[0], self.working_mode
        return homing_at(self.five_bar(), mode1, mode2, x, y)

    def initial_joints(self) -> JointAngles:
        """Return the posture in which the robot starts, by its modelled lengths.

        Raises:
            InputError: it is out of reach, or the motion is refused.
        """
        robot = self.five_bar()
        if self.stands is not None:
            x, y, mode1, mode2 = self.stands
            joints = inverse_geometry(robot, int(mode1), int(mode2), x, y)
            if not all(map(math.isfinite, joints)):
                raise InputError(f"stands: ({x:.4f}, {y:.4f}) m is out of reach")
            return joints
        plan = self.plan()
        legs = desired_at(robot, plan, 0.0, plan.path.at(0.0)).state[:2]
        return JointAngles(legs[0].q1, legs[0].q2, legs[1].q1, legs[1].q2)

    def section_law(self) -> dict[str, tuple[Any, ...]]:
        """Return the settings of the law that takes the section `law`, under that name; none where no law does.

        Raises:
            InputError: as `tuned`.
        """
        settings = [one.settings for one in self.tuned().laws if one.law.name not in SECTIONS]
        return {"law": settings[0]} if settings else {}

    def _takes_section_law(self) -> bool:
        return any(law.name not in SECTIONS for law in self.scheme().laws)

    def tuned(self) -> TunedController:
        """Return the controller with the settings of its laws; what limits of the torque and its rate they
        leave open is by default that of the drives and of the last node.

        Raises:
            InputError: the section `law` does not fit the law, or the law's module was not imported.
        """
        scheme = self.scheme()
        if self._law_unopened:
            raise InputError(
                f"controller: {self.controller!r}: where a scenario or a run is only read, the module of a law is not"
                " imported, so its settings, its topics and its torque are not known here: expected a scenario that"
                " was loaded to be run"
            )
        return TunedController(scheme, *(self._tuned(law) for law in scheme.laws))

    def _tuned(self, law: Law) -> TunedLaw:
        settings: Any
        kp, kd, kp_vhc, kd_vhc = self.gains.kp, self.gains.kd, self.gains.kp_vhc, self.gains.kd_vhc
        if law.name == "ctc":
            settings = CtcSettings(kp, kd)
        elif law.name == "reduced_ctc":
            settings = ReducedCtcSettings(kp_vhc, kd_vhc)
        elif law.name == "vhc_cartesian":
            settings = VhcCartesianSettings(kp_vhc, kd_vhc, self.vhc_resolution)
        elif law.name == "vhc_joint":
            settings = VhcJointSettings(kp_vhc, kd_vhc, self.vhc_resolution, *self.adaptive_gain)
        elif law.name == "unified":
            settings = self.unified
        else:
            sized = sizes_of_law(law.name, read_robot(self.robot))
            if law.like_unified:
                own = self.unified._asdict()
                sized |= {name: own[name] for name in law.settings._fields if name in own}  # type: ignore[attr-defined]
            settings = read_settings({**sized, **self.law}, law.settings, "law")
        return TunedLaw(law, settings).within(self.plant.torque_limit, self.safety.torque_rate_limit)

    @property
    def torque_limit(self) -> float | None:
        """Largest torque (Nm) that a motor can get: the lesser of the last node's limit and the drives', if any."""
        limit = self.safety_settings().torque_limit
        return limit if math.isfinite(limit) else None

    def safety_settings(self) -> SafetySettings:
        """Return what the last node before the drives allows."""
        drives = math.inf if self.plant.torque_limit is None else self.plant.torque_limit
        return self.safety._replace(
            torque_limit=min(self.safety.torque_limit, drives),
            type1_margin=self.safety.type1_margin if self.working_modes is None else 0.0,
            tracking_error_limit=self.tracking_error_limit,
            forbidden=self.safety.forbidden or numbers_of(read_robot(self.robot).forbidden),
        )

    def elbows_pass(self) -> ElbowsPass:
        """Return whether the robot's elbows may pass each other, as its file says."""
        return read_robot(self.robot).elbows_pass

    def kept_clear_of(self) -> tuple[NamedBounds, ...]:
        """Return the postures that the robot may not enter: by the section `safety`, by default as its file says."""
        return kept_clear_of(self.safety.forbidden, read_robot(self.robot).forbidden)

    def stop_cycles(self) -> int:
        """Return for how many cycles the last torque is held at most in real time, when something is late or missing.

        Raises:
            InputError: the motion is refused, or the time follows from a law whose module was not imported.
        """
        if self.safety.stop_cycles is not None:
            return self.safety.stop_cycles
        held_ms = self.safety.stop_time_ms
        if held_ms is None:
            limit = self.safety_settings().torque_limit
            held_ms = _held(self.five_bar(), self.plan(), self.tuned(), limit).time * 1e3
        # a period that does not divide the time must not lose a cycle to rounding
        return max(LEAST_STOP_CYCLES, math.floor(held_ms * self.rate_hz / 1e3 + 1e-9))

    def brake_limit(self) -> float:
        """Return for how long (s) the brake's torque is followed: until its last cycle, and the answer to that one.

        Raises:
            InputError: as `stop_cycles`.
        """
        return self.safety.brake_duration + self.stop_cycles() / self.rate_hz if self.safety.brake else 0.0

    @property
    def min_authority(self) -> float:
        """Least |n . v1| of a crossing that the controller can take."""
        return self.scheme().min_authority

    def scheme(self) -> Controller:
        """Return how the controller is put together."""
        found = unopened_controller(self.controller) if self._law_unopened else find_controller(self.controller)
        chosen = self.zone.supervision
        return found if chosen == OF_CONTROLLER or not found.blended else found._replace(weighting=chosen)

    @property
    def law_unopened(self) -> bool:
        """Whether the controller is a law from elsewhere whose module was not imported: see `laws_unopened`."""
        return self._law_unopened

    @property
    def stops_by_its_law(self) -> bool:
        """Whether no setting says for how many cycles a torque is held, so that the motion and its law decide."""
        return self.safety.stop_cycles is None and self.safety.stop_time_ms is None

    def to_yaml(self) -> str:
        """Return the scenario as run, with every default written out."""
        return yaml_text(self.model_dump(mode="json"))
