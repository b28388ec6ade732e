"""Defaults of a scenario that follow from the robot: its torques, speeds and encoders, from its parameter file.

Defaults of torques are those of DexTAR, and on another robot in proportion to the torque of its crossings; see
`fivebar_control.laws.robot_sizes`. Bandwidth and noises that suit a robot may stand in its file.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fivebar_control.estimation.ekf import EkfSettings
from fivebar_control.laws.robot_sizes import law_sizes, torque_ratio
from fivebar_description.robot_file import RobotFile, read_robot
from fivebar_description.strict_yaml import InputError

DEFAULT_ROBOT = "dextar"


def robot_defaults(file: RobotFile) -> dict[str, dict[str, Any]]:
    """Return the settings that a robot's drives and tuning determine, by section and key."""
    drives, tuning = file.drives, file.tuning
    found: dict[str, dict[str, Any]] = {"unified": {**law_sizes(file)["unified"]}, "ekf": {}, "plant": {}, "safety": {}}
    ratio, ekf = torque_ratio(file), EkfSettings()
    if ratio != 1.0:
        found["ekf"] = {
            "disturbance_rate": ekf.disturbance_rate * ratio,
            "disturbance_initial": ekf.disturbance_initial * ratio,
        }
    if drives.torque_limit is not None:
        found["plant"]["torque_limit"] = drives.torque_limit
    if drives.joint_speed_limit is not None:
        found["safety"]["joint_speed_limit"] = drives.joint_speed_limit
    for name in ("acceleration_noise", "disturbance_rate"):
        if (value := getattr(tuning, name)) is not None:
            found["ekf"][name] = value
    return found


def with_robot_defaults(content: Any) -> Any:
    """Return the content of a scenario with what it leaves out, as far as the robot's file says it.

    A robot whose file has the encoders of its motors is estimated from these, unless the scenario says otherwise or
    meets Type 1, where the estimator cannot follow.
    """
    if not isinstance(content, Mapping):
        return content
    robot = content.get("robot", DEFAULT_ROBOT)
    try:
        if not isinstance(robot, str):
            return content
        file = read_robot(robot)
    except InputError:
        # named where the robot is read
        return content
    filled, found, drives = dict(content), robot_defaults(file), file.drives
    if drives.encoder_counts is not None:
        if content.get("working_modes") is None:
            filled.setdefault("estimator", "ekf")
        if filled.get("estimator") == "ekf":
            found["plant"] |= {"encoder_counts": drives.encoder_counts, "delay_samples": drives.delay_samples}
    for section, values in found.items():
        given = content.get(section, {})
        if values and isinstance(given, Mapping):
            filled[section] = {**values, **given}
    return filled
