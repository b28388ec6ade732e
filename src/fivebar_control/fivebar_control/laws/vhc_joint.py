# SPDX-License-Identifier: Apache-2.0
"""Virtual holonomic constraint with joint controlled variables, u2 (2.5 to 2.11, 3.1 to 3.19), anywhere on the locus.

The constraint ties each motor to the platform's progress s along the path: h_i = q_i1 - phi_i(s), phi the inverse
geometry of the path point at arc length s. Two constraints meet one controllable direction, so what is asked of both is
met where they agree and by least squares otherwise, as the thesis says of 3.14. They agree to first order: beside the
path at a distance eps, h = p(s) eps with p = dq/deps across the path. As p changes along the path, gains on h and its
rate would not be gains on eps; the law leaves out the parts of both that come from the change of p.
"""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from fivebar_control.laws.adaptive_gain import (
    ALPHA,
    ENABLED,
    ERROR_LIMIT,
    KEEP_DAMPING,
    NO_MEMORY,
    AdaptiveGain,
    GainMemory,
    gain_factors,
    gain_memory,
)
from fivebar_control.laws.gains import KD, KP, RESOLUTION
from fivebar_control.laws.law import MIN_AUTHORITY, Instant, Law
from fivebar_control.laws.reference import Reference
from fivebar_control.laws.resolution import Enforced, fall_along_locus, resolved
from fivebar_control.laws.torque import UNDEFINED, Torque
from fivebar_control.model.geometry import wrap
from fivebar_control.model.kinematics import leg_from_platform, state_from_platform
from fivebar_control.model.line import Line
from fivebar_control.model.singularity import parallel_svd
from fivebar_control.model.state import Leg, State, WorkingMode
from fivebar_description.parameters import FiveBar, LegParameters, has_external_force


class JointConstraint(NamedTuple):
    """One motor's virtual constraint at the path point.

    Attributes:
        h, dh: the constraint (rad) and its rate (rad/s).
        slope: phi', change of the motor's angle along the path (rad/m).
        across: p, its change across the path, along the normal (rad/m).
        across_rate: rate of p as the path point moves (rad/(m s)).
    """

    h: float
    dh: float
    slope: float
    across: float
    across_rate: float


def joint_constraint(
    parameters: LegParameters, measured: Leg, on_path: Leg, speed: float, n_x: float, n_y: float
) -> JointConstraint:
    """Return a motor's constraint (2.5, 3.1) from its leg and the leg at the path point.

    With the path point's rates at unit speed along the path and across it, phi' and p are rates of the motor. While the
    platform moves straight on, ddq_i1 = c_i / b_i is quadratic in the velocity (3.8); its mixed part is dp/ds.

    Args:
        parameters: of the leg.
        measured: the leg as it is.
        on_path: the leg at the path point, run through at unit speed along the path.
        speed: of the path point (m/s).
        n_x, n_y: unit normal of the path.
    """
    aside = leg_from_platform(parameters, on_path.q1, on_path.q2, n_x, n_y)
    twist = math.nan
    if on_path.b != 0.0:
        distal = parameters.distal * on_path.dtheta * aside.dtheta
        twist = (distal + parameters.proximal * on_path.cos_q2 * on_path.dq1 * aside.dq1) / on_path.b
    return JointConstraint(
        h=wrap(measured.q1 - on_path.q1),
        dh=measured.dq1 - on_path.dq1 * speed,
        slope=on_path.dq1,
        across=aside.dq1,
        across_rate=twist * speed,
    )


def path_constraints(
    robot: FiveBar, mode: WorkingMode, state: State, line: Line
) -> tuple[JointConstraint, JointConstraint]:
    """Return both motors' constraints for the path point at the platform's arc length along a line.

    All is NaN where the path point is out of reach or at Type 1.
    """
    d_x, d_y = line.direction_x, line.direction_y
    s = d_x * (state.x - line.x) + d_y * (state.y - line.y)
    speed = d_x * state.vx + d_y * state.vy
    on_path = state_from_platform(robot, mode, line.x + s * d_x, line.y + s * d_y, d_x, d_y)
    return (
        joint_constraint(robot.leg1, state.leg1, on_path.leg1, speed, d_y, -d_x),
        joint_constraint(robot.leg2, state.leg2, on_path.leg2, speed, d_y, -d_x),
    )


def vhc_joint_torque(
    robot: FiveBar,
    mode: WorkingMode,
    state: State,
    reference: Reference,
    line: Line,
    kp: float,
    kd: float,
    resolution: int,
) -> Torque:
    """Return u2; kp in 1/s^2, kd in 1/s.

    Undefined (NaN) at Type 1, where the path runs across t_s, or where the path point is out of reach.

    With xddot = alpha v1 the motors get qddot = N v1 alpha + B^-1 c and the path point sddot = alpha d . v1, so that
    hddot = (N v1 - phi' d . v1) alpha beyond what it is while the platform coasts. Asked for is the h that belongs to
    the distance eps from the path with epsddot = -(Kp eps + Kd epsdot): two equations for alpha, solved by least
    squares (3.14), with p epsdot = hdot - pdot eps and eps from both h.
    """
    if state.leg1.b == 0.0 or state.leg2.b == 0.0:
        return UNDEFINED
    svd = parallel_svd(state)
    first, second = path_constraints(robot, mode, state, line)
    n1 = (state.leg1.u_x * svd.v_x + state.leg1.u_y * svd.v_y) / state.leg1.b
    n2 = (state.leg2.u_x * svd.v_x + state.leg2.u_y * svd.v_y) / state.leg2.b
    along = line.direction_x * svd.v_x + line.direction_y * svd.v_y
    e1, e2 = n1 - first.slope * along, n2 - second.slope * along
    authority = e1 * e1 + e2 * e2
    spread = first.across * first.across + second.across * second.across
    if authority == 0.0 or spread == 0.0:
        return UNDEFINED
    distance = (first.across * first.h + second.across * second.h) / spread
    v1 = -kp * first.h - kd * (first.dh - first.across_rate * distance)
    v2 = -kp * second.h - kd * (second.dh - second.across_rate * distance)
    fall1 = fall2 = 0.0
    if has_external_force(robot):
        # what the platform's fall along t_s does to both motors, and to the path point
        fall = fall_along_locus(robot, svd)
        fall1 = (state.leg1.u_x * svd.t_x + state.leg1.u_y * svd.t_y) / state.leg1.b * fall
        fall2 = (state.leg2.u_x * svd.t_x + state.leg2.u_y * svd.t_y) / state.leg2.b * fall
        aside = (line.direction_x * svd.t_x + line.direction_y * svd.t_y) * fall
        v1, v2 = v1 - (fall1 - first.slope * aside), v2 - (fall2 - second.slope * aside)
    alpha = (e1 * v1 + e2 * v2) / authority
    ddq11 = n1 * alpha + state.leg1.c / state.leg1.b + fall1
    ddq21 = n2 * alpha + state.leg2.c / state.leg2.b + fall2
    beta = svd.t_x * reference.ax + svd.t_y * reference.ay
    enforced = Enforced(alpha, ddq11, ddq21, beta)
    return resolved(resolution, robot, state, svd, enforced, Torque(reference.f1, reference.f2))


class VhcJointSettings(NamedTuple):
    """Settings of the constraint law with joint variables, the adaptive gain (4.1.3) among them."""

    kp: Annotated[float, KP] = 2500.0
    kd: Annotated[float, KD] = 100.0
    resolution: Annotated[str, RESOLUTION] = "full_friction"
    adaptive_gain: Annotated[bool, ENABLED] = True
    alpha: Annotated[float, ALPHA] = AdaptiveGain().alpha
    error_limit: Annotated[float, ERROR_LIMIT] = AdaptiveGain().error_limit
    keep_damping: Annotated[bool, KEEP_DAMPING] = AdaptiveGain().keep_damping


def vhc_joint_step(
    robot: FiveBar, instant: Instant, memory: GainMemory, settings: VhcJointSettings
) -> tuple[Torque, GainMemory]:
    """Return u2 for a sample; the settings are numbers, as `as_numbers` makes them."""
    state, desired = instant.state, instant.reference.state
    factor_p = factor_d = 1.0
    if settings.adaptive_gain:
        error_x, error_y = state.x - desired.x, state.y - desired.y
        memory = gain_memory(memory, instant.zone_weight > 0.0, error_x, error_y)
        factor_p, factor_d = gain_factors(
            memory, error_x, error_y, settings.alpha, settings.error_limit, settings.keep_damping
        )
    torque = vhc_joint_torque(
        robot,
        instant.mode,
        state,
        instant.reference,
        instant.line,
        settings.kp * factor_p,
        settings.kd * factor_d,
        settings.resolution,  # type: ignore[arg-type]
    )
    return torque, memory


LAW = Law(
    name="vhc_joint",
    title="constraint law (joints)",
    settings=VhcJointSettings,
    step=vhc_joint_step,
    memory=NO_MEMORY,
    topic_name="vhc",
    executable="vhc_controller",
    min_authority=MIN_AUTHORITY,
)
