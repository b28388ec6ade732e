# SPDX-License-Identifier: Apache-2.0
"""Singularity analysis: the singular values of A in closed form, distances from the singular loci.

The rows of A are unit vectors, so with g = u_1 . u_2 and e = sign(g) the singular value decomposition A = U S V^T is
s1 = sqrt(1 + |g|), s2 = |det A| / s1, U_1 = (1, e) / sqrt(2), v1 = (u_1 + e u_2) / |u_1 + e u_2|. On the locus A_s of
the thesis (3.27) is s1 U_1^T, sign included: e = -1 for stretched distal links, +1 for folded ones. The rotation of
3.42 is not needed: v1 is the controllable direction anywhere.
"""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

from fivebar_control.model.geometry import workspace_margin
from fivebar_control.model.kinematics import det_a
from fivebar_control.model.state import State
from fivebar_description.parameters import FiveBar, LegParameters

SQRT_HALF = math.sqrt(0.5)

NEAR_LOCUS = 0.05
"""Below this kappa = 1/cond(A) the platform counts as near the Type 2 locus."""


DistalLinks = Literal["stretched", "folded"]
"""How the distal links lie on one line: the two branches of the Type 2 locus.

Stretched, they lie on either side of the platform, and the elbows are as far apart as they get, l_12 + l_22. Folded,
they lie on top of each other, and the elbows are as near as they get, |l_12 - l_22|: with equal links in one place.
"""

STRETCHED: DistalLinks = "stretched"
FOLDED: DistalLinks = "folded"


class ParallelSvd(NamedTuple):
    """Singular values and vectors of A.

    Attributes:
        s1, s2: singular values, s1 >= s2 >= 0; s2 = 0 is Type 2.
        fold: e = sign(u_1 . u_2): -1 distal links stretched, +1 folded onto each other.
        v_x, v_y: v1, the platform direction that stays controllable.
        t_x, t_y: t_s = v2, the direction that is uncontrollable on the locus (1.19, kernel of A there).
        kappa: 1 / cond(A) = s2 / s1, from 0 on the locus to 1.
    """

    s1: float
    s2: float
    fold: float
    v_x: float
    v_y: float
    t_x: float
    t_y: float
    kappa: float


def distal_links(state: State) -> DistalLinks:
    """Return the branch of the Type 2 locus that a posture is on, or nearer to in the angle of its distal links."""
    leg1, leg2 = state.leg1, state.leg2
    return distal_links_of(leg1.u_x * leg2.u_x + leg1.u_y * leg2.u_y)


def distal_links_of(cosine: float) -> DistalLinks:
    """Return the same for the cosine u_1 . u_2 of the angle between the distal links."""
    return STRETCHED if cosine < 0.0 else FOLDED


def parallel_svd(state: State) -> ParallelSvd:
    """Return the singular value decomposition of A; regular everywhere."""
    leg1, leg2 = state.leg1, state.leg2
    g = leg1.u_x * leg2.u_x + leg1.u_y * leg2.u_y
    fold = 1.0 if g >= 0.0 else -1.0
    s1 = math.sqrt(1.0 + abs(g))
    s2 = abs(det_a(state)) / s1
    v_x, v_y = leg1.u_x + fold * leg2.u_x, leg1.u_y + fold * leg2.u_y
    length = math.sqrt(v_x * v_x + v_y * v_y)
    v_x, v_y = v_x / length, v_y / length
    return ParallelSvd(s1, s2, fold, v_x, v_y, -v_y, v_x, s2 / s1)


def inverse_condition(state: State) -> float:
    """Return kappa = 1 / cond(A) = |det A| / (1 + |u_1 . u_2|)."""
    leg1, leg2 = state.leg1, state.leg2
    return inverse_condition_of(leg1.u_x, leg1.u_y, leg2.u_x, leg2.u_y)


def inverse_condition_of(u1_x: float, u1_y: float, u2_x: float, u2_y: float) -> float:
    """Return kappa from the rows of A, the unit vectors along the distal links."""
    return abs(u1_x * u2_y - u1_y * u2_x) / (1.0 + abs(u1_x * u2_x + u1_y * u2_y))


def inverse_condition_rate(state: State) -> float:
    """Return |d kappa / dt| (1/s) for the state's motion, from kappa = |tan(delta / 2)|, delta the distal angle."""
    leg1, leg2 = state.leg1, state.leg2
    g = leg1.u_x * leg2.u_x + leg1.u_y * leg2.u_y
    return abs(leg2.dtheta - leg1.dtheta) / (1.0 + abs(g))


def type1_margin(state: State) -> float:
    """Return min |sin q_i2|, from 0 at Type 1 (a leg stretched or folded, det B = 0) to 1."""
    sine1, sine2 = abs(state.leg1.sin_q2), abs(state.leg2.sin_q2)
    # min() would drop the NaN of a leg that is out of reach
    return sine1 if sine1 < sine2 or math.isnan(sine1) else sine2


def type1_distance(robot: FiveBar, state: State) -> float:
    """Return how far (m) the platform is from the nearer leg's Type 1 boundary."""
    return workspace_margin(robot, state.x, state.y)


def type2_distance(robot: FiveBar, state: State) -> float:
    """Return how far (m) the platform is from the Type 2 locus, to first order; NaN where a leg is at Type 1.

    The angle between the distal links, folded to (-pi/2, pi/2], over its gradient by the platform position.
    """
    determinant = det_a(state)
    angle = math.asin(min(abs(determinant), 1.0))
    g1_x, g1_y = _distal_gradient(robot.leg1, state.leg1.r_x, state.leg1.r_y, state.leg1.sin_q2)
    g2_x, g2_y = _distal_gradient(robot.leg2, state.leg2.r_x, state.leg2.r_y, state.leg2.sin_q2)
    slope = math.sqrt((g2_x - g1_x) * (g2_x - g1_x) + (g2_y - g1_y) * (g2_y - g1_y))
    return angle / slope if slope > 0.0 else math.inf


def _distal_gradient(leg: LegParameters, r_x: float, r_y: float, sin_q2: float) -> tuple[float, float]:
    """Return d theta_i / d (x, y) in rad/m: dtheta_i = -r_i . xdot / (l_i2 sin q_i2)."""
    if sin_q2 == 0.0:
        return math.nan, math.nan
    scale = -1.0 / (leg.distal * sin_q2)
    return scale * r_x, scale * r_y
