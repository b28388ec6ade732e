# SPDX-License-Identifier: Apache-2.0
"""The constraint form of the direct dynamics, K lambda = B ZZ^-1 (tau - f) - c: regular at Types 1 and 2."""

from __future__ import annotations

import math
from typing import NamedTuple

from fivebar_control.model.state import State
from fivebar_description.parameters import FiveBar, external_acceleration, has_external_force

NAN = math.nan


class DynamicResponse(NamedTuple):
    """Accelerations and multipliers: qddot (rad/s^2), xddot (m/s^2), lambda (N)."""

    ddq11: float
    ddq21: float
    ax: float
    ay: float
    lambda1: float
    lambda2: float


class ConstraintForm(NamedTuple):
    """The matrix K of the constraint form K lambda = B ZZ^-1 (tau - f) - c, symmetric, and what it is made of.

    K = A A^T / m + B ZZ^-1 B.

    Attributes:
        k11, k12, k22: entries of K (1/kg).
        per_mass: 1 / m (1/kg).
        per_zz1, per_zz2: diagonal of ZZ^-1 (1/(kg m^2)).
        lever1, lever2: diagonal of ZZ^-1 B (1/(kg m)).
    """

    k11: float
    k12: float
    k22: float
    per_mass: float
    per_zz1: float
    per_zz2: float
    lever1: float
    lever2: float


def constraint_form(robot: FiveBar, state: State) -> ConstraintForm:
    """Return the constraint form of the direct dynamics; regular on the Type 1 and Type 2 loci."""
    leg1, leg2 = state.leg1, state.leg2
    # divisions are slow, and these are the same for a whole run: a compiler takes them out of its loops
    per_mass, per_zz1, per_zz2 = 1.0 / robot.mass, 1.0 / robot.leg1.inertia, 1.0 / robot.leg2.inertia
    lever1, lever2 = per_zz1 * leg1.b, per_zz2 * leg2.b
    return ConstraintForm(
        k11=per_mass + leg1.b * lever1,
        k12=per_mass * (leg1.u_x * leg2.u_x + leg1.u_y * leg2.u_y),
        k22=per_mass + leg2.b * lever2,
        per_mass=per_mass,
        per_zz1=per_zz1,
        per_zz2=per_zz2,
        lever1=lever1,
        lever2=lever2,
    )


class Pushed(NamedTuple):
    """The right side of the constraints (m/s^2), and the platform's acceleration without lambda (m/s^2)."""

    right1: float
    right2: float
    push_x: float
    push_y: float


def pushed(robot: FiveBar, state: State, right1: float, right2: float) -> Pushed:
    """Return what gravity in the plane and a constant force make of the right side of the constraints: less A w_e / m.

    Without these forces no bit of it changes.
    """
    if not has_external_force(robot):
        return Pushed(right1, right2, 0.0, 0.0)
    leg1, leg2 = state.leg1, state.leg2
    push_x, push_y = external_acceleration(robot)
    return Pushed(
        right1 - leg1.u_x * push_x - leg1.u_y * push_y, right2 - leg2.u_x * push_x - leg2.u_y * push_y, push_x, push_y
    )


def response_to(
    form: ConstraintForm,
    state: State,
    drive1: float,
    drive2: float,
    right: Pushed,
) -> DynamicResponse:
    """Return the response of the robot with neither friction nor residual inertias; NaN where K is singular.

    K lambda = right, qddot = drive - ZZ^-1 B lambda and xddot = A^T lambda / m + push. The loop stays closed if
    right = B drive - A push - c.

    Args:
        form: the constraint form.
        state: legs at that posture.
        drive1, drive2: motor accelerations (rad/s^2) without lambda.
        right: right side of the constraints, and the platform's acceleration without lambda.
    """
    leg1, leg2 = state.leg1, state.leg2
    determinant = form.k11 * form.k22 - form.k12 * form.k12
    if determinant <= 0.0:
        return DynamicResponse(NAN, NAN, NAN, NAN, NAN, NAN)
    inverse = 1.0 / determinant
    lambda1 = inverse * (form.k22 * right.right1 - form.k12 * right.right2)
    lambda2 = inverse * (form.k11 * right.right2 - form.k12 * right.right1)
    return DynamicResponse(
        ddq11=drive1 - form.lever1 * lambda1,
        ddq21=drive2 - form.lever2 * lambda2,
        ax=form.per_mass * (leg1.u_x * lambda1 + leg2.u_x * lambda2) + right.push_x,
        ay=form.per_mass * (leg1.u_y * lambda1 + leg2.u_y * lambda2) + right.push_y,
        lambda1=lambda1,
        lambda2=lambda2,
    )
