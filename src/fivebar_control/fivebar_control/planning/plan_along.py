# SPDX-License-Identifier: Apache-2.0
"""The plan of a motion whose path is given: its crossings of the Type 2 locus are found along it."""

from __future__ import annotations

from fivebar_control.model.kinematics import det_a, state_from_platform
from fivebar_control.model.singularity import distal_links, inverse_condition_rate
from fivebar_control.model.state import State, WorkingMode
from fivebar_control.root_search import zero_between
from fivebar_control.trajectory.path import Path
from fivebar_control.trajectory.planner import Crossing, Plan
from fivebar_control.trajectory.zones import ZoneRule
from fivebar_description.parameters import FiveBar


def state_along(robot: FiveBar, path: Path, mode: WorkingMode, t: float) -> State:
    """Return the state of a robot in a working mode on a path at time t (s)."""
    place = path.at(t)
    return state_from_platform(robot, mode, place.x, place.y, place.vx, place.vy)


def plan_along(robot: FiveBar, path: Path, mode: WorkingMode, rate_hz: int) -> Plan:
    """Return the plan of a motion along a path in a working mode, without zones."""

    def side(t: float) -> float:
        return det_a(state_along(robot, path, mode, t))

    times = [sample / rate_hz for sample in range(path.samples(rate_hz) + 1)]
    sides = [side(t) for t in times]
    crossings = []
    for number in range(1, len(times)):
        if sides[number - 1] * sides[number] < 0.0:
            t = zero_between(side, times[number - 1], times[number], 1e-9)
            state = state_along(robot, path, mode, t)
            rate, links = inverse_condition_rate(state), distal_links(state)
            crossings.append(Crossing(path.segment_index(t), t, state.x, state.y, 1.0, rate, 0.0, links))
    return Plan(path, tuple(crossings), mode, ZoneRule().duration)
