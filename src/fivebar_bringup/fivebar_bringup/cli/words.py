# SPDX-License-Identifier: Apache-2.0
"""Words in the help of options that take libraries to know: `{controllers}` stands for the names of the controllers.

They are loaded where help is shown, and not for a run or a mistyped option.
"""

from __future__ import annotations

import re

PLACE = re.compile(r"\{(\w+)\}")


def filled(text: str) -> str:
    """Return a text with the words that its places stand for.

    Raises:
        KeyError: a place has no word.
    """
    return PLACE.sub(lambda match: WORDS[match[1]](), text)


def _scenarios() -> str:
    from fivebar_description.scenario_file import shipped_scenarios

    return ", ".join(shipped_scenarios())


def _controllers() -> str:
    from fivebar_control.laws.registry import CONTROLLERS

    return ", ".join(CONTROLLERS)


def _crossing_controllers() -> str:
    from fivebar_control.laws.registry import crossing_controllers

    return ", ".join(crossing_controllers())


def _home_mode() -> str:
    from fivebar_bringup.motions.start import HOME_MODE

    return " ".join(map(str, HOME_MODE))


def _torque_limit() -> str:
    from fivebar_control.planning.limits import MotionLimits

    return f"{MotionLimits().torque:g}"


def _speed_limit() -> str:
    from fivebar_control.planning.limits import MotionLimits

    return f"{MotionLimits().motor_speed:g}"


def _drive_faults() -> str:
    from fivebar_sim.drives.commands import USAGE

    return USAGE


def _drive_files() -> str:
    from fivebar_bringup.drives.can_files import TEMPLATE

    return TEMPLATE


def _mock_component() -> str:
    from fivebar_description.ros2_control import MOCK

    return MOCK


WORDS = {
    "scenarios": _scenarios,
    "controllers": _controllers,
    "crossing_controllers": _crossing_controllers,
    "home_mode": _home_mode,
    "torque_limit": _torque_limit,
    "speed_limit": _speed_limit,
    "drive_faults": _drive_faults,
    "drive_files": _drive_files,
    "mock_component": _mock_component,
}
"""Words by the place that they stand for; modules of further commands add theirs."""
