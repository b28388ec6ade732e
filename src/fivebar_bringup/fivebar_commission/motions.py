# SPDX-License-Identifier: Apache-2.0
"""The motions of a commissioning, for any robot: one that excites its parameters, and crossings of the Type 2 locus.

They are found by trying places at random, always the same ones for the same robot.
"""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from fivebar_bringup.motions.start import HOME_MODE
from fivebar_control.model.geometry import workspace_bounds, workspace_margin, wrap
from fivebar_control.model.kinematics import assembly_mode, state_from_platform
from fivebar_control.model.singularity import STRETCHED, distal_links, inverse_condition, type1_margin
from fivebar_control.model.state import State, WorkingMode
from fivebar_description.parameters import FiveBar
from fivebar_description.strict_yaml import InputError

Point = tuple[float, float]

PLACES = 600
"""Places that are tried."""

POSTURES = 24
"""Postures on a straight line that are looked at."""

FARTHEST = 2.2
"""Largest angle (rad) of a motor from where it is at home."""

LEAST_KAPPA, LEAST_BEND, LEAST_MARGIN = 0.3, 0.25, 0.08
"""Least 1/cond(A) where a motion rests, least |sin q_i2| on its way, and least distance from the boundary of the
workspace, in mean lengths of a link."""

POINTS = 12
"""Waypoints of the exciting motion between both ends, and how many are tried."""

TRIALS = 60

TRIED = 16
"""Places from which ways through the locus are tried."""

CROSSINGS = 4
"""Places at which the motion for the calibration crosses, each both ways."""


class WayThrough(NamedTuple):
    """A straight line: its ends, and where it crosses the locus between stretched distal links, None if nowhere."""

    begin: Point
    end: Point
    crossing: Point | None


def state_at(robot: FiveBar, place: Point, mode: WorkingMode = HOME_MODE) -> State:
    """Return the posture at a place (m) in a working mode, at rest."""
    return state_from_platform(robot, mode, *place, 0.0, 0.0)


def link_of(robot: FiveBar) -> float:
    """Return the mean length of a link (m)."""
    return 0.25 * sum(leg.proximal + leg.distal for leg in (robot.leg1, robot.leg2))


def turned(home: State, state: State) -> tuple[float, float]:
    """Return by how much (rad) both motors are turned from home."""
    return wrap(state.leg1.q1 - home.leg1.q1), wrap(state.leg2.q1 - home.leg2.q1)


def sound(robot: FiveBar, place: Point, kappa: float = 0.0) -> bool:
    """Return whether a place is well inside the workspace, with a least 1/cond(A)."""
    if not workspace_margin(robot, *place) > LEAST_MARGIN * link_of(robot):
        return False
    state = state_at(robot, place)
    return type1_margin(state) > LEAST_BEND and inverse_condition(state) >= kappa


def way_of(robot: FiveBar, home: State, begin: Point, end: Point) -> WayThrough | None:
    """Return the straight line between two places, None where no motion for a commissioning goes along it.

    It is well inside the workspace, crosses the locus at most once, between stretched distal links, and turns no motor
    far from where it is at home, so that no cable is wound up.
    """
    places = [
        (begin[0] + share * (end[0] - begin[0]), begin[1] + share * (end[1] - begin[1]))
        for share in np.linspace(0.0, 1.0, POSTURES).tolist()
    ]
    if not all(sound(robot, place) for place in places):
        return None
    states = [state_at(robot, place) for place in places]
    if not all(abs(turn) < FARTHEST for state in states for turn in turned(home, state)):
        return None
    modes = [assembly_mode(state) for state in states]
    changes = [number for number, (before, after) in enumerate(itertools.pairwise(modes)) if before != after]
    if len(changes) > 1:
        return None
    if not changes:
        # near the locus, without crossing it, a robot may turn back
        lowest = min(inverse_condition(state) for state in states)
        return WayThrough(begin, end, None) if lowest >= 0.5 * LEAST_KAPPA else None
    if distal_links(states[changes[0]]) != STRETCHED:
        return None
    return WayThrough(begin, end, places[changes[0]])


def places_of(robot: FiveBar, seed: int = 1) -> list[Point]:
    """Return sound places at random."""
    bounds, random = workspace_bounds(robot), np.random.default_rng((seed, PLACES))
    places = zip(
        random.uniform(bounds.left, bounds.right, PLACES).tolist(),
        random.uniform(bounds.bottom, bounds.top, PLACES).tolist(),
        strict=True,
    )
    return [place for place in places if sound(robot, place, LEAST_KAPPA)]


def exciting_points(robot: FiveBar, home: Point) -> list[Point]:
    """Return waypoints from home to home in its assembly mode that turn both motors much, and not alike.

    Raises:
        InputError: the robot has no room for such a motion.
    """
    start = state_at(robot, home)
    mode = assembly_mode(start)
    near = [place for place in places_of(robot) if assembly_mode(state_at(robot, place)) == mode]
    random, best, most = np.random.default_rng(3), list[Point](), 0.0
    for _ in range(TRIALS if near else 0):
        points, left = [home], list(range(len(near)))
        random.shuffle(left)
        for number in left:
            if len(points) > POINTS:
                break
            way = way_of(robot, start, points[-1], near[number])
            if way is not None and way.crossing is None:
                points.append(near[number])
        back = way_of(robot, start, points[-1], home)
        if len(points) <= POINTS or back is None or back.crossing is not None:
            continue
        points.append(home)
        moved = np.diff([turned(start, state_at(robot, point)) for point in points], axis=0)
        # the lesser of both motors' turning, alike and against each other
        spread = float(np.linalg.svd(moved, compute_uv=False)[-1])
        if spread > most:
            best, most = points, spread
    if not best:
        raise InputError(f"home_m: {list(home)}: no room for a motion that excites the robot: expected another home")
    return best


@functools.lru_cache(maxsize=8)
def crossing_points(robot: FiveBar, home: Point) -> tuple[WayThrough, ...]:
    """Return ways from near home through the locus, at places far from each other.

    Raises:
        InputError: no straight way from home crosses the locus.
    """
    start, link = state_at(robot, home), link_of(robot)
    mode = assembly_mode(start)
    places = places_of(robot, 2)
    here = [
        home,
        *(place for place in places if assembly_mode(state_at(robot, place)) == mode and math.dist(place, home) < link),
    ]
    there = [place for place in places if assembly_mode(state_at(robot, place)) != mode]
    ways = [
        way
        for begin, end in itertools.product(here[:TRIED], there[: 4 * TRIED])
        if math.dist(begin, end) < 2.0 * link and way_of(robot, start, begin, home) is not None
        if (way := way_of(robot, start, begin, end)) is not None and way.crossing is not None
    ]
    first = [way for way in ways if way.begin == home]
    if not first:
        raise InputError(f"home_m: {list(home)}: no straight way from there crosses the locus: expected another home")
    chosen = [min(first, key=lambda way: abs(math.dist(way.begin, way.end) - 1.2 * link))]
    while len(chosen) < CROSSINGS:
        chosen.append(max(ways, key=lambda way: min(_apart(way, other) for other in chosen)))
    return tuple(chosen)


def _apart(first: WayThrough, second: WayThrough) -> float:
    assert first.crossing is not None and second.crossing is not None, "both cross"
    return math.dist(first.crossing, second.crossing)


def through_all(robot: FiveBar, home: Point, ways: Sequence[WayThrough]) -> list[Point]:
    """Return the waypoints of one motion from home to home that goes each way there and back."""
    points = [home]
    for way in ways:
        for point in (way.begin, way.end, way.begin, home):
            if point != points[-1]:
                points.append(point)
    return points
