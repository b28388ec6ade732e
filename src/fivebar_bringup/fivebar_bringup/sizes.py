"""Defaults of a scenario that follow from the robot: its torques, speeds and encoders, from its parameter file.

Defaults of torques are those of DexTAR, whose nominal crossing takes 0.55 Nm beyond friction. On a robot whose crossing
takes tau_0 a disturbance that matters as much is tau_0 / 0.55 Nm as large, and the weight of the torque in `unified`
is w = (a_0 / tau_0)^2 with a_0 = 0.95 m/s^2: the torque that the law saves is the torque of this robot, and the error
of acceleration that it admits for that is the same. Bandwidth and noises that suit a robot may stand in its file.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fivebar_control.estimation.ekf import EkfSettings
from fivebar_control.laws.unified import UnifiedSettings
from fivebar_description.parameters import RobotFile, read_robot
from fivebar_description.strict_yaml import InputError

DEXTAR_CROSSING = 0.55
"""Torque (Nm) beyond friction of the robot whose torques the defaults are."""

DEFAULT_ROBOT = "dextar"


def sizes_of(file: RobotFile) -> dict[str, dict[str, Any]]:
    """Return the settings that a robot's drives and tuning determine, by section and key."""
    drives, tuning = file.drives, file.tuning
    sizes: dict[str, dict[str, Any]] = {"unified": {}, "ekf": {}, "plant": {}, "safety": {}}
    if drives.crossing_torque is not None:
        ratio, law, ekf = drives.crossing_torque / DEXTAR_CROSSING, UnifiedSettings(), EkfSettings()
        sizes["unified"] = {"weight": law.weight / ratio**2, "disturbance_limit": law.disturbance_limit * ratio}
        sizes["ekf"] = {
            "disturbance_rate": ekf.disturbance_rate * ratio,
            "disturbance_initial": ekf.disturbance_initial * ratio,
        }
    if drives.torque_limit is not None:
        sizes["plant"]["torque_limit"] = drives.torque_limit
    if drives.joint_speed_limit is not None:
        sizes["safety"]["joint_speed_limit"] = drives.joint_speed_limit
    if tuning.bandwidth is not None:
        usual, bandwidth = UnifiedSettings(), tuning.bandwidth
        sizes["unified"] |= {
            "kp": bandwidth**2,
            "kd": 2.0 * bandwidth,
            "observer_rate": usual.observer_rate * bandwidth**2 / usual.kp,
        }
    for name in ("acceleration_noise", "disturbance_rate"):
        if (value := getattr(tuning, name)) is not None:
            sizes["ekf"][name] = value
    return sizes


def with_sizes(content: Any) -> Any:
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
    filled, sizes, drives = dict(content), sizes_of(file), file.drives
    if drives.encoder_counts is not None:
        if content.get("working_modes") is None:
            filled.setdefault("estimator", "ekf")
        if filled.get("estimator") == "ekf":
            sizes["plant"] |= {"encoder_counts": drives.encoder_counts, "delay_samples": drives.delay_samples}
    for section, values in sizes.items():
        given = content.get(section, {})
        if values and isinstance(given, Mapping):
            filled[section] = {**values, **given}
    return filled
