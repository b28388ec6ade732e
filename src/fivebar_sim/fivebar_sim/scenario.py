# SPDX-License-Identifier: Apache-2.0
"""The run's file as the simulation reads it: the robot that is simulated, and its sensors.

What the robot is to do, the plant learns from the plan of the run.
"""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import ConfigDict, Field, model_validator

from fivebar_description.camera import NO_CAMERA, CameraSettings
from fivebar_description.extra_sensor import ExtraSection, MountedSensor, mounted
from fivebar_description.imu import ImuSettings
from fivebar_description.robot_file import RobotFile
from fivebar_description.scenario_file import ESTIMATOR, with_defaults, with_parts_of_robot
from fivebar_description.sensors import PassiveEncoder, Sensors
from fivebar_description.settings import Section
from fivebar_description.shared_settings import RateHz, Robot
from fivebar_description.strict_yaml import StrictModel
from fivebar_sim.effects.assumed import assumed_effects
from fivebar_sim.effects.settings import PlantSettings, has_effects


def has_ground_truth(estimated: bool, camera: CameraSettings, plant: PlantSettings) -> bool:
    """Return whether the exact state is published and recorded besides: the sensors of all joints do not show it."""
    return estimated or camera.on or has_effects(plant)


def with_assumed_effects(content: Any, file: RobotFile | None) -> Any:
    """Return a scenario's content with what is assumed of the simulated robot, where its section `plant` has it not."""
    return content if file is None else with_defaults(content, "plant", assumed_effects(file))


class SimulatedRobot(StrictModel):
    """The sections of a run's file that the simulation reads; the others are those of the controllers."""

    model_config = ConfigDict(extra="ignore")

    robot: Robot = "dextar"
    rate_hz: RateHz = 500
    estimator: Annotated[str, ESTIMATOR] = "none"
    plant: Section[PlantSettings] = PlantSettings()
    imu: Section[ImuSettings] = ImuSettings()
    sensors: Section[Sensors] = Sensors()
    camera: Section[CameraSettings] = NO_CAMERA
    extra_sensor: ExtraSection = Field(default_factory=dict)

    @model_validator(mode="before")
    @classmethod
    def _sized(cls, content: Any) -> Any:
        return with_assumed_effects(*with_parts_of_robot(content))

    @property
    def estimated(self) -> bool:
        """Whether the controllers work from the two motors' encoders alone."""
        return self.estimator == "ekf"

    @property
    def has_ground_truth(self) -> bool:
        """Whether the exact state of the robot is published besides."""
        return has_ground_truth(self.estimated, self.camera, self.plant)

    def extra(self) -> MountedSensor | None:
        """Return the sensor from another package, None without one.

        Raises:
            InputError: it cannot be loaded, or its settings do not fit it.
        """
        return mounted(self.extra_sensor)

    @property
    def passive(self) -> PassiveEncoder:
        """The encoder on a passive joint; its leg is 0 where there is none."""
        return self.sensors.passive_encoder
