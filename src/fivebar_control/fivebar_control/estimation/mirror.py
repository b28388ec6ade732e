# SPDX-License-Identifier: Apache-2.0
"""Detection of an ambiguous assembly mode: whether the mirrored posture explains the encoders as well.

Motor angles alone fit two postures, mirror images in the line through both elbows. They meet on the Type 2 locus where
the distal links are stretched; where they are folded, the images are on opposite sides of the elbows. Where they meet,
the two histories of a robot, "it went through" and "it turned back", agree in every angle so far and differ in
nothing but the sign of the velocity across that line. Only the platform's momentum distinguishes them, so the estimate
is as reliable as its velocity is certain: after a slow crossing both remain possible.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from fivebar_control.estimation.covariance import VX, VY, Matrix, X, Y
from fivebar_control.estimation.ekf import Belief, FilterModel
from fivebar_control.estimation.platform_motion import LegMotion, leg_motion
from fivebar_control.model.singularity import NEAR_LOCUS, inverse_condition_of
from fivebar_description.parameters import FiveBar

TEST_KAPPA = 0.1
"""Within this 1/cond(A) the mirrored state is tested; farther from the locus it is many millimetres away."""


class Mirror(NamedTuple):
    """The distance of the mirrored platform along the unit normal of the elbow line, and its rate: m and m/s."""

    normal_x: float
    normal_y: float
    position: float
    velocity: float


def mirrored(robot: FiveBar, leg1: LegMotion, leg2: LegMotion, belief: Belief) -> Mirror | None:
    """Return where the other assembly mode with the same motor angles and speeds is; None where both elbows coincide.

    With e the unit vector from elbow to elbow, n its normal and s = n . (P - E_1), the platform is mirrored to
    P - 2 s n; along n the velocity changes by -2 ds/dt.
    """
    estimate = belief.estimate
    links1, links2 = robot.leg1, robot.leg2
    e1_x, e1_y = links1.base_x + links1.proximal * leg1.r_x, links1.proximal * leg1.r_y
    e2_x, e2_y = links2.base_x + links2.proximal * leg2.r_x, links2.proximal * leg2.r_y
    length = math.hypot(e2_x - e1_x, e2_y - e1_y)
    if not length > 0.0:
        return None
    n_x, n_y = -(e2_y - e1_y) / length, (e2_x - e1_x) / length
    speed1, speed2 = links1.proximal * leg1.dq1, links2.proximal * leg2.dq1
    v1_x, v1_y = -speed1 * leg1.r_y, speed1 * leg1.r_x
    v2_x, v2_y = -speed2 * leg2.r_y, speed2 * leg2.r_x
    turn = ((v2_x - v1_x) * n_x + (v2_y - v1_y) * n_y) / length
    x, y = estimate.x - e1_x, estimate.y - e1_y
    # dn/dt = -turn e, and e = (n_y, -n_x)
    rate = (estimate.vx - v1_x) * n_x + (estimate.vy - v1_y) * n_y - turn * (x * n_y - y * n_x)
    return Mirror(n_x, n_y, -2.0 * (x * n_x + y * n_y), -2.0 * rate)


def deviations(mirror: Mirror, covariance: Matrix) -> float:
    """Return how many standard deviations the mirrored state is from the estimate (Mahalanobis).

    Of position and velocity along the normal alone: what the other states say could only add to the distance.
    """
    n_x, n_y = mirror.normal_x, mirror.normal_y
    p = covariance
    pp = n_x * (n_x * p[X, X] + n_y * p[X, Y]) + n_y * (n_x * p[Y, X] + n_y * p[Y, Y])
    pv = n_x * (n_x * p[X, VX] + n_y * p[X, VY]) + n_y * (n_x * p[Y, VX] + n_y * p[Y, VY])
    vv = n_x * (n_x * p[VX, VX] + n_y * p[VX, VY]) + n_y * (n_x * p[VY, VX] + n_y * p[VY, VY])
    determinant = pp * vv - pv * pv
    if not determinant > 0.0:
        return math.inf
    s, ds = mirror.position, mirror.velocity
    return math.sqrt(max(0.0, (vv * s * s - 2.0 * pv * s * ds + pp * ds * ds) / determinant))


class AmbiguityLimits(NamedTuple):
    """Limits of the ambiguity test: least standard deviations to the mirror image, longest dwell near the locus (s)."""

    mirror_deviations: float
    dwell_limit: float


class AmbiguityCheck(NamedTuple):
    """Result of the ambiguity test of one sample.

    Attributes:
        near: consecutive samples near the locus so far.
        deviations: standard deviations between the estimate and its mirror image; infinite where none was tested.
        ambiguous: whether the assembly mode is no longer known.
    """

    near: int
    deviations: float
    ambiguous: bool


def check_ambiguity(model: FilterModel, limits: AmbiguityLimits, near: int, belief: Belief) -> AmbiguityCheck:
    """Return the ambiguity test of a belief after `near` samples near the locus.

    Past the dwell limit the mirror image is not tested.
    """
    e = belief.estimate
    x, y, vx, vy = e.x, e.y, e.vx, e.vy
    leg1 = leg_motion(model.robot.leg1, model.mode[0], x, y, vx, vy)
    leg2 = leg_motion(model.robot.leg2, model.mode[1], x, y, vx, vy)
    kappa = inverse_condition_of(leg1.u_x, leg1.u_y, leg2.u_x, leg2.u_y)
    near = near + 1 if kappa < NEAR_LOCUS else 0
    if near * model.period > limits.dwell_limit:
        return AmbiguityCheck(near, math.inf, True)
    if not kappa < TEST_KAPPA:
        return AmbiguityCheck(near, math.inf, False)
    distance = _to_mirror(model.robot, leg1, leg2, belief)
    return AmbiguityCheck(near, distance, not distance >= limits.mirror_deviations)


def mirror_distance(model: FilterModel, belief: Belief) -> float:
    """Return how many standard deviations the other assembly mode is from a belief; infinite far from the locus."""
    e = belief.estimate
    x, y, vx, vy = e.x, e.y, e.vx, e.vy
    leg1 = leg_motion(model.robot.leg1, model.mode[0], x, y, vx, vy)
    leg2 = leg_motion(model.robot.leg2, model.mode[1], x, y, vx, vy)
    if not inverse_condition_of(leg1.u_x, leg1.u_y, leg2.u_x, leg2.u_y) < TEST_KAPPA:
        return math.inf
    return _to_mirror(model.robot, leg1, leg2, belief)


def _to_mirror(robot: FiveBar, leg1: LegMotion, leg2: LegMotion, belief: Belief) -> float:
    mirror = mirrored(robot, leg1, leg2, belief)
    return 0.0 if mirror is None else deviations(mirror, belief.covariance)


def ambiguity_reason(model: FilterModel, limits: AmbiguityLimits, check: AmbiguityCheck) -> str:
    """Return in words why an estimate is ambiguous."""
    dwelt = check.near * model.period
    if dwelt > limits.dwell_limit:
        return f"1/cond(A) below {NEAR_LOCUS} for {dwelt:.3f} s, limit {limits.dwell_limit:g} s"
    return (
        f"the other assembly mode is {check.deviations:.1f} standard deviations away,"
        f" limit {limits.mirror_deviations:g}"
    )
