# SPDX-License-Identifier: Apache-2.0
"""The posture in which a scenario's robot starts."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from fivebar_control.model.geometry import inverse_geometry
from fivebar_control.model.state import JointAngles
from fivebar_control.trajectory.desired import desired_at
from fivebar_description.errors import InputError

if TYPE_CHECKING:
    from fivebar_control.scenario.scenario import ControlScenario


def initial_joints(scenario: ControlScenario) -> JointAngles:
    """Return the posture in which a scenario's robot starts, by its modelled lengths.

    Raises:
        InputError: it is out of reach, or the motion is refused.
    """
    robot = scenario.five_bar()
    if scenario.stands is not None:
        x, y, *signs = scenario.stands
        joints = inverse_geometry(robot, (int(signs[0]), int(signs[1])), x, y)
        if not all(map(math.isfinite, joints)):
            raise InputError(f"stands: ({x:.4f}, {y:.4f}) m is out of reach")
        return joints
    plan = scenario.plan()
    legs = desired_at(robot, plan, 0.0, plan.path.at(0.0)).state[:2]
    return JointAngles(legs[0].q1, legs[0].q2, legs[1].q1, legs[1].q2)
