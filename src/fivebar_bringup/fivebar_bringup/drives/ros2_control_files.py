# SPDX-License-Identifier: Apache-2.0
"""Files of a run on joints under a controller manager of ros2_control."""

from __future__ import annotations

import secrets
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fivebar_bringup.drives.motor_files import MotorRunFiles


def private_link(link: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """Return the same joints under names that a run has for itself, in the place of those of the robot."""
    place = f"/emulated_{secrets.token_hex(4)}"
    return {
        **link,
        "controller": f"{place}/effort_controller",
        "states": f"{place}/joint_states",
        "manager": f"{place}/controller_manager",
    }


RUN_FILES = MotorRunFiles(private_link, shipped="ros2_control")
