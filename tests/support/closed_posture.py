# SPDX-License-Identifier: Apache-2.0
"""A posture of DexTAR as joint angles of a closed loop."""

from __future__ import annotations

from fivebar_control.model.kinematics import state_from_platform
from fivebar_description.robot_file import load_robot


def closed_posture() -> list[float]:
    """Return q11, q12, q21, q22 (rad) above the locus."""
    state = state_from_platform(load_robot("dextar"), (1, -1), 0.0, 0.15, 0.0, 0.0)
    return [state.leg1.q1, state.leg1.q2, state.leg2.q1, state.leg2.q2]
