# SPDX-License-Identifier: Apache-2.0
"""The keys of a scenario that a node of the control chain uses."""

from __future__ import annotations

from collections.abc import Sequence
from operator import attrgetter
from typing import Any

from fivebar_control.scenario.motion_file import MotionFile
from fivebar_description.settings import keys_of

ROBOT = ("robot", "rate_hz", "working_mode")
"""Keys of the robot, which every node has."""

LEAD = ("estimator", "plant.delay_samples")
"""Keys that decide by how much answers are ahead of their samples."""

MOTION = (
    *ROBOT,
    *LEAD,
    "controller",
    "working_modes",
    "waypoints",
    "trajectory",
    "segment_duration",
    "time_law",
    "blend_radius",
    "zone",
)
"""Keys that decide the plan."""

LAWS = (
    "gains",
    "vhc_resolution",
    "adaptive_gain",
    "unified",
    "plant.torque_limit",
    "safety.torque_limit",
    "safety.torque_rate_limit",
    "ekf.feed_forward",
)
"""Keys that decide the laws, besides the section `law`."""

SENSORS = ("plant", "ekf", "imu", "sensors", "camera", "tolerances")
"""Keys of an estimator."""

STOPPING = (*MOTION, *LAWS, "safety", "tracking_error_limit")
"""Keys that decide what stops the robot, and for how long a torque is held before that."""

GOALS = (*STOPPING, *SENSORS, "loads", "risk", "error_tolerance", "judge")
"""Keys by which requests for motions are judged."""


def parameters_of(scenario: MotionFile, names: Sequence[str]) -> dict[str, Any]:
    """Return the parameters that hold keys of a scenario, by their names or those of sections."""
    return {key.name: key.to_parameter(attrgetter(key.name)(scenario)) for key in keys_of(type(scenario), names)}
