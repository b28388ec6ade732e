# SPDX-License-Identifier: Apache-2.0
"""The torque of an elastic transmission with damping and backlash between a rotor and its proximal link."""

from __future__ import annotations


def transmitted(stiffness: float, damping: float, half_play: float, twist: float, rate: float) -> float:
    """Return the torque (Nm) on the link for a twist (rad) of the rotor against it and its rate (rad/s).

    Within the play there is none; a flank in contact pushes and never pulls.
    """
    if half_play == 0.0:
        return stiffness * twist + damping * rate
    if twist > half_play:
        return max(0.0, stiffness * (twist - half_play) + damping * rate)
    if twist < -half_play:
        return min(0.0, stiffness * (twist + half_play) + damping * rate)
    return 0.0
