"""The parameters of the stages of `safety.stages`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from fivebar_control.safety.stages import Area, SafetySettings
from fivebar_description.ros.parameters import Spec
from fivebar_description.strict_yaml import InputError

DEFAULT = SafetySettings()

SAFETY = (
    Spec("torque_limit", 10.0, "Largest torque that is commanded, 0 for no limit.", "Nm", 0.0, 1e6),
    Spec("torque_rate_limit", 0.0, "Fastest change of the commanded torque, 0 for no limit.", "Nm/s", 0.0, 1e9),
    Spec(
        "joint_speed_limit",
        DEFAULT.joint_speed_limit,
        "Speed of a motor joint beyond which the robot is stopped.",
        "rad/s",
        1e-3,
        1e4,
    ),
    Spec(
        "workspace",
        [0.0],
        "Where the platform may be: x_min, x_max, y_min, y_max; a single 0 for wherever both legs reach.",
        "m",
    ),
    Spec(
        "type1_margin",
        DEFAULT.type1_margin,
        "Least |sin q_i2| on the side of the working mode, 0 for motions that pass through Type 1.",
        "",
        0.0,
        1.0,
    ),
    Spec(
        "tracking_error_limit",
        DEFAULT.tracking_error_limit,
        "Distance from the reference beyond which the blender gives up: zero torque and a fault.",
        "m",
        1e-6,
        10.0,
    ),
    Spec(
        "rest_speed", DEFAULT.rest_speed, "Speed of the motor joints below which a reset is taken.", "rad/s", 1e-6, 1e3
    ),
)


def safety_settings(values: Mapping[str, Any]) -> SafetySettings:
    """Return the settings among a node's parameters.

    Raises:
        InputError: the workspace is not four numbers in order.
    """
    bounds = values["workspace"]
    workspace = None
    if len(bounds) != 1 or bounds[0] != 0.0:
        if len(bounds) != 4 or not (bounds[0] < bounds[1] and bounds[2] < bounds[3]):
            raise InputError(f"blender: parameter workspace: {list(bounds)}: expected x_min < x_max, y_min < y_max")
        workspace = Area(*bounds)
    return SafetySettings(
        torque_limit=values["torque_limit"] or math.inf,
        torque_rate_limit=values["torque_rate_limit"] or math.inf,
        joint_speed_limit=values["joint_speed_limit"],
        workspace=workspace,
        type1_margin=values["type1_margin"],
        tracking_error_limit=values["tracking_error_limit"],
        rest_speed=values["rest_speed"],
    )
