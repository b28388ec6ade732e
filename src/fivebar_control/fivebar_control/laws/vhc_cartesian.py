# SPDX-License-Identifier: Apache-2.0
"""Virtual holonomic constraint with a Cartesian controlled variable, u3 (3.20 to 3.36), anywhere on the locus.

The constraint keeps the platform on the line of the current path segment: h = n . (x - P_a), n its unit normal. It is
geometric, not timed, so the uncontrollable direction is free to run as the free dynamics (2.2) lets it.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

from fivebar_control.laws.gains import KD, KP, RESOLUTION
from fivebar_control.laws.law import MIN_AUTHORITY, Instant, Law
from fivebar_control.laws.reference import Reference
from fivebar_control.laws.resolution import Enforced, fall_along_locus, resolved
from fivebar_control.laws.torque import UNDEFINED, Torque
from fivebar_control.model.kinematics import joint_acceleration
from fivebar_control.model.line import Line
from fivebar_control.model.singularity import parallel_svd
from fivebar_control.model.state import State
from fivebar_description.parameters import FiveBar, has_external_force


class Constraint(NamedTuple):
    """The virtual constraint h (m), its rate (m/s) and its normal n."""

    h: float
    dh: float
    n_x: float
    n_y: float


def line_constraint(line: Line, x: float, y: float, vx: float, vy: float) -> Constraint:
    """Return the signed distance from the line and its rate; n is the direction turned by -90 degrees.

    On the vertical path of the thesis (from y = 0.15 m downwards) n = (-1, 0) and on the way back n = (1, 0).
    """
    n_x, n_y = line.direction_y, -line.direction_x
    return Constraint(n_x * (x - line.x) + n_y * (y - line.y), n_x * vx + n_y * vy, n_x, n_y)


def vhc_cartesian_torque(
    robot: FiveBar,
    state: State,
    reference: Reference,
    line: Line,
    kp: float,
    kd: float,
    resolution: int,
) -> Torque:
    """Return u3; kp in 1/s^2, kd in 1/s. Undefined (NaN) where the path runs along t_s or a leg is at Type 1.

    xddot = alpha v1 with n . xddot = -(Kp h + Kd hdot) (3.36), qddot = B^-1 (A xddot + c), the torque by one of
    `RESOLUTIONS`. With gravity in the plane or a constant force xddot = alpha v1 + beta t_s, as the platform falls.
    """
    svd = parallel_svd(state)
    constraint = line_constraint(line, state.x, state.y, state.vx, state.vy)
    authority = constraint.n_x * svd.v_x + constraint.n_y * svd.v_y
    if authority == 0.0:
        return UNDEFINED
    alpha = -(kp * constraint.h + kd * constraint.dh) / authority
    ax, ay = alpha * svd.v_x, alpha * svd.v_y
    if has_external_force(robot):
        beta = fall_along_locus(robot, svd)
        alpha -= beta * (constraint.n_x * svd.t_x + constraint.n_y * svd.t_y) / authority
        ax, ay = alpha * svd.v_x + beta * svd.t_x, alpha * svd.v_y + beta * svd.t_y
    enforced = Enforced(
        alpha,
        joint_acceleration(state.leg1, ax, ay),
        joint_acceleration(state.leg2, ax, ay),
        svd.t_x * reference.ax + svd.t_y * reference.ay,
    )
    return resolved(resolution, robot, state, svd, enforced, Torque(reference.f1, reference.f2))


class VhcCartesianSettings(NamedTuple):
    """Settings of the constraint law with the Cartesian variable."""

    kp: Annotated[float, KP] = 2500.0
    kd: Annotated[float, KD] = 100.0
    resolution: Annotated[str, RESOLUTION] = "full_friction"


def vhc_cartesian_step(
    robot: FiveBar, instant: Instant, memory: None, settings: VhcCartesianSettings
) -> tuple[Torque, None]:
    """Return u3 for a sample; the settings are numbers, as `as_numbers` makes them."""
    torque = vhc_cartesian_torque(
        robot,
        instant.state,
        instant.reference,
        instant.line,
        settings.kp,
        settings.kd,
        settings.resolution,  # type: ignore[arg-type]
    )
    return torque, memory


LAW = Law(
    name="vhc_cartesian",
    title="constraint law (Cartesian)",
    settings=VhcCartesianSettings,
    step=vhc_cartesian_step,
    topic_name="vhc",
    executable="vhc_controller",
    min_authority=MIN_AUTHORITY,
)
