# SPDX-License-Identifier: Apache-2.0
"""One law for the whole workspace: the torque within its limits that best achieves the desired acceleration.

In platform coordinates the robot is regular through Type 2 and only its input matrix loses rank: xddot = G u + a_0 with
u = tau - f + d, d the estimated disturbance. Instead of inverting G, this law minimises
|G u + a_0 - a|^2 + w |u - u_0|^2 over the torques that the drives can give, a = xddot_d + Kd e' + Kp e. Far from the
Type 2 locus w has little effect and the law is a computed torque law in Cartesian space; on the locus w regularises the
uncontrollable direction t_s, and the other direction stays controlled. u_0 is 0, except for motions that were planned
in the motors' angles: at Type 1 the motor of the stretched leg does not act on the platform, and u_0 keeps it on its
planned motion. With gravity in the plane or a constant force u_0 is what the reference takes, damped near the locus, so
that w costs none of the torque that holds them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from fivebar_control.laws.gains import UnifiedSettings
from fivebar_control.laws.law import Instant, Law
from fivebar_control.laws.reference import Reference
from fivebar_control.laws.torque import UNDEFINED, Torque
from fivebar_control.model.constraint_form import ConstraintForm, Pushed, constraint_form, pushed, response_to
from fivebar_control.model.geometry import wrap
from fivebar_control.model.residual import moment_ratio, with_residuals
from fivebar_control.model.state import Leg, State
from fivebar_description.parameters import FiveBar, LegParameters, has_residual


class InputMap(NamedTuple):
    """Platform acceleration as a function of the torques beyond friction: xddot = G u + a_0.

    G in m/s^2 per Nm, a_0 in m/s^2.
    """

    g_x1: float
    g_x2: float
    g_y1: float
    g_y2: float
    a0_x: float
    a0_y: float


def input_map(robot: FiveBar, state: State) -> InputMap | None:
    """Return the map from the constraint form, regular at Types 1 and 2; None where both meet in both legs.

    With the form's matrix K: G = A^T K^-1 B ZZ^-1 / m and a_0 = w_e / m - A^T K^-1 (c + A w_e / m) / m.
    """
    leg1, leg2 = state.leg1, state.leg2
    form = constraint_form(robot, state)
    k11, k12, k22 = form.k11, form.k12, form.k22
    determinant = k11 * k22 - k12 * k12
    if determinant <= 0.0:
        return None
    if has_residual(robot):
        return _input_map_with_residuals(robot, state, form)
    scale = form.per_mass / determinant
    # columns of A^T K^-1 / m
    e1_x, e1_y = scale * (k22 * leg1.u_x - k12 * leg2.u_x), scale * (k22 * leg1.u_y - k12 * leg2.u_y)
    e2_x, e2_y = scale * (k11 * leg2.u_x - k12 * leg1.u_x), scale * (k11 * leg2.u_y - k12 * leg1.u_y)
    drift = pushed(robot, state, -leg1.c, -leg2.c)
    return InputMap(
        g_x1=e1_x * form.lever1,
        g_x2=e2_x * form.lever2,
        g_y1=e1_y * form.lever1,
        g_y2=e2_y * form.lever2,
        a0_x=drift.push_x + (e1_x * drift.right1 + e2_x * drift.right2),
        a0_y=drift.push_y + (e1_y * drift.right1 + e2_y * drift.right2),
    )


def acceleration(mapped: InputMap, u1: float, u2: float) -> tuple[float, float]:
    """Return the platform's acceleration (m/s^2) by torques beyond friction (Nm), G u + a_0."""
    return (
        mapped.g_x1 * u1 + mapped.g_x2 * u2 + mapped.a0_x,
        mapped.g_y1 * u1 + mapped.g_y2 * u2 + mapped.a0_y,
    )


def _input_map_with_residuals(robot: FiveBar, state: State, form: ConstraintForm) -> InputMap:
    leg1, leg2 = state.leg1, state.leg2
    by_motor1 = response_to(form, state, form.per_zz1, 0.0, Pushed(form.lever1, 0.0, 0.0, 0.0))
    by_motor2 = response_to(form, state, 0.0, form.per_zz2, Pushed(0.0, form.lever2, 0.0, 0.0))
    drift = pushed(robot, state, -leg1.c, -leg2.c)
    free = response_to(form, state, 0.0, 0.0, drift)
    by_motor1 = with_residuals(robot, state, form, by_motor1, 0.0)
    by_motor2 = with_residuals(robot, state, form, by_motor2, 0.0)
    free = with_residuals(robot, state, form, free, 1.0)
    return InputMap(by_motor1.ax, by_motor2.ax, by_motor1.ay, by_motor2.ay, free.ax, free.ay)


class Box(NamedTuple):
    """Limits of two unknowns."""

    low1: float
    high1: float
    low2: float
    high2: float


def box_least_squares(
    h11: float, h12: float, h22: float, right1: float, right2: float, box: Box
) -> tuple[float, float]:
    """Return the minimum of u^T H u / 2 - r^T u within a box, H symmetric and positive definite.

    Exact and in constant time: the free minimum if the box holds it, else the best of the four edges, on each of which
    the problem has one unknown.
    """
    determinant = h11 * h22 - h12 * h12
    u1, u2 = (h22 * right1 - h12 * right2) / determinant, (h11 * right2 - h12 * right1) / determinant
    if box.low1 <= u1 <= box.high1 and box.low2 <= u2 <= box.high2:
        return u1, u2
    best, best_u1, best_u2 = math.inf, box.low1, box.low2
    for edge in range(4):
        if edge < 2:
            u1 = box.low1 if edge == 0 else box.high1
            u2 = min(max((right2 - h12 * u1) / h22, box.low2), box.high2)
        else:
            u2 = box.low2 if edge == 2 else box.high2
            u1 = min(max((right1 - h12 * u2) / h11, box.low1), box.high1)
        cost = 0.5 * (h11 * u1 * u1 + 2.0 * h12 * u1 * u2 + h22 * u2 * u2) - right1 * u1 - right2 * u2
        if cost < best:
            best, best_u1, best_u2 = cost, u1, u2
    return best_u1, best_u2


class UnifiedMemory(NamedTuple):
    """State of the law from one sample to the next.

    Attributes:
        d1, d2: estimated disturbance torque on each motor (Nm).
        unset: whether the remaining fields are not known yet.
        net1, net2: last torque beyond friction, without the disturbance (Nm).
        vx, vy: platform velocity at that sample (m/s).
        ax, ay: platform acceleration that the model predicted at that sample (m/s^2).
    """

    d1: float
    d2: float
    unset: bool
    net1: float
    net2: float
    vx: float
    vy: float
    ax: float
    ay: float


INITIAL_MEMORY = UnifiedMemory(0.0, 0.0, True, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
"""The memory before the first sample."""


def restarted(memory: UnifiedMemory) -> UnifiedMemory:
    """Return the memory after a gap in the samples: only the estimated disturbance is kept."""
    return UnifiedMemory(
        d1=memory.d1,
        d2=memory.d2,
        unset=True,
        net1=memory.net1,
        net2=memory.net2,
        vx=memory.vx,
        vy=memory.vy,
        ax=memory.ax,
        ay=memory.ay,
    )


def observed_disturbance(
    mapped: InputMap, state: State, memory: UnifiedMemory, settings: UnifiedSettings, period: float
) -> tuple[float, float]:
    """Return the disturbance (Nm) on each motor after one more sample.

    With r the mean acceleration over the last period minus the expected one,
    d+ = d + gamma (G^T G + w)^-1 G^T r. At rest its error obeys delta+ = (I - gamma S) delta, S = (G^T G + w)^-1 G^T G
    with eigenvalues s^2 / (s^2 + w) from 0 to 1: it does not grow, not even at a singularity, where S vanishes in the
    direction that the law regularises. In motion G changes by dG within a period, and a step may let the error grow by
    the factor 1 + gamma |dG| / (4 sqrt(w)) at most. The limit keeps it bounded under other model errors.

    Args:
        mapped: input map of the present state.
        state: the present state.
        memory: of the sample before.
        settings: of the law.
        period: since the sample before (s).
    """
    if memory.unset or settings.observer_rate == 0.0:
        return memory.d1, memory.d2
    net1, net2 = memory.net1 + memory.d1, memory.net2 + memory.d2
    expected_x = 0.5 * (memory.ax + mapped.g_x1 * net1 + mapped.g_x2 * net2 + mapped.a0_x)
    expected_y = 0.5 * (memory.ay + mapped.g_y1 * net1 + mapped.g_y2 * net2 + mapped.a0_y)
    r_x = (state.vx - memory.vx) / period - expected_x
    r_y = (state.vy - memory.vy) / period - expected_y
    h11, h12, h22 = normal_matrix(mapped, settings.weight)
    right1 = mapped.g_x1 * r_x + mapped.g_y1 * r_y
    right2 = mapped.g_x2 * r_x + mapped.g_y2 * r_y
    gain = (1.0 - math.exp(-settings.observer_rate * period)) / (h11 * h22 - h12 * h12)
    limit = settings.disturbance_limit
    return (
        min(max(memory.d1 + gain * (h22 * right1 - h12 * right2), -limit), limit),
        min(max(memory.d2 + gain * (h11 * right2 - h12 * right1), -limit), limit),
    )


def unified_step(
    robot: FiveBar,
    state: State,
    reference: Reference,
    memory: UnifiedMemory,
    settings: UnifiedSettings,
    period: float,
) -> tuple[Torque, UnifiedMemory]:
    """Return the torque (Nm) of the unified law and its memory for the next sample.

    Args:
        robot: nominal robot of the law.
        state: measured state.
        reference: desired instant; friction is compensated at its speeds.
        memory: of the sample before.
        settings: of the law.
        period: between two samples (s).
    """
    mapped = input_map(robot, state)
    if mapped is None:
        return UNDEFINED, restarted(memory)
    d1, d2 = observed_disturbance(mapped, state, memory, settings, period)
    kp, kd, weight = settings.kp, settings.kd, settings.weight
    limit = math.inf if settings.torque_limit is None else settings.torque_limit
    desired = reference.state
    target_x = reference.ax + kd * (desired.vx - state.vx) + kp * (desired.x - state.x) - mapped.a0_x
    target_y = reference.ay + kd * (desired.vy - state.vy) + kp * (desired.y - state.y) - mapped.a0_y
    held1, held2 = reference.u1, reference.u2
    if reference.by_motors:
        held1 += _held_inertia(robot.leg1, state.leg1) * _motor_feedback(desired.leg1, state.leg1, kp, kd)
        held2 += _held_inertia(robot.leg2, state.leg2) * _motor_feedback(desired.leg2, state.leg2, kp, kd)
    # tau = u + off: friction and disturbance are compensated besides
    off1, off2 = reference.f1 - d1, reference.f2 - d2
    h11, h12, h22 = normal_matrix(mapped, weight)
    u1, u2 = box_least_squares(
        h11,
        h12,
        h22,
        mapped.g_x1 * target_x + mapped.g_y1 * target_y + weight * held1,
        mapped.g_x2 * target_x + mapped.g_y2 * target_y + weight * held2,
        Box(-limit - off1, limit - off1, -limit - off2, limit - off2),
    )
    ax, ay = acceleration(mapped, u1, u2)
    kept = UnifiedMemory(
        d1=d1,
        d2=d2,
        unset=False,
        net1=u1 - d1,
        net2=u2 - d2,
        vx=state.vx,
        vy=state.vy,
        ax=ax,
        ay=ay,
    )
    return Torque(u1 + off1, u2 + off2), kept


def normal_matrix(mapped: InputMap, weight: float) -> tuple[float, float, float]:
    """Return the entries 11, 12 and 22 of G^T G + w."""
    return (
        mapped.g_x1 * mapped.g_x1 + mapped.g_y1 * mapped.g_y1 + weight,
        mapped.g_x1 * mapped.g_x2 + mapped.g_y1 * mapped.g_y2,
        mapped.g_x2 * mapped.g_x2 + mapped.g_y2 * mapped.g_y2 + weight,
    )


def _held_inertia(parameters: LegParameters, leg: Leg) -> float:
    """Return the inertia (kg m^2) of a motor with its leg while the platform stays where it is, at Type 1."""
    ratio = moment_ratio(parameters, leg)
    return parameters.inertia + parameters.residual * ratio * ratio


def _motor_feedback(desired: Leg, measured: Leg, kp: float, kd: float) -> float:
    """Return the feedback acceleration (rad/s^2) of a motor towards its planned motion, the angle error wrapped."""
    return kd * (desired.dq1 - measured.dq1) + kp * wrap(desired.q1 - measured.q1)


def unified_law_step(
    robot: FiveBar, instant: Instant, memory: UnifiedMemory, settings: UnifiedSettings
) -> tuple[Torque, UnifiedMemory]:
    """Return the torque for a sample; the settings are numbers, as `as_numbers` makes them."""
    return unified_step(robot, instant.state, instant.reference, memory, settings, instant.period)


LAW = Law(
    name="unified",
    title="unified law",
    settings=UnifiedSettings,
    step=unified_law_step,
    memory=INITIAL_MEMORY,
    after_gap=restarted,
    executable="unified_controller",
    meets_type_1=True,
    observes_disturbance=True,
)
