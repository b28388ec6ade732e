"""Defaults of a scenario that follow from the robot: its torques, speeds and encoders, from the robot file.

Defaults of torques are those of DexTAR, and on another robot in proportion to the torque of its crossings; see
`fivebar_control.laws.robot_sizes`. Bandwidth and noises that suit a robot may stand in its file.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fivebar_control.estimation.ekf import EkfSettings
from fivebar_control.laws.robot_sizes import law_sizes, torque_ratio
from fivebar_description.robot_file import RobotFile
from fivebar_description.scenario_file import named_robot, with_defaults, with_drives_of_robot


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
    for name in ("acceleration_noise", "disturbance_rate"):
        if (value := getattr(tuning, name)) is not None:
            found["ekf"][name] = value
    return found


def with_robot_defaults(content: Any) -> Any:
    """Return the content of a scenario with what it leaves out, as far as the robot's file says it."""
    if not isinstance(content, Mapping):
        return content
    file = named_robot(content)
    filled = with_drives_of_robot(content, file)
    for section, values in ({} if file is None else robot_defaults(file)).items():
        filled = with_defaults(filled, section, values)
    return filled
