# SPDX-License-Identifier: Apache-2.0
"""Arguments of launch files that several of them have in the same form."""

from __future__ import annotations

from launch.actions import DeclareLaunchArgument

from fivebar_bringup.runs.launching import NO, YES


def switch(name: str, description: str, default: str = NO) -> DeclareLaunchArgument:
    """Return an argument that is true or false."""
    return DeclareLaunchArgument(name, default_value=default, choices=[YES, NO], description=description)
