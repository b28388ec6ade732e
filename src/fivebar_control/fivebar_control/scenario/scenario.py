# SPDX-License-Identifier: Apache-2.0
"""The scenario, the file of a run, as the control chain reads it: what the robot is to do, and by which settings.

Of the simulated robot only what the controllers are told of its drives belongs here: the section `plant` of a scenario
has more keys, which the nodes of the simulation read.
"""

from __future__ import annotations

import re
from typing import Annotated, Any

from pydantic import ConfigDict, Field, PrivateAttr, model_validator

from fivebar_control.estimation.settings import Drives, EkfSettings
from fivebar_control.laws.adaptive_gain import AdaptiveGain
from fivebar_control.laws.gains import RESOLUTION, Gains, UnifiedSettings
from fivebar_control.planning.risk import Risk
from fivebar_control.safety.settings import SafetySettings
from fivebar_control.scenario.law_settings import check_law_section
from fivebar_control.scenario.motion_file import SEEN, MotionFile
from fivebar_control.scenario.robot_defaults import ERROR_TOLERANCE, robot_defaults, robot_tolerances
from fivebar_control.trajectory.path_distance import PATH, TIMED
from fivebar_description.camera import NO_CAMERA, CameraSettings
from fivebar_description.extra_sensor import KIND, SECTION, ExtraSection, MountedSensor, mounted
from fivebar_description.imu import ImuSettings
from fivebar_description.loads import NO_LOADS, Loads
from fivebar_description.modules import is_unopened
from fivebar_description.robot_file import RobotFile, read_robot
from fivebar_description.scenario_file import KEYS, with_defaults
from fivebar_description.sensors import LONGEST_LATENCY, PassiveEncoder, Sensors
from fivebar_description.settings import Keys, Section, Setting, setting_named
from fivebar_description.strict_yaml import NEWEST, Format, InputError, yaml_text
from fivebar_description.tolerances import EXACT, Tolerances

TRACKING_ERROR_LIMIT = setting_named(SafetySettings, "tracking_error_limit")
"""One of the safety settings, but a key outside of the section `safety`."""


def _file_name(name: str) -> str | None:
    if re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_.-]*", name):
        return None
    return "expected a letter or digit, then letters, digits, '_', '.' or '-'"


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
        if not self._law_unopened:
            check_law_section(self)
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

    def to_yaml(self) -> str:
        """Return the scenario as run, with every default written out."""
        content = self.model_dump(mode="json")
        return yaml_text({key: content[key] for key in KEYS})
