"""The time law of the quickest passage along a straight segment, rest to rest, under equal limits of both torques.

Beyond friction the torque along a path is linear in sddot and sdot^2, so it goes with the inverse square of the
duration: what is quickest as a share of the duration does not depend on the limit, which only decides how long it
takes. `toppra` finds it on a grid along the way. Towards the Type 2 locus both coefficients grow without bound, and
their limits leave only passages with t_s . xddot = 0 there: the dynamic criterion keeps itself.

The result jumps from one limit to the other, which no drive follows. It is averaged over a window of the duration:
that bounds the rate of the torque. What the average changes at the locus is corrected there.
"""

from __future__ import annotations

from bisect import bisect_right
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, newton

from fivebar_control.model.dynamics import inverse_dynamics_of_platform
from fivebar_control.model.kinematics import state_from_platform
from fivebar_description.parameters import FiveBar

FloatArray = NDArray[np.float64]

GRID = 400
"""Intervals along the way on which the quickest passage is found."""

OFF_LOCUS = 1e-7
"""Share of the way by which a point of the grid is moved that has no inverse dynamics."""

WINDOW = 0.04
"""Width of the average, as a share of the duration of what is averaged."""

REACH = 0.1
"""Share of the duration on either side of the crossing within which a law is bent where a bump over all of it fails."""

LEAST_SPEED = 0.1
"""Least speed at a crossing about which a law is bent, in units of that at a constant speed throughout."""

CORRECTIONS = 20
"""Rounds of the secant method that make the acceleration at the crossing vanish, at most."""


class OptimalLaw(NamedTuple):
    """A time law s(u) from 0 to 1: the average over `WINDOW` of a passage with constant sddot between its instants.

    Attributes:
        times: of the instants, from 0 to 1.
        sums: the integral of the way over time up to each of them.
        ways, speeds: way and its derivative there.
        bump: factor of w(u) = u^3 (1 - u)^3, which is added.
        local, centre, reach: factor of w that is added between the instants `centre` - `reach` and `centre` + `reach`.
    """

    times: tuple[float, ...]
    sums: tuple[float, ...]
    ways: tuple[float, ...]
    speeds: tuple[float, ...]
    bump: float = 0.0
    local: float = 0.0
    centre: float = 0.5
    reach: float = 0.5

    def __call__(self, u: float) -> tuple[float, float, float]:
        """Return s, ds/du, d2s/du2; outside [0, 1] the motion rests."""
        if u <= 0.0:
            return 0.0, 0.0, 0.0
        if u >= 1.0:
            return 1.0, 0.0, 0.0
        stretched = 1.0 + WINDOW
        late = u * stretched
        sum1, way1, speed1 = self._at(late)
        sum0, way0, speed0 = self._at(late - WINDOW)
        s, ds, dds = (sum1 - sum0) / WINDOW, (way1 - way0) / WINDOW, (speed1 - speed0) / WINDOW
        v = u * (1.0 - u)
        s, ds, dds = (
            s + self.bump * v * v * v,
            stretched * ds + self.bump * 3.0 * v * v * (1.0 - 2.0 * u),
            stretched * stretched * dds + self.bump * 6.0 * v * ((1.0 - 2.0 * u) * (1.0 - 2.0 * u) - v),
        )
        width = 2.0 * self.reach
        within = (u - self.centre) / width + 0.5
        if self.local != 0.0 and 0.0 < within < 1.0:
            w, dw, ddw = _hump(within)
            s += self.local * w
            ds += self.local * dw / width
            dds += self.local * ddw / (width * width)
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


@cache
def optimal_law(
    robot: FiveBar,
    mode1: int,
    mode2: int,
    start: tuple[float, float],
    end: tuple[float, float],
    crossed: tuple[float, ...],
) -> OptimalLaw | None:
    """Return the quickest time law of a segment; None where there is none that keeps going forwards.

    Args:
        robot: of the controllers.
        mode1, mode2: working mode.
        start, end: of the segment (m).
        crossed: shares of the way at which it crosses the Type 2 locus, one at most to have its acceleration corrected.
    """
    grid = np.linspace(0.0, 1.0, GRID + 1)
    speeds = _speeds(robot, mode1, mode2, start, end, grid)
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
    law = OptimalLaw(_numbers(times), _numbers(sums), _numbers(grid), _numbers(speeds))
    if len(crossed) != 1:
        return law if _goes_forwards(law) else None
    bent = _coasting_at(law, crossed[0])
    if bent is not None and _goes_forwards(bent):
        return bent
    bent = _coasting_about(law, crossed[0])
    return bent if bent is not None and _goes_forwards(bent) else None


def _goes_forwards(law: OptimalLaw) -> bool:
    return all(law(u)[1] > 0.0 for u in np.linspace(0.0, 1.0, 4 * GRID + 1)[1:-1].tolist())


def _numbers(values: FloatArray) -> tuple[float, ...]:
    return tuple(map(float, values))


def _coasting_at(law: OptimalLaw, way: float) -> OptimalLaw | None:
    """Return a law without acceleration where it has gone a share of the way; None where none is found."""

    def acceleration(bump: float) -> float:
        bent = law._replace(bump=bump)
        return bent(float(brentq(lambda u: bent(u)[0] - way, 0.0, 1.0, xtol=1e-15)))[2]

    # the bump moves the crossing too, so that its effect is not that of its curvature alone
    found, state = newton(acceleration, 0.0, x1=1e-2, tol=1e-9, maxiter=CORRECTIONS, full_output=True, disp=False)
    return law._replace(bump=float(found)) if state.converged else None


def _coasting_about(law: OptimalLaw, way: float) -> OptimalLaw | None:
    """Return a law without acceleration where it has gone a share of the way, bent about there only.

    The hump's centre is the instant of the crossing: it takes away the acceleration of that instant and moves the way
    by a fixed multiple of it, so that one equation gives the instant. None where that is too near an end, or where the
    platform would all but rest.
    """
    crossed = float(brentq(lambda u: law(u)[0] - way, 0.0, 1.0, xtol=1e-15))
    reach = min(REACH, 0.5 * crossed, 0.5 * (1.0 - crossed))
    if reach < WINDOW:
        return None
    top, _, curvature = _hump(0.5)
    per_acceleration = -4.0 * reach * reach / curvature

    def beyond(centre: float) -> float:
        s, _, dds = law(centre)
        return s + per_acceleration * dds * top - way

    first, last = crossed - 0.5 * reach, crossed + 0.5 * reach
    if beyond(first) * beyond(last) > 0.0:
        return None
    centre = float(brentq(beyond, first, last, xtol=1e-15))
    bent = law._replace(local=per_acceleration * law(centre)[2], centre=centre, reach=reach)
    return bent if bent(centre)[1] >= LEAST_SPEED else None


def _speeds(
    robot: FiveBar, mode1: int, mode2: int, start: tuple[float, float], end: tuple[float, float], grid: FloatArray
) -> FloatArray | None:
    """Return the speeds ds/dt of the quickest passage under 1 Nm beyond friction on the grid, None for no passage."""
    # loaded by plans with this time law only
    from toppra import SplineInterpolator
    from toppra.algorithm import TOPPRA
    from toppra.constraint import DiscretizationType, SecondOrderConstraint

    length_x, length_y = end[0] - start[0], end[1] - start[1]

    def torque(way: Any, speed: Any, acceleration: Any) -> FloatArray:
        for moved in (0.0, OFF_LOCUS):
            s, ds, dds = float(way[0]) + moved, float(speed[0]), float(acceleration[0])
            place = start[0] + s * length_x, start[1] + s * length_y
            state = state_from_platform(robot, mode1, mode2, *place, ds * length_x, ds * length_y)
            found = np.array(inverse_dynamics_of_platform(robot, state, dds * length_x, dds * length_y, 0.0, 0.0))
            if np.all(np.isfinite(found)):
                break
        return found

    both = np.vstack((np.eye(2), -np.eye(2)))
    constraint = SecondOrderConstraint(
        torque, lambda way: both, lambda way: np.ones(4), 1, discretization_scheme=DiscretizationType.Collocation
    )
    path = SplineInterpolator(grid[:: GRID // 4], grid[:: GRID // 4, None])
    search = TOPPRA([constraint], path, gridpoints=grid, solver_wrapper="seidel")
    _, speeds, _ = search.compute_parameterization(0.0, 0.0)
    if speeds is None or not np.all(np.isfinite(speeds)) or np.any(speeds[1:-1] <= 0.0):
        return None
    return np.asarray(speeds, dtype=np.float64)
