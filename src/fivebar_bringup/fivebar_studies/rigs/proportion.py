# SPDX-License-Identifier: Apache-2.0
"""A rig of DexTAR's for another robot: gains that its transmissions allow, and steps of torque of its own."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

from fivebar_control.laws.robot_sizes import law_sizes, torque_ratio
from fivebar_description.robot_file import read_robot


def in_proportion(content: Mapping[str, Any], robot: str) -> dict[str, Any]:
    """Return the content of a scenario on a rig of DexTAR's for another robot.

    The gains of unified are at most those that the robot's transmissions allow; the steps in which the drives are
    commanded go with its torque.
    """
    ratio, gains = _torque_and_gains(robot)
    unified, plant = content["unified"], content["plant"]
    changed = {**content, "unified": {**unified, **{name: min(value, unified[name]) for name, value in gains.items()}}}
    if plant.get("torque_quantum"):
        changed["plant"] = {**plant, "torque_quantum": plant["torque_quantum"] * ratio}
    return changed


@cache
def _torque_and_gains(robot: str) -> tuple[float, Mapping[str, float]]:
    """Return the torque of a robot over that of DexTAR, and the largest gains of unified on it, where it has any."""
    file = read_robot(robot)
    return torque_ratio(file), {
        name: value for name, value in law_sizes(file)["unified"].items() if name in ("kp", "kd")
    }
