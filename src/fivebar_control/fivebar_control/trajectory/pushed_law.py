# SPDX-License-Identifier: Apache-2.0
"""Time laws for crossings that gravity or a constant force accelerates: s'' = rho s'^2 + a on the locus.

There t_s^T (m xddot - w_e) = 0 whatever the motors do, so that a platform at the moment of crossing accelerates as it
falls along t_s, however slowly it moves. A seventh-order polynomial that only goes forwards has so much acceleration in
quick motions only. These laws have two polynomials of sixth order, from rest to the crossing and from there to rest,
which share place, speed, acceleration and jerk. They may be at rest before the duration is over: then the passage is as
quick as it has to be. Of all of them the one is taken whose largest torque is least.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_control.model.dynamics import inverse_dynamics_of_platform
from fivebar_control.model.kinematics import det_a, state_from_platform
from fivebar_control.model.state import WorkingMode
from fivebar_control.trajectory.path import Way
from fivebar_description.parameters import FiveBar, weight_torque

FloatArray = NDArray[np.float64]

WAYS = 200
"""Parts of the way at whose ends the torques are known; between them they are interpolated."""

INSTANTS = 50
"""Instants of each polynomial at which torque and speed are looked at."""

NEAR_LOCUS = 0.02
"""Below this |det A| torques are not looked at: there they are quotients of two small numbers, and those beside it are
nearly the same."""

ENDS = (1.0, 0.85, 0.7, 0.55, 0.45)
FALLS = (6.5, 5.5, 4.7, 4.0, 3.4, 2.9, 2.4, 2.0)
PASSAGES = (1.2, 1.5, 1.9, 2.4, 3.0, 4.0)
CROSSED = (0.12, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.88)
SPEEDS = (0.3, 0.5, 0.75, 1.1, 1.6, 2.2, 3.0, 4.2)
ACCELERATIONS = (0.0, -3.0, 3.0, -8.0, 8.0)
"""Where the search begins: when the platform rests, as shares of the duration and as multiples of the time in which it
falls the length of its way, or goes it at the pace of the crossing; the share of that at which it crosses; its speed
there over its mean speed, or its acceleration in the same unit of time."""

LOW, HIGH = np.array((math.log(1e-3), 0.03, 0.05, -1e4)), np.array((0.0, 0.97, 50.0, 1e4))
"""Bounds of the search: of the logarithm of the share of the duration after which the platform rests, the share of that
at which it crosses, its speed there over its mean speed, and the jerk in the same unit of time."""

MOVES = np.array([(0.3, 0.0, 0.0, 0.0), (0.0, 0.3, 0.0, 0.0), (0.0, 0.0, 0.5, 0.0), (0.0, 0.0, 0.0, 40.0)])
MOVES = np.concatenate((MOVES, -MOVES))
"""Its moves, each multiplied by its step."""

ACCELERATION, ACCELERATION_MOVE = 1e3, 8.0
"""Bound of the acceleration at the crossing in the same unit of time, either way, and the factor on its moves, where it
is sought in place of the speed."""

REFINED, FIRST_STEP, FINEST, WORTH = 6, 0.4, 2e-3, 1e-4
"""So many of the best starts are refined, with steps from the first to the finest; a step is halved where no move is
worth this share of the torque."""

POWERS = np.arange(3, 7)
TIMES = np.linspace(0.0, 1.0, INSTANTS + 1)[1:]
PLACE = TIMES[:, None] ** POWERS
RATE = POWERS * TIMES[:, None] ** (POWERS - 1)
CHANGE = POWERS * (POWERS - 1) * TIMES[:, None] ** (POWERS - 2)
AT_END = np.linalg.inv(
    np.array(
        [
            np.ones(4),
            POWERS,
            POWERS * (POWERS - 1),
            POWERS * (POWERS - 1) * (POWERS - 2),
        ],
        dtype=np.float64,
    )
)
"""From place, speed, acceleration and jerk at the end of a unit of time to the coefficients of the third to sixth power
of a motion that begins at rest."""

Coefficients = tuple[float, float, float, float]


class PushedLaw(NamedTuple):
    """A time law that crosses at `crossed` and is at rest from `rests` on, both shares of the duration.

    `before` and `after` are polynomials in the share of the time from the rest to the crossing, forwards and backwards.
    """

    crossed: float
    rests: float
    before: Coefficients
    after: Coefficients

    def __call__(self, u: float) -> tuple[float, float, float]:
        """Return s, ds/du, d2s/du2; outside the motion there is rest."""
        if u <= 0.0:
            return 0.0, 0.0, 0.0
        if u >= self.rests:
            return 1.0, 0.0, 0.0
        if u <= self.crossed:
            s, ds, dds = _at(self.before, u / self.crossed)
            return s, ds / self.crossed, dds / (self.crossed * self.crossed)
        left = self.rests - self.crossed
        s, ds, dds = _at(self.after, (self.rests - u) / left)
        return 1.0 - s, ds / left, -dds / (left * left)


def _at(polynomial: Coefficients, u: float) -> tuple[float, float, float]:
    c3, c4, c5, c6 = polynomial
    return (
        u * u * u * (c3 + u * (c4 + u * (c5 + u * c6))),
        u * u * (3.0 * c3 + u * (4.0 * c4 + u * (5.0 * c5 + u * 6.0 * c6))),
        u * (6.0 * c3 + u * (12.0 * c4 + u * (20.0 * c5 + u * 30.0 * c6))),
    )


class TorqueRows(NamedTuple):
    """Torques of both motors along a way, multiplied by det A, which makes them smooth on the locus.

    Attributes:
        determinant: float64[N], det A.
        rest: float64[N, 2], at rest (Nm).
        per_acceleration: float64[N, 2], for s'' = 1 / s^2 (Nm).
        per_speed: float64[N, 2], for s' = 1 / s (Nm).
        legs: float64[N, 2], for the weight of the legs (Nm), not multiplied.
    """

    determinant: FloatArray
    rest: FloatArray
    per_acceleration: FloatArray
    per_speed: FloatArray
    legs: FloatArray

    def columns(self) -> list[FloatArray]:
        """Return det A, and of each motor the four others, each float64[N]."""
        of_motors = (column[:, motor] for motor in range(2) for column in self[1:])
        return [self.determinant, *of_motors]


@lru_cache(maxsize=64)
def torque_rows(robot: FiveBar, mode: WorkingMode, way: Way) -> TorqueRows:
    """Return the torques along a way at `WAYS` + 1 even shares."""
    torques: list[tuple[float, ...]] = []
    for number in range(WAYS + 1):
        # beside the locus, on which there are none
        x, y, d_x, d_y, b_x, b_y = way.at(min(number / WAYS + 1e-9, 1.0))
        rests = state_from_platform(robot, mode, x, y, 0.0, 0.0)
        moves = state_from_platform(robot, mode, x, y, d_x, d_y)
        still = inverse_dynamics_of_platform(robot, rests, 0.0, 0.0, 0.0, 0.0)
        pushed = inverse_dynamics_of_platform(robot, rests, d_x, d_y, 0.0, 0.0)
        moved = inverse_dynamics_of_platform(robot, moves, b_x, b_y, 0.0, 0.0)
        legs = (
            weight_torque(robot, robot.leg1, rests.leg1.r_x, rests.leg1.r_y),
            weight_torque(robot, robot.leg2, rests.leg2.r_x, rests.leg2.r_y),
        )
        torques.append((det_a(rests), *still, *pushed, *moved, *legs))
    rows = np.array(torques)
    determinant = rows[:, :1]
    still = rows[:, 1:3] * determinant
    return TorqueRows(
        rows[:, 0], still, rows[:, 3:5] * determinant - still, rows[:, 5:7] * determinant - still, rows[:, 7:9]
    )


class CriterionTerms(NamedTuple):
    """The criterion of a way on the locus, along s'' + bend s'^2 = fall (N, with s in shares of the way).

    Attributes:
        along: t_s^T m x', with residual inertias also what their moments have of it.
        bend: the same for x'', the curvature of the way.
        fall: t_s^T w_e, of gravity and a constant force.
    """

    along: float
    bend: float
    fall: float

    @property
    def ratio(self) -> float:
        """Return rho, s'' / s'^2 without forces that act all the time."""
        return -self.bend / self.along

    @property
    def push(self) -> float:
        """Return the s'' (1/s^2) of a platform without speed."""
        return self.fall / self.along

    @property
    def pace(self) -> float:
        """Return the s' (1/s) that needs no s'', which is the only one across t_s; NaN where there is none."""
        square = self.fall / self.bend if self.bend != 0.0 else math.nan
        return math.sqrt(square) if square > 0.0 else math.nan


class Demand(NamedTuple):
    """The conditions of a time law.

    Attributes:
        place: where it crosses, a share of the way.
        terms: of the criterion there.
        duration: of the whole motion (s).
        at_pace: whether the crossing is sought by its s'' in place of its s', which is then nearly fixed: in a corner
            that lies across t_s.
    """

    place: float
    terms: CriterionTerms
    duration: float
    at_pace: bool = False


@lru_cache(maxsize=64)
def pushed_law(robot: FiveBar, mode: WorkingMode, way: Way, demand: Demand) -> PushedLaw | None:
    """Return the law of least torque that meets a demand on a way, in a working mode; None for none."""
    rows = torque_rows(robot, mode, way)
    points = starts_for(demand)
    costs = largest_torques(points, demand, rows)
    best = np.argsort(costs, kind="stable")[:REFINED]
    if not np.isfinite(costs[best[0]]):
        return None
    points, costs = points[best], costs[best]
    low, high, moves = LOW, HIGH, MOVES
    if demand.at_pace:
        third = np.arange(4) == 2
        low, high = np.where(third, -ACCELERATION, LOW), np.where(third, ACCELERATION, HIGH)
        moves = np.where(third, ACCELERATION_MOVE, 1.0) * MOVES
    step = np.full((len(points), 1), FIRST_STEP)
    while np.max(step) > FINEST:
        moved = np.clip(points[:, None] + step[:, None] * moves, low, high)
        tried = largest_torques(moved.reshape(-1, 4), demand, rows).reshape(len(points), -1)
        chosen = np.argmin(tried, axis=1)
        least = tried[np.arange(len(points)), chosen]
        better = least < costs
        points = np.where(better[:, None], moved[np.arange(len(points)), chosen], points)
        step = np.where((least < (1.0 - WORTH) * costs)[:, None], step, 0.5 * step)
        costs = np.where(better, least, costs)
    before, after = (coefficients[np.argmin(costs)].tolist() for coefficients in coefficients_of(points, demand))
    end, crossed = math.exp(points[np.argmin(costs), 0]), float(points[np.argmin(costs), 1])
    return PushedLaw(crossed * end, end, tuple(before), tuple(after))


def starts_for(demand: Demand) -> FloatArray:
    """Return where the search begins, float64[N, 4]: points as `LOW` has them."""
    if demand.at_pace:
        passage = 1.0 / (demand.terms.pace * demand.duration)
        ends = {*ENDS, *(min(1.0, number * passage) for number in PASSAGES if math.isfinite(passage))}
        thirds: tuple[float, ...] = ACCELERATIONS
    else:
        fall = 1.0 / (math.sqrt(abs(demand.terms.push)) * demand.duration) if demand.terms.push != 0.0 else 1.0
        ends = {*ENDS, *(min(1.0, number * fall) for number in FALLS)}
        thirds = SPEEDS
    points = [(math.log(end), crossed, third, 0.0) for end in sorted(ends) for crossed in CROSSED for third in thirds]
    return np.array(points)


def coefficients_of(points: FloatArray, demand: Demand) -> tuple[FloatArray, FloatArray]:
    """Return the coefficients of both polynomials, float64[N, 4], of points float64[N, 4] of the search."""
    end, crossed, third, jerk = np.exp(points[:, 0]), *points[:, 1:].T
    change = jerk / end**3
    if demand.at_pace:
        acceleration = third / end**2
        square = (demand.terms.fall * demand.duration**2 - demand.terms.along * acceleration) / demand.terms.bend
        rate = np.sqrt(np.where(square > 0.0, square, np.nan))
    else:
        rate = third / end
        acceleration = demand.terms.ratio * rate * rate + demand.terms.push * demand.duration**2
    first, second = crossed * end, (1.0 - crossed) * end
    before = np.stack((np.full_like(end, demand.place), rate * first, acceleration * first**2, change * first**3))
    after = np.stack(
        (np.full_like(end, 1.0 - demand.place), rate * second, -acceleration * second**2, change * second**3)
    )
    return (AT_END @ before).T, (AT_END @ after).T


def largest_torques(points: FloatArray, demand: Demand, rows: TorqueRows) -> FloatArray:
    """Return the largest torques (Nm) beyond friction of laws, float64[N], infinite where one goes backwards.

    Args:
        points: of the search, float64[N, 4], as `LOW` has them.
        demand: what they meet.
        rows: torques along the way.
    """
    end, crossed = np.exp(points[:, 0]), points[:, 1]
    largest, possible = np.zeros(len(points)), np.ones(len(points), bool)
    before, after = coefficients_of(points, demand)
    for coefficients, part, back in ((before, crossed * end, False), (after, (1.0 - crossed) * end, True)):
        seconds = (part * demand.duration)[:, None]
        place, rate, change = coefficients @ PLACE.T, coefficients @ RATE.T / seconds, coefficients @ CHANGE.T
        change /= seconds**2
        if back:
            place, change = 1.0 - place, -change
        # at rest the first coefficient alone has the direction; what has no speed at the crossing is NaN
        possible &= (coefficients[:, 0] >= 0.0) & (np.min(rate, axis=1) >= 0.0)
        index = np.clip(np.where(possible[:, None], place, 0.0) * WAYS, 0.0, WAYS - 1e-9)
        lower = index.astype(np.int64)
        share = index - lower
        at = [(1.0 - share) * column[lower] + share * column[lower + 1] for column in rows.columns()]
        determinant, *of_motors = at
        off = np.abs(determinant) > NEAR_LOCUS
        divisor = np.where(off, determinant, 1.0)
        for still, per_acceleration, per_speed, legs in (of_motors[:4], of_motors[4:]):
            whole = (still + per_acceleration * change + per_speed * rate**2) / divisor + legs
            largest = np.maximum(largest, np.max(np.where(off, np.abs(whole), 0.0), axis=1))
    return np.where(possible, largest, np.inf)
