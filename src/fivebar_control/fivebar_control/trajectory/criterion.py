# SPDX-License-Identifier: Apache-2.0
"""The dynamic criterion (1.19, 2.4, 4.21): crossings that need no force along the uncontrollable direction.

On the Type 2 locus m t_s^T xddot = 0 whatever the motors do, so a reference that has t_s^T xddot = 0 there can be
tracked with bounded torque. On a straight path this is a vanishing acceleration along the path at the moment of
crossing, which the fifth-order polynomial has at half of its way only and a seventh-order one can have anywhere.

Moments M_i of residual inertias are forces M_i p_i on the platform, dtheta_i = p_i . xdot, so that then
t_s^T (m xddot + sum p_i M_i) = 0 on the locus: on a straight path s'' = rho s'^2 at the crossing, with a rho that the
posture determines. The fifth-order polynomial has it near half of its way only. On a curve x(s) the acceleration is
x' s'' + x'' s'^2, so that its curvature counts the same way: rho = - (t_s . x'') / (t_s . x') without such moments.

With gravity in the plane or a constant force w_e the platform falls along t_s while it crosses, and
t_s^T (m xddot - w_e) = 0: s'' = rho s'^2 + t_s . w_e / (m t_s . x'). Across t_s the path has to bend with the fall, and
the speed is that of the fall: s'^2 = t_s . w_e / (m t_s . x''). `pushed_law` has the time laws for both.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

import numpy as np

from fivebar_control.model.dynamics import distal_row
from fivebar_control.model.kinematics import state_from_platform
from fivebar_control.model.singularity import parallel_svd
from fivebar_control.model.state import Platform, WorkingMode
from fivebar_control.root_search import minimum_between, zero_between
from fivebar_control.trajectory.path import Segment, way_of
from fivebar_control.trajectory.pushed_law import CriterionTerms, Demand, pushed_law
from fivebar_control.trajectory.refusal import PlanRefused, place
from fivebar_control.trajectory.rounded import RoundedSegment
from fivebar_control.trajectory.time_laws import CRITERION, OPTIMAL, Untimed
from fivebar_control.trajectory.time_scaling import rest_to_rest
from fivebar_description.parameters import (
    FiveBar,
    external_force,
    has_external_force,
    has_residual,
    without_external_force,
)

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

MOST_BENT = 2.0
"""Largest s'' / s'^2 at a crossing, by shares of the way, that a polynomial is sought for: in a corner it grows. Beyond
that a platform that falls passes the corner at a pace of its own."""

ACROSS = 0.5
"""|t_s . d| of a path's direction d at a crossing below which it goes across the platform's fall."""

LITTLE = 0.1
"""Share of all forces along t_s below which the platform hardly falls."""

MET = 0.1
"""Remainder of the criterion, as a share of the fall, with which a reference meets it."""

SLOWEST_BEND = 10.0
"""Pace (m/s) of a bend beyond which it is none."""

USUAL_RADIUS = 0.025
"""Radius (m) for which a refusal names the pace of a bend."""


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


def criterion_law(s_crossing: float, rho: float = 0.0) -> CriterionLaw | None:
    """Return the time law that meets the criterion at s = `s_crossing`, with the least peak acceleration.

    There s'' = rho s'^2, without acceleration for rho = 0. None where no such law goes forwards only, which happens for
    crossings near the ends of the way.
    """
    middle = _where_quintic_meets(rho)
    half = rest_to_rest(middle)[0] if rho != 0.0 else 0.5
    offset = math.copysign(max(abs(s_crossing - half), LEAST_OFFSET), s_crossing - half)
    points = np.linspace(0.0, 1.0, MONOTONE_GRID + 1).tolist()

    def law_at(ratio: float) -> CriterionLaw:
        return _law_through(middle + ratio * offset, half + offset, rho)

    def peak(ratio: float) -> float:
        if not CROSSING_RANGE[0] <= middle + ratio * offset <= CROSSING_RANGE[1]:
            return 1e9
        law = law_at(ratio)
        rates = np.array([law(u)[1:] for u in points])
        return float(np.max(np.abs(rates[:, 1]))) if np.all(rates[:, 0] >= 0.0) else 1e9

    grid = np.linspace(*RATIO_RANGE, 45).tolist()
    first = min(grid, key=peak)
    step = grid[1] - grid[0]
    refined = minimum_between(peak, first - step, first + step)[0]
    best = min((first, refined), key=peak)
    return law_at(best) if peak(best) < 1e9 else None


def _where_quintic_meets(rho: float) -> float:
    """Return u near 1/2 where the fifth-order polynomial has s'' = rho s'^2: 1 - 2 u = 15 rho (u (1 - u))^3."""
    if rho == 0.0:
        return 0.5
    # there is exactly one such place on that side of 1/2
    side = (0.0, 0.5) if rho > 0.0 else (0.5, 1.0)
    return zero_between(lambda u: u - 0.5 + 7.5 * rho * (u * (1.0 - u)) ** 3, *side, tolerance=0.0)


def _law_through(u: float, s: float, rho: float) -> CriterionLaw:
    """Return the law with s(u) = s and s''(u) = rho s'(u)^2 besides rest at both ends."""
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
    still = np.linalg.solve(matrix, np.array([1.0, 0.0, 0.0, s, 0.0]))
    if rho != 0.0:
        # the law for an acceleration a at u is still + a by_a, and a = rho s'(u)^2 a quadratic equation
        by_a = np.linalg.solve(matrix, np.array([0.0, 0.0, 0.0, 0.0, 1.0]))
        rate = powers * u ** (powers - 1)
        v, w = float(rate @ still), float(rate @ by_a)
        square = (1.0 - 2.0 * rho * v * w) ** 2 - (2.0 * rho * v * w) ** 2
        if square < 0.0:
            return CriterionLaw(*(math.nan,) * 5)
        still = still + 2.0 * rho * v * v / (1.0 - 2.0 * rho * v * w + math.sqrt(square)) * by_a
    c3, c4, c5, c6, c7 = still.tolist()
    return CriterionLaw(c3, c4, c5, c6, c7)


class Passed(Protocol):
    """A way that is passed from rest to rest."""

    def moved(self, s: float, ds: float, dds: float) -> Platform:
        """Return the platform at a share of the way, given its two derivatives by time (1/s, 1/s^2)."""


def criterion_terms(robot: FiveBar, mode: WorkingMode, segment: Passed, s: float) -> CriterionTerms:
    """Return what the criterion asks for at a share of a way on the locus."""
    free = without_external_force(robot)
    return CriterionTerms(
        criterion_residual(free, mode, segment.moved(s, 0.0, 1.0)),
        criterion_residual(free, mode, segment.moved(s, 1.0, 0.0)),
        -criterion_residual(robot, mode, segment.moved(s, 0.0, 0.0)),
    )


def criterion_residual(robot: FiveBar, mode: WorkingMode, motion: Platform) -> float:
    """Return t_s^T (m xddot - w_e + sum p_i M_i) (N) of a motion: which the criterion (1.19) requires to vanish."""
    state = state_from_platform(robot, mode, motion.x, motion.y, motion.vx, motion.vy)
    svd = parallel_svd(state)
    force_x, force_y = external_force(robot)
    force = robot.mass * (svd.t_x * motion.ax + svd.t_y * motion.ay) - (svd.t_x * force_x + svd.t_y * force_y)
    if not has_residual(robot):
        return force
    for parameters, leg in ((robot.leg1, state.leg1), (robot.leg2, state.leg2)):
        row = distal_row(parameters, leg)
        turn = row.p_x * motion.ax + row.p_y * motion.ay + row.drift
        force += parameters.residual * turn * (svd.t_x * row.p_x + svd.t_y * row.p_y)
    return force


def through_criterion(untimed: Untimed) -> Segment | RoundedSegment:
    """Return a segment with the time law that meets the dynamic criterion where it crosses, if it does.

    Raises:
        PlanRefused: it crosses more than once, or no such time law only goes forwards.
    """
    robot, mode, segment, number, crossed = untimed
    if not crossed:
        return segment
    if len(crossed) > 1:
        raise PlanRefused(
            f"segment {number}: crosses the Type 2 locus {len(crossed)} times: expected at most one crossing per"
            " segment to meet the dynamic criterion"
        )
    terms = criterion_terms(robot, mode, segment, crossed[0])
    bent = isinstance(segment, RoundedSegment) and abs(terms.bend) > MOST_BENT * abs(terms.along)
    if has_external_force(robot):
        return _falling(untimed, Demand(crossed[0], terms, segment.duration, bent))
    if bent:
        at = segment.moved(crossed[0], 0.0, 0.0)
        raise PlanRefused(
            f"segment {number}: crosses the Type 2 locus in a corner, at {place(at.x, at.y)}: no polynomial that"
            f" only goes forwards meets the dynamic criterion there: s'' / s'^2 = {terms.ratio:.3g}, expected at most"
            f" {MOST_BENT:g}; the time law {OPTIMAL} may"
        )
    law = criterion_law(crossed[0], terms.ratio)
    if law is None:
        raise PlanRefused(
            f"segment {number}: crosses the Type 2 locus after {crossed[0]:.0%} of its way: no polynomial that only"
            " goes forwards meets the dynamic criterion so near an end"
        )
    return segment._replace(time_law=law.__call__)


def _falling(untimed: Untimed, demand: Demand) -> Segment | RoundedSegment:
    """Return a segment with the time law that gravity or a constant force needs where it crosses."""
    robot, mode, segment, number, _ = untimed
    law = pushed_law(robot, mode, way_of(segment), demand)
    if law is None:
        raise PlanRefused(f"segment {number}: {_why_not_falling(untimed, demand)}")
    return segment._replace(time_law=law.__call__)


def _why_not_falling(untimed: Untimed, demand: Demand) -> str:
    robot, mode, segment, _, (crossed,) = untimed
    pace = demand.terms.pace
    at = segment.moved(crossed, pace if math.isfinite(pace) else 1.0, 0.0)
    return fall_problem(robot, mode, at) or (
        f"crosses the Type 2 locus at {place(at.x, at.y)}, where gravity or the constant force accelerates the platform"
        f" by {demand.terms.push:.3g} of its way per s^2: no motion that only goes forwards meets the dynamic criterion"
        " there: expected a longer way on either side of the locus, or another place"
    )


def fall_problem(robot: FiveBar, mode: WorkingMode, motion: Platform) -> str:
    """Return why a path that goes across t_s does not follow the platform's fall, and what would; "" where it does.

    Args:
        robot: on which forces act all the time.
        mode: working mode.
        motion: of the reference on the Type 2 locus; at rest there is no path to judge.
    """
    x, y, vx, vy, ax, ay = motion
    speed = math.hypot(vx, vy)
    if speed == 0.0:
        return ""
    d_x, d_y = vx / speed, vy / speed
    along = d_x * ax + d_y * ay
    bend_x, bend_y = (ax - along * d_x) / speed**2, (ay - along * d_y) / speed**2
    free = without_external_force(robot)
    terms = CriterionTerms(
        criterion_residual(free, mode, Platform(x, y, 0.0, 0.0, d_x, d_y)),
        criterion_residual(free, mode, Platform(x, y, d_x, d_y, bend_x, bend_y)),
        -criterion_residual(robot, mode, Platform(x, y, 0.0, 0.0, 0.0, 0.0)),
    )
    svd = parallel_svd(state_from_platform(robot, mode, x, y, 0.0, 0.0))
    if abs(svd.t_x * d_x + svd.t_y * d_y) >= ACROSS or abs(terms.fall) < LITTLE * math.hypot(*external_force(robot)):
        return ""
    if terms.pace < SLOWEST_BEND:
        if abs(terms.along * along + terms.bend * speed**2 - terms.fall) < MET * abs(terms.fall):
            return ""
        return (
            f"at {place(x, y)} on the Type 2 locus the platform falls across the path, and follows its bend at"
            f" {terms.pace:.3g} m/s only: the reference has {speed:.3g} m/s there; the time law {CRITERION} has that"
            " pace in rounded corners"
        )
    falls = abs(terms.fall) / robot.mass
    side = math.copysign(1.0, terms.fall)
    return (
        f"at {place(x, y)} on the Type 2 locus no motor holds the platform, which falls across the path by"
        f" {falls:.3g} m/s^2: expected a corner there that bends towards ({side * svd.t_x:.2f}, {side * svd.t_y:.2f}),"
        f" which falls at {math.sqrt(falls * USUAL_RADIUS):.3g} m/s where its radius is {1e3 * USUAL_RADIUS:.0f} mm,"
        " or a path along that direction"
    )
