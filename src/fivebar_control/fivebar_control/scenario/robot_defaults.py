"""Defaults of a scenario that follow from the robot: what its file says of drives, sensors, transmissions and loads.

Defaults of torques are those of DexTAR, and on another robot in proportion to the torque of its crossings; see
`fivebar_control.laws.robot_sizes`. Bandwidth and noises that suit a robot may stand in its file. A sensor that the file
declares is there, and the estimator uses it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from fivebar_control.estimation.ekf import EkfSettings
from fivebar_control.laws.robot_sizes import law_sizes, torque_ratio
from fivebar_description.imu import STANDARD_GRAVITY
from fivebar_description.loads import Loads
from fivebar_description.parameters import FiveBar
from fivebar_description.robot_file import RobotFile
from fivebar_description.scenario_file import named_robot, with_defaults, with_drives_of_robot
from fivebar_description.settings import plain_keys
from fivebar_description.transmission import RIGID


def expected_force(robot: FiveBar, loads: Loads) -> float:
    """Return the force on the platform (N) that loads come to, which the estimator expects (`ekf.force_deviation`).

    It is the push, or what lasts where that is larger: the platform's weight on the tilted base, and the friction of
    the passive joints on the Type 2 locus, where the elbows stand still and each distal link turns against its crank
    and the other distal link.
    """
    weight = robot.mass * STANDARD_GRAVITY * math.sin(loads.tilt)
    friction = 2.0 * loads.passive * (1.0 / robot.leg1.distal + 1.0 / robot.leg2.distal)
    return max(loads.push, weight + friction)


def robot_defaults(file: RobotFile) -> dict[str, dict[str, Any]]:
    """Return the settings of laws, estimator and limits that a robot determines, by section and key."""
    drives, tuning = file.drives, file.tuning
    found: dict[str, dict[str, Any]] = {"unified": {**law_sizes(file)["unified"]}, "ekf": {}, "safety": {}}
    ratio, ekf = torque_ratio(file), EkfSettings()
    if ratio != 1.0:
        found["ekf"] = {
            "disturbance_rate": ekf.disturbance_rate * ratio,
            "disturbance_initial": ekf.disturbance_initial * ratio,
        }
    if drives.joint_speed_limit is not None:
        found["safety"]["joint_speed_limit"] = drives.joint_speed_limit
    if file.transmission.frequency > 0.0:
        found["ekf"]["play_frequency"] = file.transmission.frequency
    if file.loads.declared:
        found["ekf"]["force_deviation"] = expected_force(file.five_bar(), file.loads)
    for name, value in tuning._asdict().items():
        if name in EkfSettings._fields and value is not None:
            found["ekf"][name] = value
    return found


def declared_sensors(file: RobotFile) -> dict[str, dict[str, Any]]:
    """Return the sensors that a robot's file declares beside its motors' encoders, and that the estimator uses them."""
    found: dict[str, dict[str, Any]] = {"ekf": {}}
    if file.imu is not None:
        found["imu"] = plain_keys(file.imu)
        found["ekf"]["gyro"] = True
        if file.imu.gyro_noise > 0.0:
            found["ekf"]["gyro_noise"] = file.imu.gyro_noise
    if file.passive_encoder is not None:
        found["sensors"] = {"passive_encoder": plain_keys(file.passive_encoder)}
    if file.camera is not None:
        found["camera"] = {**plain_keys(file.camera), "on": True}
        found["ekf"]["camera"] = True
    return found


def with_robot_defaults(content: Any) -> Any:
    """Return the content of a scenario with what it leaves out, as far as the robot's file says it."""
    if not isinstance(content, Mapping):
        return content
    file = named_robot(content)
    filled = with_drives_of_robot(content, file)
    if file is None:
        return filled
    if file.transmission != RIGID:
        filled = with_defaults(filled, "plant", {"transmission": plain_keys(file.transmission)})
    found = [robot_defaults(file)]
    if filled.get("estimator") == "ekf":
        # last, because a noise in the robot's tuning comes before that of its sensor
        found.append(declared_sensors(file))
    for section, values in (pair for one in found for pair in one.items()):
        filled = with_defaults(filled, section, values)
    return filled
