"""By what requests for a motion are judged, as parameters of the node that takes them.

Whoever plans the same requests, without being that node, reads its parameters. Nothing here imports ROS.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from fivebar_control.estimation.constants import Drives
from fivebar_control.estimation.ekf import EkfSettings
from fivebar_control.laws.registry import find_controller
from fivebar_control.laws.robot_sizes import sizes_of_law
from fivebar_control.planning.limits import Risk
from fivebar_control.planning.planning_process import Conditions
from fivebar_control.planning.predicted_estimate import Sensing
from fivebar_control.ros.node_settings import (
    GOAL_LAW_PREFIX,
    GOAL_LOAD_PREFIX,
    GOAL_PASSIVE_PREFIX,
    GOAL_PREFIX,
    GOAL_RISK_PREFIX,
    GOAL_SAFETY_PREFIX,
    GOAL_TOLERANCE_PREFIX,
    NOT_OF_THE_FILTER,
    OF_REQUESTS,
    GoalSettings,
)
from fivebar_control.safety.stages import SafetySettings
from fivebar_description.loads import Loads
from fivebar_description.passive_encoder import PASSIVE_OF_SIMULATION, PassiveEncoder
from fivebar_description.robot_file import loads_of, read_robot, tolerances_of
from fivebar_description.settings import from_parameters, to_parameters
from fivebar_description.shared_settings import DRIVE_TORQUE_LIMIT
from fivebar_description.tolerances import Tolerances


class ParameterGroup(NamedTuple):
    """Settings among the parameters: their prefix, what is left out, and what has another default."""

    settings: type[tuple[Any, ...]]
    prefix: str = ""
    without: tuple[str, ...] = ()
    defaults: Mapping[str, Any] = {}

    def read(self, values: Mapping[str, Any]) -> Any:
        """Return the settings from parameters, which may be among others."""
        return from_parameters(self.settings, values, self.prefix, self.without)

    def parameters(self, settings: tuple[Any, ...]) -> dict[str, Any]:
        """Return settings as the parameters that `read` takes them from."""
        return to_parameters(settings, self.prefix, self.without)


GOALS = ParameterGroup(GoalSettings)
DRIVES = ParameterGroup(Drives, GOAL_PREFIX, defaults={"torque_limit": DRIVE_TORQUE_LIMIT})
EKF = ParameterGroup(EkfSettings, GOAL_PREFIX, NOT_OF_THE_FILTER)
TOLERANCES = ParameterGroup(Tolerances, GOAL_TOLERANCE_PREFIX)
PASSIVE = ParameterGroup(PassiveEncoder, GOAL_PASSIVE_PREFIX, PASSIVE_OF_SIMULATION)
RISK = ParameterGroup(Risk, GOAL_RISK_PREFIX)
LOADS = ParameterGroup(Loads, GOAL_LOAD_PREFIX)
SAFETY = ParameterGroup(
    SafetySettings,
    GOAL_SAFETY_PREFIX,
    tuple(name for name in SafetySettings._fields if name not in OF_REQUESTS),
)

GROUPS = (GOALS, DRIVES, EKF, TOLERANCES, PASSIVE, RISK, LOADS, SAFETY)
"""The parameters that decide, besides `robot` and `rate_hz` of the motion and those of the law (`law_group`)."""


def law_group(controller: str, robot: str) -> ParameterGroup:
    """Return the settings of the law that follows requests; their defaults are those for the robot.

    Raises:
        InputError: there is no such controller, or the robot's file cannot be read.
    """
    law = find_controller(controller).nominal
    return ParameterGroup(law.settings, GOAL_LAW_PREFIX, defaults=sizes_of_law(law.name, read_robot(robot)))


def conditions_of(values: Mapping[str, Any]) -> Conditions:
    """Return by what requests are judged from parameters by name: `robot`, `rate_hz`, `GROUPS` and the law's.

    Raises:
        InputError: the robot's file cannot be read, or there is no such controller.
    """
    robot, settings, safety = values["robot"], GOALS.read(values), SAFETY.read(values)
    sensing = Sensing(
        DRIVES.read(values),
        EKF.read(values),
        tolerances_of(robot, TOLERANCES.read(values)),
        settings.goal_gyro_every,
        PASSIVE.read(values),
        settings.goal_camera_every,
    )
    return Conditions(
        robot,
        values["rate_hz"],
        settings.goal_torque_limit,
        settings.goal_speed_limit,
        settings.goal_error_tolerance,
        RISK.read(values),
        sensing if settings.goal_estimated else None,
        loads_of(robot, LOADS.read(values)),
        settings.goal_held_ms / 1e3,
        safety.tracking_error_limit,
        safety.area,
        safety.forbidden,
        settings.goal_controller,
        law_group(settings.goal_controller, robot).read(values),
    )
