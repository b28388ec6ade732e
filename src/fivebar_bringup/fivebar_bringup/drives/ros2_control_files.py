# SPDX-License-Identifier: Apache-2.0
"""Files of a run on joints under a controller manager of ros2_control."""

from __future__ import annotations

import secrets
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fivebar_bringup.drives.motor_files import MotorRunFiles
from fivebar_bringup.scenario import Scenario
from fivebar_control.hardware.controlled_joints import GAINS
from fivebar_control.model.singularity import NEAR_LOCUS

BOARD_PARTS = 8
"""Parts of a period in each of which the boards of a rehearsal close their loop."""


def private_link(link: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """Return the same joints under names that a run has for itself, in the place of those of the robot."""
    place = f"/emulated_{secrets.token_hex(4)}"
    return {
        **{key: value for key, value in link.items() if key != "description"},
        "controller": f"{place}/controller",
        "commands": "",
        "states": f"{place}/joint_states",
        "manager": f"{place}/controller_manager",
    }


def for_scenario(link: Mapping[str, Any], scenario: Scenario) -> dict[str, Any]:
    """Return the section `link` with an inner loop of the scenario's robot, no narrower than its blending zones."""
    if link.get("takes") != GAINS:
        return dict(link)
    own = dict(link.get("inner_loop", {}))
    widths = (crossing.epsilon for crossing in scenario.plan().crossings)
    loop = {"robot": scenario.robot, "epsilon": max((own.get("epsilon", NEAR_LOCUS), *widths))}
    return {**link, "inner_loop": own | loop}


def least_parts(link: Mapping[str, Any]) -> int:
    """Return in how many parts of a period, at least, emulated drives act: with gains at the boards' own rate."""
    loop = link.get("inner_loop", {})
    return BOARD_PARTS if loop.get("stiffness") or loop.get("damping") else 1


RUN_FILES = MotorRunFiles(private_link, "ros2_control", for_scenario, least_parts)
