# SPDX-License-Identifier: Apache-2.0
"""A time law near the quickest passage along a straight or rounded path, rest to rest, under equal torque limits.

Beyond friction the torque along a path is linear in sddot and sdot^2, so it goes with the inverse square of the
duration: what is quickest as a share of the duration does not depend on the limit, which only decides how long it
takes. `toppra` finds it on a grid along the way. Towards the Type 2 locus both coefficients grow without bound, and
their limits leave only passages with t_s . xddot = 0 there: the dynamic criterion keeps itself.

The result jumps from one limit to the other, which no drive follows. It is averaged over a window of the duration:
that bounds the rate of the torque, and costs 7 to 22 % of the time under the same limit (docs/laws.md). What the
average changes at the locus is corrected there.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Sequence
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_control.model.state import WorkingMode
from fivebar_control.root_search import zero_between
from fivebar_control.trajectory.criterion import criterion_terms
from fivebar_control.trajectory.path import Segment, Way, way_of
from fivebar_control.trajectory.refusal import PlanRefused
from fivebar_control.trajectory.rounded import RoundedSegment
from fivebar_control.trajectory.time_laws import CRITERION, OPTIMAL, QUINTIC, Untimed
from fivebar_control.trajectory.time_scaling import time_fraction
from fivebar_description.parameters import FiveBar, has_external_force

FloatArray = NDArray[np.float64]

GRID = 400
"""Intervals along the way on which the quickest passage is found."""

POINTS = np.linspace(0.0, 1.0, GRID + 1)
"""The shares of the way between them."""

QUARTERS = POINTS[:: GRID // 4]

WINDOW = 0.04
"""Width of the average, as a share of the duration of what is averaged; on a rounded path divided by its legs, so that
it is as long as along the same legs with rests between them."""

PER_WINDOW = 16
"""Instants in each window at which a law is checked to go forwards; it is smooth over a window."""

REACH = 0.1
"""Share of the duration on either side of the crossing within which a law is bent where a bump over all of it fails."""

LEAST_SPEED = 0.1
"""Least speed at a crossing about which a law is bent, in units of that at a constant speed throughout."""

CORRECTIONS = 20
"""Rounds of the secant method that make the acceleration at the crossing vanish, at most."""


class Hump(NamedTuple):
    """Factor of w(u) between the instants `centre` - `reach` and `centre` + `reach`."""

    factor: float
    centre: float
    reach: float


class OptimalLaw(NamedTuple):
    """A time law s(u) from 0 to 1: the average over a window of a passage with constant sddot between its instants.

    Attributes:
        times: of the instants, from 0 to 1.
        sums: the integral of the way over time up to each of them.
        ways, speeds: way and its derivative there.
        bump: factor of w(u) = u^3 (1 - u)^3, which is added.
        humps: what is added besides, each about one instant.
        window: its width, as a share of the duration of what is averaged.
    """

    times: tuple[float, ...]
    sums: tuple[float, ...]
    ways: tuple[float, ...]
    speeds: tuple[float, ...]
    bump: float = 0.0
    humps: tuple[Hump, ...] = ()
    window: float = WINDOW

    def __call__(self, u: float) -> tuple[float, float, float]:
        """Return s, ds/du, d2s/du2; outside [0, 1] the motion rests."""
        if u <= 0.0:
            return 0.0, 0.0, 0.0
        if u >= 1.0:
            return 1.0, 0.0, 0.0
        window = self.window
        stretched = 1.0 + window
        late = u * stretched
        sum1, way1, speed1 = self._at(late)
        sum0, way0, speed0 = self._at(late - window)
        s, ds, dds = (sum1 - sum0) / window, (way1 - way0) / window, (speed1 - speed0) / window
        v = u * (1.0 - u)
        s, ds, dds = (
            s + self.bump * v * v * v,
            stretched * ds + self.bump * 3.0 * v * v * (1.0 - 2.0 * u),
            stretched * stretched * dds + self.bump * 6.0 * v * ((1.0 - 2.0 * u) * (1.0 - 2.0 * u) - v),
        )
        for factor, centre, reach in self.humps:
            width = 2.0 * reach
            within = (u - centre) / width + 0.5
            if 0.0 < within < 1.0:
                w, dw, ddw = _hump(within)
                s += factor * w
                ds += factor * dw / width
                dds += factor * ddw / (width * width)
        return s, ds, dds

    def _at(self, t: float) -> tuple[float, float, float]:
        """Return the integral of the way, the way and its derivative at an instant of the passage."""
        if t <= 0.0:
            return 0.0, 0.0, 0.0
        if t >= 1.0:
            return self.sums[-1] + (t - 1.0), 1.0, 0.0
        k = bisect_right(self.times, t) - 1
        step, after = self.times[k + 1] - self.times[k], t - self.times[k]
        bend = (self.speeds[k + 1] - self.speeds[k]) / step
        way, speed = self.ways[k], self.speeds[k]
        return (
            self.sums[k] + after * (way + after * (0.5 * speed + after * bend / 6.0)),
            way + after * (speed + 0.5 * after * bend),
            speed + after * bend,
        )


def _hump(u: float) -> tuple[float, float, float]:
    """Return w = u^3 (1 - u)^3 and its two derivatives."""
    v = u * (1.0 - u)
    return v * v * v, 3.0 * v * v * (1.0 - 2.0 * u), 6.0 * v * ((1.0 - 2.0 * u) * (1.0 - 2.0 * u) - v)


class QuickPassage(NamedTuple):
    """The quickest passage under a torque limit.

    Attributes:
        law: before it is bent at crossings.
        duration: that of the law with 1 Nm (s Nm^(1/2)).
    """

    law: OptimalLaw
    duration: float


class CrossedWay(NamedTuple):
    """A path that crosses the Type 2 locus.

    Attributes:
        way: the path.
        crossed: shares of it at which it crosses.
        ratios: the s'' / s'^2 that meets the dynamic criterion at each of them.
    """

    way: Way
    crossed: tuple[float, ...]
    ratios: tuple[float, ...]


@lru_cache(maxsize=64)
def optimal_law(robot: FiveBar, mode: WorkingMode, path: CrossedWay) -> OptimalLaw | None:
    """Return the averaged quickest passage of a path for torque limits beyond friction, in a working mode.

    None where there is none that keeps going forwards and meets the criterion.
    """
    # loaded by plans with this time law only
    from fivebar_control.trajectory.passage_torques import torques_along

    passage = quickest_passage(path.way, torques_along(robot, mode, path.way, POINTS))
    return None if passage is None else bent_at_crossings(passage.law, path)


def quickest_passage(way: Way, rows: FloatArray) -> QuickPassage | None:
    """Return the quickest passage of a way, None for none.

    Args:
        way: the path.
        rows: what is limited to 1 Nm on the grid, as `TorqueLimits` takes it.
    """
    return passage_on(POINTS, rows, lambda whole: WINDOW / way.legs)


def passage_on(grid: FloatArray, rows: FloatArray, window_of: Callable[[float], float]) -> QuickPassage | None:
    """Return the quickest passage on a grid of shares of a way, float64[N] from 0 to 1, None for none.

    Args:
        grid: on which it is found.
        rows: as for `quickest_passage`.
        window_of: returns the width of the average, given the duration before it (s Nm^(1/2)).
    """
    speeds = _speeds(grid, rows)
    if speeds is None:
        return None
    durations = 2.0 * np.diff(grid) / (speeds[1:] + speeds[:-1])
    times = np.concatenate(([0.0], np.cumsum(durations)))
    whole = float(times[-1])
    times, speeds, durations = times / whole, speeds * whole, durations / whole
    # the same polynomials as in `_at`
    bends = np.diff(speeds) / durations
    parts = durations * (grid[:-1] + durations * (0.5 * speeds[:-1] + durations * bends / 6.0))
    sums = np.concatenate(([0.0], np.cumsum(parts)))
    window = window_of(whole)
    law = OptimalLaw(_numbers(times), _numbers(sums), _numbers(grid), _numbers(speeds), window=window)
    return QuickPassage(law, (1.0 + window) * whole)


def bent_at_crossings(law: OptimalLaw, path: CrossedWay) -> OptimalLaw | None:
    """Return a law bent so that it meets the criterion at every crossing of a path.

    None where that fails, or would go backwards.
    """
    if len(path.crossed) == path.way.legs == 1:
        # on a straight way one bump over all of it is milder than a hump about the crossing
        bent = _bent_at(law, path.crossed[0], path.ratios[0])
        if bent is not None and goes_forwards(bent):
            return bent
    met = bent_about(law, path)
    return met if met is not None and goes_forwards(met) else None


def goes_forwards(law: OptimalLaw) -> bool:
    """Return whether a law goes forwards everywhere between its ends."""
    instants = round(PER_WINDOW / law.window)
    return all(law(number / instants)[1] > 0.0 for number in range(1, instants))


def _numbers(values: FloatArray) -> tuple[float, ...]:
    return tuple(map(float, values))


def _bent_at(law: OptimalLaw, way: float, rho: float) -> OptimalLaw | None:
    """Return a law with s'' = rho s'^2 where it has gone a share of the way, bent over all of it; None for none."""

    def beyond(bump: float) -> float:
        bent = law._replace(bump=bump)
        _, ds, dds = bent(time_fraction(bent.__call__, way))
        return dds - rho * ds * ds

    # the bump moves the crossing too, so that its effect is not that of its curvature alone
    # here, because other motions need no library for it
    from scipy.optimize import newton

    root, state = newton(beyond, 0.0, x1=1e-2, tol=1e-9, maxiter=CORRECTIONS, full_output=True, disp=False)
    return law._replace(bump=float(root)) if state.converged else None


def bent_about(
    law: OptimalLaw, path: CrossedWay, pushes: Sequence[float] = (), farthest: float = REACH
) -> OptimalLaw | None:
    """Return a law that meets the criterion at every crossing of a path, bent about there only; None for none.

    No two of the humps overlap.

    Args:
        law: to be bent.
        path: that crosses.
        pushes: the s'' that gravity and a constant force need at each crossing, by shares of way and duration.
        farthest: share of the duration on either side of a crossing within which it is bent.
    """
    instants = [time_fraction(law.__call__, way) for way in path.crossed]
    least = min((after - before for before, after in pairwise(instants)), default=1.0)
    humps = []
    for crossed, way, rho, push in zip(
        instants, path.crossed, path.ratios, pushes or (0.0,) * len(instants), strict=True
    ):
        reach = min(farthest, 0.5 * crossed, 0.5 * (1.0 - crossed), 0.25 * least)
        hump = _hump_about(law, crossed, way, rho, push, reach)
        if hump is None:
            return None
        humps.append(hump)
    return law._replace(humps=tuple(humps))


def _hump_about(law: OptimalLaw, crossed: float, way: float, rho: float, push: float, reach: float) -> Hump | None:
    """Return what bends a law about the instant of a crossing.

    The hump's centre is that instant: it changes the acceleration there and moves the way by a fixed multiple of the
    change, so that one equation gives the instant. None where that is too near an end or another crossing, or where the
    platform would all but rest.
    """
    if reach < law.window:
        return None
    top, _, curvature = _hump(0.5)
    per_acceleration = -4.0 * reach * reach / curvature

    def beyond(centre: float) -> float:
        s, ds, dds = law(centre)
        return s + per_acceleration * (dds - rho * ds * ds - push) * top - way

    first, last = crossed - 0.5 * reach, crossed + 0.5 * reach
    if beyond(first) * beyond(last) > 0.0:
        return None
    centre = zero_between(beyond, first, last, 1e-15)
    _, ds, dds = law(centre)
    return Hump(per_acceleration * (dds - rho * ds * ds - push), centre, reach) if ds >= LEAST_SPEED else None


def _speeds(grid: FloatArray, rows: FloatArray) -> FloatArray | None:
    """Return the speeds ds/dt of the quickest passage on the grid, None for no passage."""
    # loaded by plans with this time law only
    from toppra import SplineInterpolator
    from toppra.algorithm import TOPPRA

    from fivebar_control.trajectory.passage_torques import TorqueLimits

    def speeds_at(scale: float) -> FloatArray | None:
        """Return the passage under the limits as rows that are multiplied by a number."""
        share = SplineInterpolator(QUARTERS, QUARTERS[:, None])
        search = TOPPRA([TorqueLimits(rows, scale)], share, gridpoints=grid, solver_wrapper="seidel")
        _, speeds, _ = search.compute_parameterization(0.0, 0.0)
        if speeds is None or not np.all(np.isfinite(speeds)) or np.any(speeds[1:-1] <= 0.0):
            return None
        return np.asarray(speeds, dtype=np.float64)

    speeds = speeds_at(1.0)
    if speeds is not None:
        return speeds
    # the solver's tolerances are absolute: small torques, of a light robot or a short way, are lost in them
    size = np.nanmedian(np.abs(rows[1]))
    return speeds_at(float(1.0 / size)) if size > 0.0 else None


def least_torque(untimed: Untimed) -> Segment | RoundedSegment:
    """Return a segment with the time law that takes the least torque beyond friction.

    Raises:
        PlanRefused: gravity or a constant force acts on the robot, or there is no such time law.
    """
    way = crossed_way(untimed, OPTIMAL)
    return with_law(untimed, optimal_law(untimed.robot, untimed.mode, way))


def crossed_way(untimed: Untimed, name: str) -> CrossedWay:
    """Return the way of a segment with what the criterion asks for where it crosses.

    Raises:
        PlanRefused: gravity or a constant force acts on the robot, of which the time law of that name knows nothing.
    """
    robot, mode, segment, number, crossed = untimed
    if has_external_force(robot):
        raise PlanRefused(
            f"segment {number}: the time law {name} knows nothing of gravity or a constant force (forces of the"
            f" robot file): expected {CRITERION}, or {QUINTIC}"
        )
    ratios = tuple(criterion_terms(robot, mode, segment, s).ratio for s in crossed)
    return CrossedWay(way_of(segment), crossed, ratios)


def with_law(untimed: Untimed, law: OptimalLaw | None) -> Segment | RoundedSegment:
    """Return a segment with a time law.

    Raises:
        PlanRefused: there is none.
    """
    if law is None:
        raise PlanRefused(
            f"segment {untimed.number}: has no passage of bounded torque that only goes forwards and meets the"
            " criterion: expected another time law, or a segment that crosses the Type 2 locus elsewhere"
        )
    return untimed.segment._replace(time_law=law.__call__)
