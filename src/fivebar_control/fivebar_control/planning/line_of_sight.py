# SPDX-License-Identifier: Apache-2.0
"""The figures of a straight line in the workspace, whatever the speed: the Type 1 margin and the Type 2 locus."""

from __future__ import annotations

import math
from typing import NamedTuple

from fivebar_control.model.kinematics import state_from_platform
from fivebar_control.model.singularity import NEAR_LOCUS, parallel_svd
from fivebar_control.model.state import WorkingMode
from fivebar_control.planning.postures import place_at
from fivebar_description.parameters import FiveBar

STEP = 0.002
"""Distance (m) between the sampled points."""

Point = tuple[float, float]


class Sight(NamedTuple):
    """A line as far as geometry goes.

    Attributes:
        clear: it keeps the Type 1 margin, rests at both ends outside the surroundings of the Type 2 locus, and
            wherever it enters them it crosses the locus once.
        crossings: how often it crosses.
        authority: least |n . v1| where it crosses, 1 without a crossing.
    """

    clear: bool
    crossings: int
    authority: float


BLOCKED = Sight(False, 0, 0.0)


def look_along(
    robot: FiveBar, working_mode: WorkingMode, start: Point, end: Point, serial_margin: float, rest: float
) -> Sight:
    """Look along a line between two rests; `rest` is the least kappa (1/cond(A)) at its ends."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    length = math.hypot(dx, dy)
    if length == 0.0:
        return BLOCKED
    steps = max(2, math.ceil(length / STEP))
    crossings, changes_here, inside, authority, before = 0, 0, False, 1.0, 0
    for step in range(steps + 1):
        s = step / steps
        place = place_at(robot, working_mode, start[0] + dx * s, start[1] + dy * s)
        if not place.serial >= serial_margin or (step in (0, steps) and place.kappa < rest):
            return BLOCKED
        if place.assembly == -before:
            crossings += 1
            changes_here += 1
            svd = parallel_svd(state_from_platform(robot, working_mode, place.x, place.y, 0.0, 0.0))
            authority = min(authority, abs(dx * svd.t_x + dy * svd.t_y) / length)
        now_inside = place.kappa < NEAR_LOCUS
        if not now_inside:
            # a passage through the surroundings of the locus has ended
            if inside and changes_here != 1:
                return BLOCKED
            changes_here = 0
        inside = now_inside
        before = place.assembly
    return Sight(True, crossings, authority)
