# SPDX-License-Identifier: Apache-2.0
"""The equations of a robot at rest on the Type 2 locus (docs/bounds.md, from rest)."""

from __future__ import annotations

from typing import NamedTuple

from fivebar_control.model.dynamics import direct_dynamics
from fivebar_control.model.singularity import parallel_svd
from fivebar_control.model.state import Leg, State
from fivebar_description.parameters import FiveBar, LegParameters


class RestMotion(NamedTuple):
    """The effect of a torque on a robot at rest on the Type 2 locus.

    Attributes:
        along: acceleration along v1 (m/s^2).
        lost: acceleration along t_s (m/s^2), 0 on the locus whatever the torque.
        determinant: second derivative of det A (1/s^2); its sign is that of the assembly mode to which it goes.
        growth: F (1 / l_12 - e / l_22) / m (1/s^2), the square of the rate at which a displacement along t_s grows;
            negative where it swings.
    """

    along: float
    lost: float
    determinant: float
    growth: float


def rest_motion(robot: FiveBar, state: State, tau1: float, tau2: float) -> RestMotion:
    """Return what torques (Nm) beyond friction do to a robot at rest on the locus."""
    response, svd = direct_dynamics(robot, state, tau1, tau2, 0.0, 0.0), parallel_svd(state)
    (t1_x, t1_y), (t2_x, t2_y) = (
        _turn_per_move(leg, parameters) for leg, parameters in ((state.leg1, robot.leg1), (state.leg2, robot.leg2))
    )
    force = 0.5 * (response.lambda1 - svd.fold * response.lambda2)
    return RestMotion(
        along=svd.v_x * response.ax + svd.v_y * response.ay,
        lost=svd.t_x * response.ax + svd.t_y * response.ay,
        determinant=svd.fold * ((t2_x - t1_x) * response.ax + (t2_y - t1_y) * response.ay),
        growth=force * (1.0 / robot.leg1.distal - svd.fold / robot.leg2.distal) / robot.mass,
    )


def _turn_per_move(leg: Leg, parameters: LegParameters) -> tuple[float, float]:
    """Return the gradient (rad/m) of a distal link's angle by the platform's place."""
    scale = -1.0 / (parameters.distal * leg.sin_q2)
    return scale * leg.r_x, scale * leg.r_y
