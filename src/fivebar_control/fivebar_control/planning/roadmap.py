# SPDX-License-Identifier: Apache-2.0
"""A map of the ways through the workspace in one working mode: rests on a grid, and gates through the Type 2 locus.

The locus parts the workspace into regions of one assembly mode each. Within a region neighbouring points of the grid
are joined; from one region into another lead gates, straight segments across the locus with a rest at each end. The
shortest way on this map is complete at the grid's resolution: what it does not join, a finer map might.
"""

from __future__ import annotations

import math
from functools import lru_cache
from itertools import pairwise, product
from typing import NamedTuple

import numpy as np

from fivebar_control.laws.law import MIN_AUTHORITY
from fivebar_control.model.geometry import workspace_bounds
from fivebar_control.model.kinematics import det_a, state_from_platform
from fivebar_control.model.singularity import FOLDED, distal_links, parallel_svd
from fivebar_control.model.state import State, WorkingMode
from fivebar_control.planning.line_of_sight import Point, look_along
from fivebar_control.planning.postures import Place, place_at
from fivebar_control.root_search import zero_between
from fivebar_description.parameters import FiveBar, geometry_only
from fivebar_description.robot_file import UNKNOWN, ElbowsPass

SPACING = 0.006
"""Distance (m) between neighbouring points of the grid."""

REST_ROOM, SERIAL_ROOM = 0.03, 0.02
"""How much further than their limits the grid keeps from Type 2 (in kappa) and from Type 1 (in |sin q_i2|)."""

GATE_ROOMS = (0.05, 0.0)
"""How much further than the limit a gate's rests keep from Type 2 (in kappa): the first where there is room for it."""

GATE_DISTANCE = 0.008
"""Least distance (m) between two gates."""

HALF_LENGTHS = (0.05, 0.035, 0.025, 0.016)
"""Half lengths (m) of gates, the best first: long ones pass the locus quickly with little torque."""

TURNS = (0.0, 0.5, -0.5, 1.0, -1.0)
"""Angles (rad) from t_s to a gate, the best first: beyond 1.26 the direction limit is not kept."""

GATE_COST = 0.15
"""A crossing counts like this length (m) of way."""

PASSING_COST = 0.05
"""A crossing at which the elbows pass each other counts as so much more (m), where it is not known that they can."""

JOIN_REACH = 0.03
"""Distance (m) within which a rest is joined to the grid."""

JOINS = 8
"""Points of the grid that a rest is joined to."""


class Gate(NamedTuple):
    """A way across the Type 2 locus: a straight line between two rests (m)."""

    start: Point
    end: Point


class Way(NamedTuple):
    """A way on the map: points (m) along it, and the gates among its segments."""

    points: tuple[Point, ...]
    gates: tuple[Gate, ...]


class Roadmap:
    """The map of one robot in one working mode, for given least |sin q_i2| and least kappa at rest.

    It has no gates through the folded branch of the locus where the elbows must not pass each other, and prefers others
    where that is not known.
    """

    def __init__(
        self,
        robot: FiveBar,
        working_mode: WorkingMode,
        serial_margin: float,
        rest: float,
        elbows_pass: ElbowsPass = UNKNOWN,
    ) -> None:
        """Draw the map."""
        self._robot, self._working_mode = robot, working_mode
        self._serial_margin, self._rest, self._elbows_pass = serial_margin, rest, elbows_pass
        places = _grid(robot, working_mode, serial_margin)
        self._grid = {
            key: place
            for key, place in places.items()
            if place.kappa >= rest + REST_ROOM and place.serial >= serial_margin + SERIAL_ROOM
        }
        self._costs: dict[frozenset[Point], float] = {}
        for (i, j), place in self._grid.items():
            for step in ((1, 0), (0, 1), (1, 1), (1, -1)):
                neighbour = self._grid.get((i + step[0], j + step[1]))
                if neighbour is not None and neighbour.assembly == place.assembly:
                    self._join((place.x, place.y), (neighbour.x, neighbour.y))
        gates = self._gates(places)
        self.gates = list(gates)
        for gate, folded in gates.items():
            self._join(*gate, GATE_COST + (PASSING_COST if folded and elbows_pass == UNKNOWN else 0.0))
            for point in gate:
                for other in self._neighbours(point):
                    self._join(point, other)
        self._across = {frozenset(gate): gate for gate in self.gates}
        self._folded = frozenset(frozenset(gate) for gate, folded in gates.items() if folded)

    def folded(self, gate: Gate) -> bool:
        """Return whether the elbows pass each other at a gate, in whichever direction it is passed."""
        return frozenset(gate) in self._folded

    def reaches(self, point: Point) -> bool:
        """Return whether a rest is joined to the grid."""
        return bool(self._neighbours(point))

    def way(self, start: Point, goal: Point, barred: frozenset[Gate] = frozenset()) -> Way | None:
        """Return the shortest way between two rests that uses no barred gate; None where there is none."""
        # here, because it takes long to load and a node that plans nothing does not need it
        from scipy.sparse import csr_array
        from scipy.sparse.csgraph import dijkstra

        costs = dict(self._costs)
        for gate in barred:
            costs.pop(frozenset(gate), None)
        for rest in (start, goal):
            costs.update((frozenset((rest, point)), math.dist(rest, point)) for point in self._neighbours(rest))
        points = sorted(set().union(*costs, (start, goal)))
        numbers = {point: number for number, point in enumerate(points)}
        ends = [[numbers[point] for point in pair] for pair in costs]
        # dijkstra of scipy 1.11 takes no others
        rows, columns = np.array(ends, np.int32).reshape(-1, 2).T
        graph = csr_array((list(costs.values()), (rows, columns)), shape=(len(points), len(points)))
        _, before = dijkstra(graph, directed=False, indices=numbers[start], return_predecessors=True)
        way = [goal]
        while way[-1] != start:
            previous = int(before[numbers[way[-1]]])
            if previous < 0:
                return None
            way.append(points[previous])
        way.reverse()
        pairs = [frozenset(pair) for pair in pairwise(way)]
        return Way(tuple(way), tuple(self._across[pair] for pair in pairs if pair in self._across))

    def regions(self, through_locus: bool) -> list[frozenset[Point]]:
        """Return the points of the grid (m) in parts that are joined, with the gates through the locus or without."""
        joined: dict[Point, list[Point]] = {(place.x, place.y): [] for place in self._grid.values()}
        for pair in self._costs:
            if through_locus or pair not in self._across:
                begin, end = pair
                joined.setdefault(begin, []).append(end)
                joined.setdefault(end, []).append(begin)
        grid = {(place.x, place.y) for place in self._grid.values()}
        regions, left = [], set(joined)
        while left:
            region, edge = set[Point](), [left.pop()]
            while edge:
                region.add(point := edge.pop())
                fresh = left.intersection(joined[point])
                left -= fresh
                edge += fresh
            regions.append(frozenset(region & grid))
        return [region for region in regions if region]

    def _join(self, point: Point, other: Point, extra_cost: float = 0.0) -> None:
        self._costs[frozenset((point, other))] = math.dist(point, other) + extra_cost

    def _neighbours(self, point: Point) -> list[Point]:
        """Return the nearest points of the grid that are seen from a rest in its own region."""
        neighbours: list[Point] = []
        for place in sorted(self._grid.values(), key=lambda place: math.dist(point, (place.x, place.y))):
            other = (place.x, place.y)
            if len(neighbours) == JOINS or math.dist(point, other) > JOIN_REACH:
                break
            if self.sees(point, other):
                neighbours.append(other)
        return neighbours

    def sees(self, start: Point, end: Point) -> bool:
        """Return whether a straight line leads from one rest to another (m) without a crossing."""
        return self._sees(start, end, 0, self._rest)

    def _sees(self, start: Point, end: Point, crossings: int, rest: float) -> bool:
        sight = look_along(self._robot, self._working_mode, start, end, self._serial_margin, rest)
        return sight.clear and sight.crossings == crossings and sight.authority >= MIN_AUTHORITY

    def _gates(self, places: dict[tuple[int, int], Place]) -> dict[Gate, bool]:
        """Return gates along the whole locus, at most one every `GATE_DISTANCE`, and whether the elbows pass there."""
        gates: dict[Gate, bool] = {}
        taken: list[Point] = []
        for (i, j), place in places.items():
            for key in ((i + 1, j), (i, j + 1)):
                other = places.get(key)
                if other is None or other.assembly == place.assembly:
                    continue
                point = self._on_locus((place.x, place.y), (other.x, other.y))
                if all(math.dist(point, near) >= GATE_DISTANCE for near in taken):
                    state = state_from_platform(self._robot, self._working_mode, *point, 0.0, 0.0)
                    folded = distal_links(state) == FOLDED
                    gate = None if folded and self._elbows_pass is False else self._gate_at(state)
                    if gate is not None:
                        taken.append(point)
                        gates[gate] = folded
        return gates

    def _on_locus(self, start: Point, end: Point) -> Point:
        def at(s: float) -> Point:
            return start[0] + (end[0] - start[0]) * s, start[1] + (end[1] - start[1]) * s

        def determinant(s: float) -> float:
            return det_a(state_from_platform(self._robot, self._working_mode, *at(s), 0.0, 0.0))

        return at(zero_between(determinant, 0.0, 1.0))

    def _gate_at(self, state: State) -> Gate | None:
        """Return the longest gate through a point of the locus: along t_s, across the locus, or between the two."""
        x, y, svd = state.x, state.y, parallel_svd(state)
        for room, half, turn in product(GATE_ROOMS, HALF_LENGTHS, TURNS):
            c, s = math.cos(turn), math.sin(turn)
            dx, dy = half * (c * svd.t_x - s * svd.t_y), half * (s * svd.t_x + c * svd.t_y)
            gate = Gate((x - dx, y - dy), (x + dx, y + dy))
            if self._sees(*gate, 1, self._rest + room):
                return gate
        return None


def roadmap(
    robot: FiveBar,
    working_mode: WorkingMode,
    serial_margin: float,
    rest: float,
    elbows_pass: ElbowsPass = UNKNOWN,
) -> Roadmap:
    """Return the map of a robot in a working mode, drawn once for all robots of its geometry, laden ones too."""
    return roadmap_of_geometry(geometry_only(robot), working_mode, serial_margin, rest, elbows_pass)


roadmap_of_geometry = lru_cache(maxsize=8)(Roadmap)
"""The map for a geometry: lengths alone decide where the robot can go."""


def _grid(robot: FiveBar, working_mode: WorkingMode, serial_margin: float) -> dict[tuple[int, int], Place]:
    """Return all places on a grid that keep the Type 1 margin, by their numbers in x and y."""
    left, right, bottom, top = workspace_bounds(robot)
    columns, rows = math.ceil((right - left) / SPACING), math.ceil((top - bottom) / SPACING)
    places = {}
    for i in range(columns + 1):
        for j in range(rows + 1):
            place = place_at(robot, working_mode, left + i * SPACING, j * SPACING + bottom)
            if place.serial >= serial_margin:
                places[i, j] = place
    return places
