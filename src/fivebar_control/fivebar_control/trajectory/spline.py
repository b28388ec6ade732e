# SPDX-License-Identifier: Apache-2.0
"""Motions through points at given times: splines of fifth degree in the platform's coordinates or the motor angles."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from typing import NamedTuple, overload

import numpy as np
from numpy.typing import NDArray

from fivebar_control.model.kinematics import platform_acceleration, state_from_motors
from fivebar_control.model.line import Line
from fivebar_control.model.state import Platform
from fivebar_control.trajectory.joint_segment import NO_LINE
from fivebar_description.parameters import FiveBar

FloatArray = NDArray[np.float64]


class Knot(NamedTuple):
    """Both coordinates at a time (s) after the beginning, with their first and second derivatives."""

    time: float
    coordinate1: float
    coordinate2: float
    rate1: float
    rate2: float
    acceleration1: float
    acceleration2: float


class Knots(Sequence[Knot]):
    """Knots in one block of memory, in which many of them are passed on to another process at once.

    Attributes:
        times: of the knots (s), float64[N].
    """

    __slots__ = ("_rows", "times")

    def __init__(self, rows: FloatArray) -> None:
        """Take the numbers of the knots, float64[N, 7]."""
        self._rows = rows
        self.times = rows[:, 0]

    def __len__(self) -> int:
        return len(self._rows)

    @overload
    def __getitem__(self, index: int) -> Knot: ...
    @overload
    def __getitem__(self, index: slice) -> Knots: ...
    def __getitem__(self, index: int | slice) -> Knot | Knots:
        if isinstance(index, slice):
            return Knots(self._rows[index])
        return Knot(*self._rows[index].tolist())

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Knots) and np.array_equal(self._rows, other._rows)

    def __hash__(self) -> int:
        return hash(self._rows.tobytes())

    def __reduce__(self) -> tuple[type[Knots], tuple[FloatArray]]:
        return Knots, (self._rows,)


class SplineSegment(NamedTuple):
    """One motion from rest to rest through knots.

    Attributes:
        knots: the first at time 0.
        robot: whose geometry gives the platform, where the coordinates are motor angles.
        assembly: its assembly mode, the sign of det A; 0 where the coordinates are those of the platform.
        start_time: s since sample 0.
    """

    knots: Knots
    robot: FiveBar
    assembly: int
    start_time: float = 0.0

    @property
    def duration(self) -> float:
        """From the first knot to the last (s)."""
        return self.knots[-1].time

    def coordinates_at(self, t: float) -> Knot:
        """Return both coordinates at time t (s); before and after the segment they rest."""
        since = t - self.start_time
        for end, outside in ((self.knots[0], since < 0.0), (self.knots[-1], since >= self.duration)):
            if outside:
                return Knot(since, end.coordinate1, end.coordinate2, 0.0, 0.0, 0.0, 0.0)
        number = bisect_right(self.knots.times, since)
        begin, end = self.knots[number - 1], self.knots[number]
        first = _between(begin, end, 1, since)
        second = _between(begin, end, 2, since)
        return Knot(since, first[0], second[0], first[1], second[1], first[2], second[2])

    def at(self, t: float) -> Platform:
        """Return the reference at time t (s); NaN where the distal links cannot meet."""
        _, value1, value2, rate1, rate2, acceleration1, acceleration2 = self.coordinates_at(t)
        if self.assembly == 0:
            return Platform(value1, value2, rate1, rate2, acceleration1, acceleration2)
        state = state_from_motors(self.robot, self.assembly, value1, value2, rate1, rate2)
        return Platform(
            state.x, state.y, state.vx, state.vy, *platform_acceleration(state, acceleration1, acceleration2)
        )

    def line_at(self, t: float) -> Line:
        """Return NaN: the way in the plane is no line."""
        return NO_LINE


class SplineWay(NamedTuple):
    """A way through knots, whatever time it takes; their times are lengths along it, from 0 on (m)."""

    knots: Knots

    def at(self, s: float) -> tuple[float, float, float, float, float, float]:
        """Return the place (m) at a share s of the way, with its first and second derivative by s (m)."""
        length = self.knots[-1].time
        gone = min(max(s, 0.0), 1.0) * length
        number = min(bisect_right(self.knots.times, gone), len(self.knots) - 1)
        begin, end = self.knots[number - 1], self.knots[number]
        x, d_x, b_x = _between(begin, end, 1, gone)
        y, d_y, b_y = _between(begin, end, 2, gone)
        return x, y, d_x * length, d_y * length, b_x * length * length, b_y * length * length

    def moved(self, s: float, ds: float, dds: float) -> Platform:
        """Return the platform at a share of the way, given its two derivatives by time (1/s, 1/s^2)."""
        x, y, d_x, d_y, b_x, b_y = self.at(s)
        return Platform(x, y, d_x * ds, d_y * ds, d_x * dds + b_x * ds * ds, d_y * dds + b_y * ds * ds)


def _between(begin: Knot, end: Knot, coordinate: int, t: float) -> tuple[float, float, float]:
    """Return coordinate 1 or 2 by the polynomial of fifth degree between two knots, and its derivatives."""
    (p0, v0, a0), (p1, v1, a1) = begin[coordinate::2], end[coordinate::2]
    h, s = end.time - begin.time, t - begin.time
    # what is left to the end value, speed and acceleration of the parabola from the beginning
    gap = p1 - p0 - h * (v0 + 0.5 * h * a0)
    speed, acceleration = (v1 - v0 - h * a0) * h, (a1 - a0) * h * h
    c3 = (10.0 * gap - 4.0 * speed + 0.5 * acceleration) / h**3
    c4 = (-15.0 * gap + 7.0 * speed - acceleration) / h**4
    c5 = (6.0 * gap - 3.0 * speed + 0.5 * acceleration) / h**5
    return (
        p0 + s * (v0 + s * (0.5 * a0 + s * (c3 + s * (c4 + s * c5)))),
        v0 + s * (a0 + s * (3.0 * c3 + s * (4.0 * c4 + s * 5.0 * c5))),
        a0 + s * (6.0 * c3 + s * (12.0 * c4 + s * 20.0 * c5)),
    )


def completed(
    times: Sequence[float],
    positions: Sequence[tuple[float, float]],
    rates: Sequence[tuple[float, float] | None],
    accelerations: Sequence[tuple[float, float] | None],
) -> Knots:
    """Return knots with what is not given chosen so that the motion is as smooth as it can be.

    Where a knot between the ends lacks its rates and accelerations, the third and fourth derivatives go through it
    without a step; where it lacks its accelerations alone, the third.

    Args:
        times: of the knots (s), rising.
        positions: both coordinates of each.
        rates: their first derivatives, None where they are not given; those of both ends are.
        accelerations: their second derivatives; as `rates`.
    """
    columns = [
        _column(
            times,
            [place[axis] for place in positions],
            [None if rate is None else rate[axis] for rate in rates],
            [None if acceleration is None else acceleration[axis] for acceleration in accelerations],
        )
        for axis in (0, 1)
    ]
    rows = [
        (time, place[0], place[1], rate1, rate2, acceleration1, acceleration2)
        for time, place, (rate1, acceleration1), (rate2, acceleration2) in zip(times, positions, *columns, strict=True)
    ]
    return Knots(np.array(rows, dtype=np.float64))


def _column(
    times: Sequence[float],
    places: Sequence[float],
    rates: Sequence[float | None],
    accelerations: Sequence[float | None],
) -> list[tuple[float, float]]:
    """Return rate and acceleration of every knot in one coordinate.

    Unknown are the rate and the acceleration of each knot in turn. A condition at a knot concerns its own and those of
    both neighbours, so that the matrix of all has a band of three diagonals on either side.
    """
    # here, because motions without knots need no library for it
    from scipy.linalg import solve_banded

    count = len(times)
    h, gap = np.diff(np.asarray(times, dtype=np.float64)), np.diff(np.asarray(places, dtype=np.float64))
    # of each condition the factors of what the knot before, the knot, and the one after have
    factors, right = np.zeros((count, 2, 6)), np.zeros((count, 2))
    for which, end_values, order in ((0, rates, 4), (1, accelerations, 3)):
        known = np.array([end_value is not None for end_value in end_values])
        ends, constants = _derivatives(order, h, gap, at_end=True)
        begins, other = _derivatives(order, h, gap, at_end=False)
        factors[1:, which, :4] += ends
        factors[:-1, which, 2:] -= begins
        right[1:, which] -= constants
        right[:-1, which] += other
        factors[known, which] = 0.0
        factors[known, which, 2 + which] = 1.0
        right[known, which] = [end_value for end_value in end_values if end_value is not None]
    # rates and accelerations have other units: without scales the matrix is ill-conditioned for short intervals
    scale = (times[-1] - times[0]) / max(count - 1, 1)
    weights = np.array([1.0, 1.0 / scale])
    factors *= np.tile(weights, 3)
    largest = np.abs(factors).max(axis=2)
    factors /= largest[:, :, None]
    band = np.zeros((7, 2 * count))
    for which in (0, 1):
        for place in range(6):
            # row 2 n + which, column 2 n - 2 + place
            diagonal, first = 3 + which + 2 - place, place - 2
            columns = np.arange(count) * 2 + first
            inside = (columns >= 0) & (columns < 2 * count)
            if 0 <= diagonal < 7:
                band[diagonal, columns[inside]] = factors[inside, which, place]
    solved = solve_banded((3, 3), band, (right / largest).ravel()).reshape(count, 2) * weights
    return [
        (solution[0] if rate is None else rate, solution[1] if acceleration is None else acceleration)
        for solution, rate, acceleration in zip(solved.tolist(), rates, accelerations, strict=True)
    ]


def _derivatives(order: int, h: FloatArray, gap: FloatArray, at_end: bool) -> tuple[FloatArray, FloatArray]:
    """Return the third or fourth derivatives at one end of intervals of h (s), float64[N].

    Returns:
        Their factors of rate and acceleration at the beginning and at the end, float64[N, 4], and the constants,
        float64[N].
    """
    ones = np.ones_like(h)
    if order == 3:
        rows = (
            (-24.0 * ones, -3.0 * h, -36.0 * ones, 9.0 * h)
            if at_end
            else (-36.0 * ones, -9.0 * h, -24.0 * ones, 3.0 * h)
        )
        return np.stack(rows, axis=1) / h[:, None] ** 2, 60.0 * gap / h**3
    if at_end:
        rows = (-168.0 * ones, -24.0 * h, -192.0 * ones, 36.0 * h)
    else:
        rows = (192.0 * ones, 36.0 * h, 168.0 * ones, -24.0 * h)
    return np.stack(rows, axis=1) / h[:, None] ** 3, (360.0 if at_end else -360.0) * gap / h**4
