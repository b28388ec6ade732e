# SPDX-License-Identifier: Apache-2.0
"""The scenario, the file of a run, as the control chain reads it: what the robot is to do, and by which settings.

Of the simulated robot only what the controllers are told of its drives belongs here: the section `plant` of a scenario
has more keys, which the nodes of the simulation read.
"""

from __future__ import annotations

import math
import re
from typing import Annotated, Any

from pydantic import ConfigDict, Field, PrivateAttr, model_validator

from fivebar_control.estimation.settings import Drives, EkfSettings
from fivebar_control.laws.adaptive_gain import AdaptiveGain
from fivebar_control.laws.gains import RESOLUTION, Gains, UnifiedSettings
from fivebar_control.laws.law import Law, TunedLaw
from fivebar_control.laws.registry import (
    Controller,
    TunedController,
)
from fivebar_control.laws.robot_sizes import sizes_of_law
from fivebar_control.model.geometry import inverse_geometry
from fivebar_control.model.state import JointAngles
from fivebar_control.planning.risk import Risk
from fivebar_control.safety.settings import SafetySettings
from fivebar_control.scenario.motion_file import SEEN, MotionFile
from fivebar_control.scenario.robot_defaults import ERROR_TOLERANCE, robot_defaults, robot_tolerances
from fivebar_control.trajectory.desired import desired_at
from fivebar_control.trajectory.path_distance import PATH, TIMED
from fivebar_description.camera import NO_CAMERA, CameraSettings
from fivebar_description.extra_sensor import KIND, SECTION, ExtraSection, MountedSensor, mounted
from fivebar_description.forbidden import NamedBounds, kept_clear_of, numbers_of
from fivebar_description.imu import ImuSettings
from fivebar_description.loads import NO_LOADS, Loads
from fivebar_description.modules import is_unopened
from fivebar_description.robot_file import ElbowsPass, RobotFile, read_robot
from fivebar_description.scenario_file import KEYS, with_defaults
from fivebar_description.sensors import LONGEST_LATENCY, KnownSensors, PassiveEncoder, Sensors
from fivebar_description.settings import Keys, Section, Setting, read_settings, setting_named
from fivebar_description.strict_yaml import NEWEST, Format, InputError, yaml_text
from fivebar_description.tolerances import EXACT, Tolerances

TRACKING_ERROR_LIMIT = setting_named(SafetySettings, "tracking_error_limit")
"""One of the safety settings, but a key outside of the section `safety`."""


def _file_name(name: str) -> str | None:
    if re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_.-]*", name):
        return None
    return "expected a letter or digit, then letters, digits, '_', '.' or '-'"


SECTIONS = {
    "ctc": ("gains.kp", "gains.kd"),
    "reduced_ctc": ("gains.kp_vhc", "gains.kd_vhc"),
    "vhc_cartesian": ("gains.kp_vhc", "gains.kd_vhc", "vhc_resolution"),
    "vhc_joint": ("gains.kp_vhc", "gains.kd_vhc", "vhc_resolution", "adaptive_gain"),
    "unified": ("unified",),
}
"""Laws whose settings come from keys and sections of their own; the others take the section `law`."""


def keys_of_laws(controller: Controller) -> list[str]:
    """Return the keys and sections of a scenario by which the laws of a controller are set."""
    keys = [key for law in controller.laws for key in SECTIONS.get(law.name, ("law",))]
    keys += ["unified" for law in controller.laws if law.like_unified]
    return list(dict.fromkeys(keys))


def keys_as_written(controller: Controller) -> str:
    """Return those keys as a message names them; a colon follows a section."""
    return ", ".join(f"`{key}`" if "." in key else f"`{key}:`" for key in keys_of_laws(controller))


class ControlScenario(MotionFile):
    """One run. Every field but the name, the waypoints and the controller has a default."""

    model_config = ConfigDict(extra="forbid")

    format: Format = NEWEST
    name: Annotated[str, Setting("Name of the run, and of its directory.", check=_file_name)]
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
    imu: Section[ImuSettings] = ImuSettings()
    sensors: Section[Sensors] = Sensors()
    camera: Section[CameraSettings] = NO_CAMERA
    extra_sensor: ExtraSection = Field(default_factory=dict)
    ekf: Section[EkfSettings] = EkfSettings()
    tolerances: Section[Tolerances] = EXACT
    loads: Section[Loads] = NO_LOADS
    safety: Annotated[SafetySettings, Keys(without=(TRACKING_ERROR_LIMIT.name,))] = SafetySettings()
    tracking_error_limit: Annotated[float, TRACKING_ERROR_LIMIT.setting] = TRACKING_ERROR_LIMIT.default
    error_tolerance: Annotated[
        float,
        Setting(
            "Distance of the platform from the reference up to which a run succeeds; the predicted run has to stay"
            " within half of it. By default 2 mm for DexTAR, in proportion to the links of other robots.",
            "m",
            at_least=1e-6,
            at_most=10.0,
        ),
    ] = ERROR_TOLERANCE
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
    _is_only_read: bool = PrivateAttr(default=False)
    _extra: MountedSensor | None = PrivateAttr(default=None)

    @classmethod
    def _with_robot(cls, content: Any) -> tuple[Any, RobotFile | None]:
        """Return the content with what follows from the robot's file where it leaves that out, and the file."""
        filled, file = super()._with_robot(content)
        if file is None:
            return filled, None
        filled = {**robot_tolerances(file), **filled}
        for section, values in robot_defaults(file, filled.get("estimator") == "ekf").items():
            filled = with_defaults(filled, section, values)
        return filled, file

    @model_validator(mode="after")
    def _settings_of_its_law(self) -> ControlScenario:
        if self._law_unopened:
            return self
        if self.law and not self._takes_section_law():
            raise ValueError(f"`law:` does not apply to `{self.controller}`; use {keys_as_written(self.scheme())}")
        self.tuned()
        return self

    @model_validator(mode="after")
    def _sees_where_it_starts(self) -> ControlScenario:
        if self.start != SEEN:
            return self
        if not (self.estimated and self.camera.on and self.camera.pictures):
            raise ValueError("start: seen: expected estimator ekf, and camera: {on: true} with pictures")
        if self.stands is None:
            raise ValueError("start: seen: expected stands, where the simulated robot is put")
        return self

    @model_validator(mode="after")
    def _extra_sensor_fits(self) -> ControlScenario:
        self._is_only_read = bool(self.extra_sensor) and is_unopened()
        self._extra = None if self._is_only_read else mounted(self.extra_sensor)
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
        return bool(self.gyro or self.passive.leg or self.sees or (self.estimated and self.extra_sensor))

    @property
    def passive(self) -> PassiveEncoder:
        """The encoder on a passive joint; its leg is 0 where there is none."""
        return self.sensors.passive_encoder

    def extra(self) -> MountedSensor | None:
        """Return the sensor from another package, None without one.

        Raises:
            InputError: the scenario was only read, and the sensor's module was not imported.
        """
        if self._is_only_read:
            raise InputError(
                f"{SECTION}.{KIND}: {self.extra_sensor.get(KIND)}: where a scenario or a run is only read, its module"
                " is not imported, so what it measures is not known here"
            )
        return self._extra

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
        """Whether tolerances, loads or transmissions are declared, within which robots can be drawn."""
        known = self.to_bear().declared or self.known_within().declared
        return known or read_robot(self.robot).declares_errors

    @property
    def compensates_disturbance(self) -> bool:
        """Whether the laws compensate the disturbance torques that the estimator finds."""
        return self.estimated and self.ekf.feed_forward and not self.scheme().observes_disturbance

    def drives(self) -> Drives:
        """Return what the estimator knows of encoders and drives."""
        return Drives(self.plant.encoder_counts, self.plant.delay_samples, self.plant.torque_limit)

    def initial_joints(self) -> JointAngles:
        """Return the posture in which the robot starts, by its modelled lengths.

        Raises:
            InputError: it is out of reach, or the motion is refused.
        """
        robot = self.five_bar()
        if self.stands is not None:
            x, y, *signs = self.stands
            joints = inverse_geometry(robot, (int(signs[0]), int(signs[1])), x, y)
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
        kind: Any = law.settings
        at_locus = self.gains.kp_vhc, self.gains.kd_vhc
        if law.name == "ctc":
            settings = kind(self.gains.kp, self.gains.kd)
        elif law.name == "reduced_ctc":
            settings = kind(*at_locus)
        elif law.name == "vhc_cartesian":
            settings = kind(*at_locus, self.vhc_resolution)
        elif law.name == "vhc_joint":
            settings = kind(*at_locus, self.vhc_resolution, *self.adaptive_gain)
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

    @property
    def stops_by_its_law(self) -> bool:
        """Whether no setting says for how many cycles a torque is held, so that the motion and its law decide."""
        return self.safety.stop_cycles is None and self.safety.stop_time_ms is None

    def to_yaml(self) -> str:
        """Return the scenario as run, with every default written out."""
        content = self.model_dump(mode="json")
        return yaml_text({key: content[key] for key in KEYS})
