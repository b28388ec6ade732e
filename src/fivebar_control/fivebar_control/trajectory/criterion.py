"""The dynamic criterion (1.19, 2.4, 4.21): crossings that need no force along the uncontrollable direction.

On the Type 2 locus m t_s^T xddot = 0 whatever the motors do, so a reference that has t_s^T xddot = 0 there can be
tracked with bounded torque. On a straight path this is a vanishing acceleration along the path at the moment of
crossing, which the fifth-order polynomial has at half of its way only and a seventh-order one can have anywhere.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

from fivebar_control.model.kinematics import state_from_platform
from fivebar_control.model.singularity import parallel_svd
from fivebar_control.model.state import Platform
from fivebar_description.parameters import FiveBar

MONOTONE_GRID = 400
"""Points at which a polynomial is checked for going forwards only."""

CROSSING_RANGE = (0.15, 0.85)
"""Range of the fraction of the duration at which a criterion polynomial may cross the locus."""

RATIO_RANGE = (0.3, 1.4)
"""Range of (u - 1/2) / (s - 1/2) for a crossing at the fraction u of the duration and s of the way: half way only
u = 1/2 is possible, and near it only a narrow range of u."""

LEAST_OFFSET = 1e-6
"""Crossings nearer to half of the way than this fraction are taken to be this far from it: there the equations for the
polynomial become singular, and what is left of the acceleration is 1e-5 of its peak."""


class CriterionLaw(NamedTuple):
    """A seventh-order rest-to-rest time law s(u) = u^3 (c3 + c4 u + c5 u^2 + c6 u^3 + c7 u^4), from 0 to 1 in u."""

    c3: float
    c4: float
    c5: float
    c6: float
    c7: float

    def __call__(self, u: float) -> tuple[float, float, float]:
        """Return s, ds/du, d2s/du2; outside [0, 1] the motion rests."""
        if u <= 0.0:
            return 0.0, 0.0, 0.0
        if u >= 1.0:
            return 1.0, 0.0, 0.0
        c3, c4, c5, c6, c7 = self
        return (
            u * u * u * (c3 + u * (c4 + u * (c5 + u * (c6 + u * c7)))),
            u * u * (3.0 * c3 + u * (4.0 * c4 + u * (5.0 * c5 + u * (6.0 * c6 + u * 7.0 * c7)))),
            u * (6.0 * c3 + u * (12.0 * c4 + u * (20.0 * c5 + u * (30.0 * c6 + u * 42.0 * c7)))),
        )


def criterion_law(s_crossing: float) -> CriterionLaw | None:
    """Return the time law that passes s = `s_crossing` without acceleration, with the least peak acceleration.

    None where no such law goes forwards only, which happens for crossings near the ends of the way.
    """

    offset = math.copysign(max(abs(s_crossing - 0.5), LEAST_OFFSET), s_crossing - 0.5)
    points = np.linspace(0.0, 1.0, MONOTONE_GRID + 1).tolist()

    def law_at(ratio: float) -> CriterionLaw:
        return _law_through(0.5 + ratio * offset, 0.5 + offset)

    def peak(ratio: float) -> float:
        if not CROSSING_RANGE[0] <= 0.5 + ratio * offset <= CROSSING_RANGE[1]:
            return 1e9
        law = law_at(ratio)
        rates = np.array([law(u)[1:] for u in points])
        return float(np.max(np.abs(rates[:, 1]))) if np.all(rates[:, 0] >= 0.0) else 1e9

    grid = np.linspace(*RATIO_RANGE, 45).tolist()
    first = min(grid, key=peak)
    step = grid[1] - grid[0]
    refined = float(minimize_scalar(peak, bounds=(first - step, first + step), method="bounded").x)
    best = min((first, refined), key=peak)
    return law_at(best) if peak(best) < 1e9 else None


def _law_through(u: float, s: float) -> CriterionLaw:
    """Return the law with s(u) = s and s''(u) = 0 besides rest at both ends."""
    powers = np.arange(3, 8)
    matrix = np.array(
        [
            np.ones(5),
            powers,
            powers * (powers - 1),
            u**powers,
            powers * (powers - 1) * u ** (powers - 2),
        ],
        dtype=np.float64,
    )
    c3, c4, c5, c6, c7 = np.linalg.solve(matrix, np.array([1.0, 0.0, 0.0, s, 0.0])).tolist()
    return CriterionLaw(c3, c4, c5, c6, c7)


def criterion_residual(robot: FiveBar, mode1: int, mode2: int, motion: Platform) -> float:
    """Return m t_s^T xddot (N) of a motion: which the criterion (1.19) requires to vanish on the locus."""
    state = state_from_platform(robot, mode1, mode2, motion.x, motion.y, motion.vx, motion.vy)
    svd = parallel_svd(state)
    return robot.mass * (svd.t_x * motion.ax + svd.t_y * motion.ay)
