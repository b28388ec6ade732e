"""The response of a crossing platform to loads, integrated in even steps.

x'' = G(x, v) u + a_0(x, v) + a_F t_s where the platform is, with the law's feedback, its weight on torque, its observer
and the limits of the drives (docs/theory.md, section 15).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_control.laws.law import Feedback
from fivebar_control.laws.reference import Reference
from fivebar_control.laws.unified import Box, InputMap, acceleration, box_least_squares, input_map, normal_matrix
from fivebar_control.machine_code import as_machine_code
from fivebar_control.model.kinematics import state_from_platform
from fivebar_control.model.singularity import ParallelSvd, parallel_svd
from fivebar_control.model.state import Leg
from fivebar_control.trajectory.desired import reference_of
from fivebar_description.parameters import FiveBar, LegParameters

FloatArray = NDArray[np.float64]

LOST = 0.1
"""Displacement (m) at which a response ends."""

SMOOTHING = 0.02
"""Speed (rad/s) below which the friction of the passive joints counts in part."""


class JudgedPassage(NamedTuple):
    """A passage through the locus.

    Attributes:
        robot: as modelled, its numbers floats.
        mode1, mode2: working mode.
        here: singular values and vectors at the crossing; loads act along its t_s.
        feedback: of the law.
        limit: of the drives (Nm).
        friction: of the passive joints (Nm).
    """

    robot: FiveBar
    mode1: int
    mode2: int
    here: ParallelSvd
    feedback: Feedback
    limit: float
    friction: float


class LoadCase(NamedTuple):
    """Accelerations (m/s^2) along t_s by loads: a lasting one, and a push from a time to another (s)."""

    lasting: float
    push: float
    begin: float
    end: float


class PassageInstant(NamedTuple):
    """The reference at a time (s) from the crossing.

    Attributes:
        time: s.
        x, y, vx, vy, ax, ay: of the platform (m, m/s, m/s^2).
        t_x, t_y: direction in which least torque acts.
        held: share of the feedback along it, less than 1 where a constraint law acts.
        box: of the torques beyond friction (Nm).
        u1, u2: torques beyond friction (Nm) to which the law's weight pulls: those that hold what acts all the time.
        load: acceleration by passive friction along the crossing's t_s (m/s^2).
    """

    time: float
    x: float
    y: float
    vx: float
    vy: float
    ax: float
    ay: float
    t_x: float
    t_y: float
    held: float
    box: Box
    u1: float
    u2: float
    load: float


def largest_displacement(
    passage: JudgedPassage, times: FloatArray, references: FloatArray, held: FloatArray, loads: list[LoadCase]
) -> float:
    """Return the largest displacement (m) by any of some loads about a crossing.

    Args:
        passage: through the locus.
        times: in even steps, from the crossing (s), [N].
        references: at these times as `write_reference` writes them, [N, REFERENCE_VALUES].
        held: share of the feedback along t_s at these times, less than 1 where a constraint law acts, [N].
        loads: to which the platform responds one at a time.
    """
    return as_machine_code(largest_response)(passage, times, references, held, np.array(loads, dtype=np.float64))


def largest_response(
    passage: JudgedPassage, times: FloatArray, references: FloatArray, held: FloatArray, loads: FloatArray
) -> float:
    """Return the same for loads as rows, [M, 4] as in `LoadCase`."""
    instants = _instants(passage, times, references, held)
    worst = 0.0
    for number in range(len(loads)):
        one = loads[number]
        load_case = LoadCase(float(one[0]), float(one[1]), float(one[2]), float(one[3]))
        worst = max(worst, _response(passage, instants, load_case))
    return worst


def _instants(
    passage: JudgedPassage, times: FloatArray, references: FloatArray, held: FloatArray
) -> list[PassageInstant]:
    """Return the reference at the times; arguments as for `largest_displacement`."""
    limit = passage.limit
    found = []
    for number in range(len(times)):
        reference = reference_of(references[number])
        state = reference.state
        svd = parallel_svd(state)
        found.append(
            PassageInstant(
                float(times[number]),
                state.x,
                state.y,
                state.vx,
                state.vy,
                reference.ax,
                reference.ay,
                svd.t_x,
                svd.t_y,
                float(held[number]),
                Box(-limit - reference.f1, limit - reference.f1, -limit - reference.f2, limit - reference.f2),
                0.0 if reference.by_motors else reference.u1,
                0.0 if reference.by_motors else reference.u2,
                _passive_load(passage.robot, reference, passage.here, passage.friction),
            )
        )
    return found


def _response(passage: JudgedPassage, instants: list[PassageInstant], load_case: LoadCase) -> float:
    """Return the largest distance from the reference (m) under a load and the friction of the passive joints.

    Args:
        passage: through the locus.
        instants: the reference.
        load_case: the load.
    """
    robot, here, feedback = passage.robot, passage.here, passage.feedback
    period = instants[1].time - instants[0].time
    share = 1.0 - math.exp(-feedback.observer_rate * period)
    x = y = vx = vy = d1 = d2 = 0.0
    largest = 0.0
    for instant in instants:
        state = state_from_platform(
            robot,
            passage.mode1,
            passage.mode2,
            instant.x + x,
            instant.y + y,
            instant.vx + vx,
            instant.vy + vy,
        )
        mapped = input_map(robot, state)
        if mapped is None:
            return LOST
        push = load_case.push if load_case.begin <= instant.time < load_case.end else 0.0
        load = load_case.lasting + instant.load + push
        u1, u2 = _torque(mapped, instant, feedback, (x, y, vx, vy), (d1, d2))
        ax, ay = acceleration(mapped, u1, u2)
        ax, ay = ax + load * here.t_x - instant.ax, ay + load * here.t_y - instant.ay
        if share > 0.0:
            # what the motion shows beyond the torques, as torques
            rest_x = load * here.t_x - mapped.g_x1 * d1 - mapped.g_x2 * d2
            rest_y = load * here.t_y - mapped.g_y1 * d1 - mapped.g_y2 * d2
            e1, e2 = _inverse(mapped, feedback.weight, rest_x, rest_y)
            d1, d2 = d1 + share * e1, d2 + share * e2
        vx, vy = vx + period * ax, vy + period * ay
        x, y = x + period * vx, y + period * vy
        distance = math.hypot(x, y)
        # out of the legs' reach it is undefined
        if not distance < LOST:
            return LOST
        largest = max(largest, distance)
    return largest


def _torque(
    mapped: InputMap,
    instant: PassageInstant,
    feedback: Feedback,
    off: tuple[float, float, float, float],
    observed: tuple[float, float],
) -> tuple[float, float]:
    """Return the law's torques beyond friction (Nm).

    Args:
        mapped: of the torques to the acceleration, where the platform is.
        instant: of the reference.
        feedback: of the law.
        off: distance and velocity from the reference (m, m/s).
        observed: disturbances (Nm) that the law compensates.
    """
    x, y, vx, vy = off
    (d1, d2), box, weight = observed, instant.box, feedback.weight
    target_x = instant.ax - mapped.a0_x - feedback.kd * vx - feedback.kp * x
    target_y = instant.ay - mapped.a0_y - feedback.kd * vy - feedback.kp * y
    free = (instant.held - 1.0) * (target_x * instant.t_x + target_y * instant.t_y)
    target_x, target_y = target_x + free * instant.t_x, target_y + free * instant.t_y
    h11, h12, h22 = normal_matrix(mapped, weight)
    u1, u2 = box_least_squares(
        h11,
        h12,
        h22,
        mapped.g_x1 * target_x + mapped.g_y1 * target_y + weight * instant.u1,
        mapped.g_x2 * target_x + mapped.g_y2 * target_y + weight * instant.u2,
        Box(box.low1 + d1, box.high1 + d1, box.low2 + d2, box.high2 + d2),
    )
    return u1 - d1, u2 - d2


def _inverse(mapped: InputMap, weight: float, ax: float, ay: float) -> tuple[float, float]:
    h11, h12, h22 = normal_matrix(mapped, weight)
    right1, right2 = mapped.g_x1 * ax + mapped.g_y1 * ay, mapped.g_x2 * ax + mapped.g_y2 * ay
    determinant = h11 * h22 - h12 * h12
    return (h22 * right1 - h12 * right2) / determinant, (h11 * right2 - h12 * right1) / determinant


def _passive_load(robot: FiveBar, reference: Reference, here: ParallelSvd, friction: float) -> float:
    """Return the acceleration (m/s^2) along the crossing's t_s by friction (Nm) of the passive joints.

    A joint's rate is linear in the platform's velocity; against it the friction works like a force along its gradient.
    """
    if friction == 0.0:
        return 0.0
    state = reference.state
    one, two = _rates(robot.leg1, state.leg1, here), _rates(robot.leg2, state.leg2, here)
    total = 0.0
    for rate, slope in (
        (state.leg1.dtheta - state.leg1.dq1, one[1] - one[0]),
        (state.leg2.dtheta - state.leg2.dq1, two[1] - two[0]),
        (state.leg2.dtheta - state.leg1.dtheta, two[1] - one[1]),
    ):
        total += math.tanh(rate / SMOOTHING) * slope
    return -friction / robot.mass * total


def _rates(link: LegParameters, leg: Leg, here: ParallelSvd) -> tuple[float, float]:
    """Return the rates (rad/m) of a leg's motor and distal link for a motion of the platform along t_s."""
    motor = (leg.u_x * here.t_x + leg.u_y * here.t_y) / (link.proximal * leg.sin_q2)
    distal = -(leg.r_x * here.t_x + leg.r_y * here.t_y) / (link.distal * leg.sin_q2)
    return motor, distal
