"""The dynamic criterion (1.19, 2.4, 4.21): crossings that ask nothing of the direction in which nothing can be asked.

On the Type 2 locus m t_s^T xddot = 0 whatever the motors do, so a reference that has t_s^T xddot = 0 there can be
tracked with bounded torque. On a straight path this is a vanishing acceleration along the path at the moment of
crossing, which the fifth-order polynomial has at half of its way only and a seventh-order one can have anywhere.
"""

from __future__ import annotations

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

    def peak(u: float) -> float:
        law = _law_through(u, s_crossing)
        grid = np.linspace(0.0, 1.0, MONOTONE_GRID + 1)
        rates = np.array([law(float(point))[1:] for point in grid])
        return float(np.max(np.abs(rates[:, 1]))) if np.all(rates[:, 0] >= 0.0) else 1e9

    best = minimize_scalar(peak, bounds=CROSSING_RANGE, method="bounded", options={"xatol": 1e-6})
    grid = np.linspace(*CROSSING_RANGE, 71)
    candidates = [float(best.x), *(float(u) for u in grid)]
    chosen = min(candidates, key=peak)
    return _law_through(chosen, s_crossing) if peak(chosen) < 1e9 else None


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
    """Return m t_s^T xddot (N) of a motion: what the criterion (1.19) asks to vanish on the locus."""
    state = state_from_platform(robot, mode1, mode2, motion.x, motion.y, motion.vx, motion.vy)
    svd = parallel_svd(state)
    return robot.mass * (svd.t_x * motion.ax + svd.t_y * motion.ay)
