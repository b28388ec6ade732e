# SPDX-License-Identifier: Apache-2.0
"""The fixed parts of a canvas: assembly modes, loci, path and waypoints of a robot, as plain lists in mm."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from fivebar_bringup.bag.recording import FloatArray
from fivebar_bringup.report.workspace import Map, survey
from fivebar_control.trajectory.path import Segment
from fivebar_control.trajectory.planner import Plan
from fivebar_description.parameters import FiveBar

LOWEST = -0.045
"""The plane is shown from this y (m) upwards, or from below the path."""

CURVE_POINTS = 60
"""Points of a segment that is no straight line in the plane."""

MARGIN = 8.0
"""Room (mm) beside what the legs reach."""

Points = list[list[float]]

Place = tuple[float, float]


def lowest(waypoints: Sequence[Place]) -> float:
    """Return from which y (m) upwards the plane is shown for a motion through these waypoints (m)."""
    return min([LOWEST, *(y - 0.03 for _, y in waypoints)])


def corner_times(plan: Plan) -> list[float]:
    """Return the times (s) between which the reference is a straight line: its rests, and much denser on a curve."""
    times = [0.0]
    for segment in plan.path.segments:
        count = 1 if isinstance(segment, Segment) else CURVE_POINTS
        times += [segment.start_time + segment.duration * step / count for step in range(1, count + 1)]
    return times


def corners_of(plan: Plan) -> list[Place]:
    """Return the places (m) between which the reference is a straight line."""
    return [plan.path.at(t)[:2] for t in corner_times(plan)]


def scene(
    robot: FiveBar, modes: tuple[int, int], waypoints: Sequence[Place], corners: Sequence[Place]
) -> dict[str, Any]:
    """Return bounds, regions, loci, path and waypoints (mm) as plain values.

    Args:
        robot: the robot.
        modes: the working mode in which the loci are drawn.
        waypoints: places (m) that get a name each.
        corners: places (m) between which the reference is a straight line.
    """
    low = lowest(waypoints)
    plane = survey(robot, modes, low)
    axes = Figure().subplots()
    regions = axes.contourf(plane.x, plane.y, plane.det_a, levels=[-1.1, 0.0, 1.1])
    negative, positive = _polygons(regions)
    legs = (robot.leg1, robot.leg2)
    bounds = [
        1e3 * min(leg.base_x - leg.proximal for leg in legs) - MARGIN,
        1e3 * low,
        1e3 * max(leg.base_x + leg.proximal for leg in legs) + MARGIN,
        1e3 * max(leg.proximal + leg.distal for leg in legs),
    ]
    return {
        "bounds": [round(bound, 2) for bound in bounds],
        "negative": _rounded(negative),
        "positive": _rounded(positive),
        "locus": _lines(plane, plane.det_a),
        "boundary": _lines(plane, plane.reach),
        "path": [[round(1e3 * x, 2), round(1e3 * y, 2)] for x, y in corners],
        "waypoints": [
            [waypoint_name(number), 1e3 * x, 1e3 * y] for number, (x, y) in enumerate(dict.fromkeys(waypoints))
        ],
    }


def shared_scene(scenes: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return the scene of the first of several runs in bounds that hold all; of the second what differs.

    Under `second` are `locus`, `path` and `waypoints` of the second run, empty where they are those of the first.
    """
    first, *others = scenes
    lefts, lows, rights, tops = zip(*(scene["bounds"] for scene in scenes), strict=True)
    whole = first | {"bounds": [min(lefts), min(lows), max(rights), max(tops)]}
    if others:
        keys = ("locus", "path", "waypoints")
        whole["second"] = {key: [] if others[0][key] == first[key] else others[0][key] for key in keys}
    return whole


def waypoint_name(number: int) -> str:
    """Return a letter, or a number where there are more waypoints than letters."""
    return chr(ord("A") + number) if number < 26 else str(number)


def links(robot: FiveBar) -> dict[str, list[float]]:
    """Return where the motors are and how long the proximal links are (mm)."""
    legs = (robot.leg1, robot.leg2)
    return {"base": [1e3 * leg.base_x for leg in legs], "proximal": [1e3 * leg.proximal for leg in legs]}


def _lines(plane: Map, field: FloatArray) -> list[Points]:
    """Return the lines on which a field on the map is zero."""
    drawn = Figure().subplots().contour(plane.x, plane.y, field, levels=[0.0])
    return [line for level in _polygons(drawn, closed_only=False) for line in _rounded(level)]


def _polygons(contours: Any, closed_only: bool = True) -> list[list[Any]]:
    """Return the polygons or lines of each level; a path may hold several, each of which begins with a move."""
    # until matplotlib 3.8 a set of contours was no collection itself but had one for each level
    levels = (
        [[path] for path in contours.get_paths()]
        if hasattr(contours, "get_paths")
        else [level.get_paths() for level in contours.collections]
    )
    return [[part for path in level for part in path.to_polygons(closed_only=closed_only)] for level in levels]


def _rounded(lines: Iterable[Any]) -> list[Points]:
    return [np.round(np.asarray(line, dtype=np.float64), 2).tolist() for line in lines]
