"""Virtual holonomic constraint with joint controlled variables, u2 (2.5 to 2.11, 3.1 to 3.19), anywhere on the locus.

The constraint ties each motor to the platform's progress s along the path: h_i = q_i1 - phi_i(s), phi the inverse
geometry of the path point at arc length s. Two constraints meet one controllable direction, so the accelerations that
keep both are exact on the locus with h = 0 and a least-squares compromise otherwise, as the thesis says of 3.14.
"""

from __future__ import annotations

from typing import NamedTuple

from fivebar_control.laws.reference import Reference
from fivebar_control.laws.resolution import Resolution
from fivebar_control.laws.torque import UNDEFINED, Torque
from fivebar_control.model.geometry import wrap
from fivebar_control.model.kinematics import joint_acceleration, state_from_platform
from fivebar_control.model.line import Line
from fivebar_control.model.singularity import parallel_svd
from fivebar_control.model.state import Leg, State
from fivebar_description.parameters import FiveBar


class JointConstraint(NamedTuple):
    """One motor's virtual constraint: h (rad), its rate (rad/s), phi' (rad/m) and phi'' sdot^2 (rad/s^2)."""

    h: float
    dh: float
    slope: float
    bend: float


def joint_constraint(measured: Leg, on_path: Leg, speed: float) -> JointConstraint:
    """Return a motor's constraint (2.5, 3.1) from its leg and the leg at the path point, run through at unit speed.

    At unit speed along the straight path xddot = 0, so phi' is the leg's rate and phi'' = c_i / b_i (3.8).
    """
    return JointConstraint(
        h=wrap(measured.q1 - on_path.q1),
        dh=measured.dq1 - on_path.dq1 * speed,
        slope=on_path.dq1,
        bend=joint_acceleration(on_path, 0.0, 0.0) * speed * speed,
    )


def path_constraints(
    robot: FiveBar, mode1: int, mode2: int, state: State, line: Line
) -> tuple[JointConstraint, JointConstraint]:
    """Return both motors' constraints for the path point at the platform's arc length along a line."""
    d_x, d_y = line.direction_x, line.direction_y
    s = d_x * (state.x - line.x) + d_y * (state.y - line.y)
    speed = d_x * state.vx + d_y * state.vy
    on_path = state_from_platform(robot, mode1, mode2, line.x + s * d_x, line.y + s * d_y, d_x, d_y)
    return (
        joint_constraint(state.leg1, on_path.leg1, speed),
        joint_constraint(state.leg2, on_path.leg2, speed),
    )


def vhc_joint_torque(
    robot: FiveBar,
    mode1: int,
    mode2: int,
    state: State,
    reference: Reference,
    line: Line,
    kp: float,
    kd: float,
    resolve: Resolution,
) -> Torque:
    """Return u2; kp in 1/s^2, kd in 1/s.

    Undefined (NaN) at Type 1, where the path runs across t_s, or where the path point is out of reach.

    The constraints ask for qddot = phi'' sdot^2 + phi' sddot - Kp h - Kd hdot (3.3, 3.18; 3.17 drops the term in
    sddot). With xddot = alpha v1 and its sddot = alpha d . v1, that is (N v1 - phi' d . v1) alpha = v - B^-1 c for
    v = phi'' sdot^2 - Kp h - Kd hdot: two equations for alpha, solved by least squares (3.14).
    """
    if state.leg1.b == 0.0 or state.leg2.b == 0.0:
        return UNDEFINED
    svd = parallel_svd(state)
    first, second = path_constraints(robot, mode1, mode2, state, line)
    v1 = first.bend - kp * first.h - kd * first.dh
    v2 = second.bend - kp * second.h - kd * second.dh
    n1 = (state.leg1.u_x * svd.v_x + state.leg1.u_y * svd.v_y) / state.leg1.b
    n2 = (state.leg2.u_x * svd.v_x + state.leg2.u_y * svd.v_y) / state.leg2.b
    drift1, drift2 = state.leg1.c / state.leg1.b, state.leg2.c / state.leg2.b
    along = line.direction_x * svd.v_x + line.direction_y * svd.v_y
    e1, e2 = n1 - first.slope * along, n2 - second.slope * along
    authority = e1 * e1 + e2 * e2
    if authority == 0.0:
        return UNDEFINED
    alpha = (e1 * (v1 - drift1) + e2 * (v2 - drift2)) / authority
    return resolve(robot, state, svd, alpha, n1 * alpha + drift1, n2 * alpha + drift2, reference.f1, reference.f2)
