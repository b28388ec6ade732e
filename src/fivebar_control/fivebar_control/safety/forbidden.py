# SPDX-License-Identifier: Apache-2.0
"""Forbidden postures: how soon a robot that goes on as it moves is in one. Scalar functions for compiled code."""

from __future__ import annotations

import math
from typing import NamedTuple

from fivebar_control.model.state import State
from fivebar_description.forbidden import NOWHERE, PostureBounds

FORESEEN = 0.02
"""Time (s) by which the guard stops a robot before a forbidden posture: the brake's time constant."""

CLEAR = 0.03
"""Time (s) by which a planned motion keeps clear of them; the difference is for the errors of following it."""


class Forbidden(NamedTuple):
    """As many forbidden postures as there may be; those that are not there are `NOWHERE`."""

    first: PostureBounds = NOWHERE
    second: PostureBounds = NOWHERE
    third: PostureBounds = NOWHERE
    fourth: PostureBounds = NOWHERE


NONE_FORBIDDEN = Forbidden()


class Stay(NamedTuple):
    """When a quantity that changes at its present rate is in a range: times (s) of entering and leaving it."""

    enters: float
    leaves: float


def stay_between(low: float, high: float, value: float, rate: float) -> Stay:
    """Return when a value is between two bounds; never where it enters after it has left."""
    if rate == 0.0:
        return Stay(-math.inf, math.inf) if low <= value <= high else Stay(math.inf, -math.inf)
    at_low, at_high = (low - value) / rate, (high - value) / rate
    return Stay(min(at_low, at_high), max(at_low, at_high))


def stay_at_angle(low: float, high: float, angle: float, rate: float) -> Stay:
    """Return when an angle is between two bounds on the turn that is nearest to them."""
    half = 0.5 * (high - low)
    if half >= math.pi * (1.0 - 1e-9):
        return Stay(-math.inf, math.inf)
    away = angle - 0.5 * (low + high)
    away -= math.tau * math.floor(away / math.tau + 0.5)
    return stay_between(-half, half, away, rate)


def time_to_posture(bounds: PostureBounds, state: State) -> float:
    """Return in what time (s) a state is in a posture if all goes on at its rate: 0 inside, infinite for never."""
    if bounds.x_min > bounds.x_max:
        return math.inf
    x = stay_between(bounds.x_min, bounds.x_max, state.x, state.vx)
    y = stay_between(bounds.y_min, bounds.y_max, state.y, state.vy)
    q11 = stay_at_angle(bounds.q11_min, bounds.q11_max, state.leg1.q1, state.leg1.dq1)
    q21 = stay_at_angle(bounds.q21_min, bounds.q21_max, state.leg2.q1, state.leg2.dq1)
    enters = max(x.enters, y.enters, q11.enters, q21.enters)
    leaves = min(x.leaves, y.leaves, q11.leaves, q21.leaves)
    if enters > leaves or leaves < 0.0:
        return math.inf
    return max(0.0, enters)


def time_to_forbidden(forbidden: Forbidden, state: State) -> float:
    """Return in what time (s) a state is in the first of the postures that it comes to."""
    return min(
        time_to_posture(forbidden.first, state),
        time_to_posture(forbidden.second, state),
        time_to_posture(forbidden.third, state),
        time_to_posture(forbidden.fourth, state),
    )


def next_forbidden(forbidden: Forbidden, state: State) -> int:
    """Return the number, from 1, of the posture that a state comes to first."""
    times = [time_to_posture(bounds, state) for bounds in forbidden]
    return times.index(min(times)) + 1
