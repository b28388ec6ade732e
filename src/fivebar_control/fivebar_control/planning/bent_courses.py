# SPDX-License-Identifier: Apache-2.0
"""Bends a straight line that crosses the Type 2 locus across the platform's fall, so that it falls with it.

On the locus no motor acts along t_s. Where gravity in the plane or a constant force does, and the path goes across it,
a straight line has no pace; one that bends with the fall has exactly one. The corner is raised against the fall over
the place where the straight line crosses, and its time law finds the pace.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from fivebar_control.model.singularity import parallel_svd
from fivebar_control.planning.course import Course
from fivebar_control.planning.line_of_sight import Point
from fivebar_control.planning.pacing import Task
from fivebar_control.trajectory.criterion import ACROSS
from fivebar_control.trajectory.path import StraightWay, locus_fractions, state_on
from fivebar_description.parameters import external_force, has_external_force

CORNERS = ((True, 120.0, 0.9), (True, 105.0, 0.6), (False, 90.0, 0.9), (False, 90.0, 0.6))
"""Corners that are tried: whether they are raised across the line, else along t_s; their turn (degrees) where the line
crosses in its middle; and their radius, as a share of the shorter leg."""


def bent_courses(task: Task, start: Point, goal: Point) -> Iterator[Course]:
    """Yield courses between two rests (m) with a corner that falls where their straight line crosses the Type 2 locus.

    There are none where it does not cross once, across the fall of a platform on which forces act all the time.
    """
    if not has_external_force(task.robot):
        return
    line = StraightWay(*start, *goal)
    crossed = locus_fractions(task.robot, task.working_mode, line)
    if len(crossed) != 1:
        return
    x, y, d_x, d_y, _, _ = line.at(crossed[0])
    length = math.hypot(d_x, d_y)
    svd = parallel_svd(state_on(task.robot, task.working_mode, line, crossed[0]))
    if abs(svd.t_x * d_x + svd.t_y * d_y) > ACROSS * length:
        return
    force_x, force_y = external_force(task.robot)
    up = -math.copysign(1.0, svd.t_x * force_x + svd.t_y * force_y)
    along_fall = up * svd.t_x, up * svd.t_y
    side = math.copysign(1.0, along_fall[1] * d_x - along_fall[0] * d_y) / length
    across_line = -side * d_y, side * d_x
    for across, turn, share in CORNERS:
        height = min(crossed[0], 1.0 - crossed[0]) * length * math.tan(math.radians(0.5 * turn))
        up_x, up_y = across_line if across else along_fall
        via = x + height * up_x, y + height * up_y
        radius = share * min(math.dist(start, via), math.dist(via, goal))
        yield Course((start, via, goal), (radius,)).for_robot(task.robot)
