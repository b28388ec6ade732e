# SPDX-License-Identifier: Apache-2.0
"""The fixed parts of the picture of a run: the loci, the planned path and the blending zones on it."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise

from fivebar_bringup.scene.shapes import GREY, PALE, PLANE, PURPLE, YELLOW, Kind, Point, Shape, faded, in_plane
from fivebar_control.laws.blend import blending_weight
from fivebar_control.model.kinematics import state_from_platform
from fivebar_control.model.singularity import inverse_condition
from fivebar_control.model.state import WorkingMode
from fivebar_control.trajectory.planner import Plan
from fivebar_control.workspace.loci import Curve, singular_loci
from fivebar_description.parameters import FiveBar

LOCUS_SAMPLES = 360
"""Postures along each closed curve of a locus."""

PATH_POINTS = 200
"""Points along each segment of the path."""


def loci_shapes(robot: FiveBar, working_mode: WorkingMode) -> list[Shape]:
    """Return both loci; of Type 2, where the distal links align, that of the working mode stands out."""
    loci = singular_loci(robot, LOCUS_SAMPLES)
    type2 = [(piece.working_mode == working_mode, piece.curve) for piece in loci.type2]
    present, others = ([curve for own, curve in type2 if own is wanted] for wanted in (True, False))
    return [
        _curves("type1_locus", [piece.curve for piece in loci.type1], Shape("", 0, Kind.LINE_LIST, (), GREY, 0.001)),
        _curves("type2_locus", present, Shape("", 0, Kind.LINE_LIST, (), PURPLE, 0.0025)),
        _curves("type2_other_modes", others, Shape("", 0, Kind.LINE_LIST, (), faded(PURPLE, 0.3), 0.001)),
    ]


def path_shapes(robot: FiveBar, plan: Plan, zones: bool) -> list[Shape]:
    """Return the planned path; with `zones` also where, along it, the constraint law has a weight."""
    times = [
        segment.start_time + segment.duration * step / PATH_POINTS
        for segment in plan.path.segments
        for step in range(PATH_POINTS + 1)
    ]
    places = [plan.path.at(time)[:2] for time in times]
    inside = [zones and _in_zone(robot, plan, time) for time in times]
    blended = [
        pair
        for pair, (before, after) in zip(pairwise(in_plane(places, PLANE - 0.0002)), pairwise(inside), strict=True)
        if before and after
    ]
    return [
        Shape("path", 0, Kind.LINE_STRIP, in_plane(places), PALE, 0.002),
        Shape("zone", 0, Kind.LINE_LIST, _flat(blended), YELLOW, 0.008),
    ]


def _in_zone(robot: FiveBar, plan: Plan, time: float) -> bool:
    state = state_from_platform(robot, plan.mode_at(time), *plan.path.at(time)[:4])
    epsilon = plan.epsilon_at(time)
    return epsilon > 0.0 and blending_weight(inverse_condition(state), epsilon) > 0.0


def _curves(group: str, curves: Iterable[Curve], style: Shape) -> Shape:
    pairs = (pair for curve in curves for pair in pairwise(in_plane(curve.platform.tolist())))
    return style._replace(group=group, points=_flat(pairs))


def _flat(pairs: Iterable[tuple[Point, Point]]) -> tuple[Point, ...]:
    return tuple(point for pair in pairs for point in pair)
