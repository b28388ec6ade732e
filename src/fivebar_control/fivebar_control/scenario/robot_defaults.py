"""Defaults of a scenario that follow from the robot: what its file says of drives, sensors, transmissions and loads.

Defaults of torques are those of DexTAR, and on another robot in proportion to the torque of its crossings; see
`fivebar_control.laws.robot_sizes`. Bandwidth and noises that suit a robot may stand in its file. A sensor that the file
declares is there, and the estimator uses it.
"""

from __future__ import annotations

import math
from typing import Any

from fivebar_control.estimation.ekf import EkfSettings
from fivebar_control.laws.robot_sizes import law_sizes, torque_ratio
from fivebar_description.imu import STANDARD_GRAVITY
from fivebar_description.loads import Loads
from fivebar_description.parameters import FiveBar
from fivebar_description.robot_file import RobotFile
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


def robot_defaults(file: RobotFile, estimated: bool) -> dict[str, dict[str, Any]]:
    """Return the settings of a scenario that a robot determines, by section and key.

    Args:
        file: of the robot.
        estimated: whether there is an estimator, which uses the sensors that the file declares.
    """
    drives, tuning, usual, ratio = file.drives, file.tuning, EkfSettings(), torque_ratio(file)
    ekf: dict[str, Any] = {}
    found: dict[str, dict[str, Any]] = {"unified": law_sizes(file)["unified"], "ekf": ekf}
    if file.transmission != RIGID:
        found["plant"] = {"transmission": plain_keys(file.transmission)}
        if file.transmission.frequency > 0.0:
            ekf["play_frequency"] = file.transmission.frequency
    if drives.joint_speed_limit is not None:
        found["safety"] = {"joint_speed_limit": drives.joint_speed_limit}
    if ratio != 1.0:
        ekf["disturbance_rate"] = usual.disturbance_rate * ratio
        ekf["disturbance_initial"] = usual.disturbance_initial * ratio
    if file.loads.declared:
        ekf["force_deviation"] = expected_force(file.five_bar(), file.loads)
    if estimated and file.imu is not None:
        found["imu"] = plain_keys(file.imu)
        ekf["gyro"] = True
        if file.imu.gyro_noise > 0.0:
            ekf["gyro_noise"] = file.imu.gyro_noise
    if estimated and file.passive_encoder is not None:
        found["sensors"] = {"passive_encoder": plain_keys(file.passive_encoder)}
    if estimated and file.camera is not None:
        found["camera"] = {**plain_keys(file.camera), "on": True}
        ekf["camera"] = True
    # last, because a noise in the robot's tuning comes before that of its sensor
    for name, value in tuning._asdict().items():
        if name in EkfSettings._fields and value is not None:
            ekf[name] = value
    return found
