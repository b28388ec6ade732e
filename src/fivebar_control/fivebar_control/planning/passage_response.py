"""The response of a crossing platform to loads: the error's equation along the reference, integrated in even steps.

e'' = G(t) (u - u_0) + a_F t_s, with the law's feedback, its weight on torque, its observer and the limits of the drives
(docs/theory.md, section 15).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_control.laws.reference import Reference
from fivebar_control.laws.unified import Box, InputMap, box_least_squares, input_map, normal_matrix
from fivebar_control.machine_code import as_machine_code
from fivebar_control.model.singularity import ParallelSvd, parallel_svd
from fivebar_control.model.state import Leg
from fivebar_control.trajectory.reference_row import reference_of
from fivebar_description.parameters import FiveBar, LegParameters

FloatArray = NDArray[np.float64]

MOST_LEAD = 0.05
"""Time (s) by which a displaced platform counts as ahead of its reference, or behind it, at most."""

LOST = 0.1
"""Displacement (m) at which a response ends."""

SMOOTHING = 0.02
"""Speed (rad/s) below which the friction of the passive joints counts in part."""


class Feedback(NamedTuple):
    """How a law answers a displacement: gains (1/s^2, 1/s), weight on torque, and bandwidth of its observer (1/s)."""

    kp: float
    kd: float
    weight: float
    observer_rate: float


class JudgedPassage(NamedTuple):
    """A passage through the locus.

    Attributes:
        robot: as modelled, its numbers floats.
        here: singular values and vectors at the crossing; loads act along its t_s.
        feedback: of the law.
        limit: of the drives (Nm).
        friction: of the passive joints (Nm).
    """

    robot: FiveBar
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
    """The robot on its reference, at a time (s) from the crossing.

    Attributes:
        time: s.
        vx, vy, ax, ay: of the platform (m/s, m/s^2).
        map: of the torques beyond friction to the acceleration.
        t_x, t_y: direction in which least torque acts.
        held: share of the feedback along it, less than 1 where a constraint law acts.
        box: of the torques beyond friction (Nm).
        load: acceleration by passive friction along the crossing's t_s (m/s^2).
    """

    time: float
    vx: float
    vy: float
    ax: float
    ay: float
    map: InputMap
    t_x: float
    t_y: float
    held: float
    box: Box
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
    weight, none = passage.feedback.weight, (0.0, 0.0)
    unloaded = [_acceleration_error(instant, instant, weight, none, none) for instant in instants]
    worst = 0.0
    for number in range(len(loads)):
        one = loads[number]
        load_case = LoadCase(float(one[0]), float(one[1]), float(one[2]), float(one[3]))
        worst = max(worst, _response(passage, instants, unloaded, load_case))
    return worst


def _instants(
    passage: JudgedPassage, times: FloatArray, references: FloatArray, held: FloatArray
) -> list[PassageInstant]:
    """Return the robot on its reference; arguments as for `largest_displacement`."""
    robot, limit = passage.robot, passage.limit
    found = []
    for number in range(len(times)):
        reference = reference_of(references[number])
        state = reference.state
        mapped = input_map(robot, state)
        if mapped is None:
            continue
        svd = parallel_svd(state)
        found.append(
            PassageInstant(
                float(times[number]),
                state.vx,
                state.vy,
                reference.ax,
                reference.ay,
                mapped,
                svd.t_x,
                svd.t_y,
                float(held[number]),
                Box(-limit - reference.f1, limit - reference.f1, -limit - reference.f2, limit - reference.f2),
                _passive_load(robot, reference, passage.here, passage.friction),
            )
        )
    return found


def _response(
    passage: JudgedPassage, instants: list[PassageInstant], unloaded: list[tuple[float, float]], load_case: LoadCase
) -> float:
    """Return the largest displacement (m) by a load and the friction of the passive joints.

    Args:
        passage: through the locus.
        instants: the robot on its reference.
        unloaded: by how much the law misses the reference's acceleration there without any load (m/s^2).
        load_case: the load.
    """
    here, feedback = passage.here, passage.feedback
    period = instants[1].time - instants[0].time
    share = 1.0 - math.exp(-feedback.observer_rate * period)
    x = y = vx = vy = d1 = d2 = 0.0
    largest = 0.0
    for number, instant in enumerate(instants):
        push = load_case.push if load_case.begin <= instant.time < load_case.end else 0.0
        load = load_case.lasting + instant.load + push
        # a platform behind its reference is where that was before: what the motors can do is that of then
        ahead = round(_lead(instant, x, y) / period)
        place = instants[min(max(number + ahead, 0), len(instants) - 1)]
        mapped = place.map
        answer = (-feedback.kd * vx - feedback.kp * x, -feedback.kd * vy - feedback.kp * y)
        ax, ay = _acceleration_error(instant, place, feedback.weight, answer, (d1, d2))
        lost_x, lost_y = unloaded[number]
        ax, ay = ax - lost_x + load * here.t_x, ay - lost_y + load * here.t_y
        if share > 0.0:
            # what the motion shows beyond the torques, as torques
            rest_x = load * here.t_x - mapped.g_x1 * d1 - mapped.g_x2 * d2
            rest_y = load * here.t_y - mapped.g_y1 * d1 - mapped.g_y2 * d2
            e1, e2 = _inverse(mapped, feedback.weight, rest_x, rest_y)
            d1, d2 = d1 + share * e1, d2 + share * e2
        vx, vy = vx + period * ax, vy + period * ay
        x, y = x + period * vx, y + period * vy
        largest = max(largest, math.hypot(x, y))
        if not largest < LOST:
            return LOST
    return largest


def _lead(instant: PassageInstant, x: float, y: float) -> float:
    """Return by how much time (s) a platform displaced so far (m) is ahead of its reference along the path."""
    squared = instant.vx * instant.vx + instant.vy * instant.vy
    lead = (x * instant.vx + y * instant.vy) / squared if squared > 0.0 else 0.0
    return min(max(lead, -MOST_LEAD), MOST_LEAD)


def _acceleration_error(
    instant: PassageInstant,
    place: PassageInstant,
    weight: float,
    answer: tuple[float, float],
    observed: tuple[float, float],
) -> tuple[float, float]:
    """Return the actual acceleration minus that of the reference (m/s^2), by the law's torque and no load.

    Args:
        instant: of the reference.
        place: where the platform is.
        weight: of the law on torque.
        answer: feedback (m/s^2).
        observed: disturbances (Nm) that the law compensates.
    """
    mapped, box, (d1, d2) = place.map, instant.box, observed
    needed_x, needed_y = instant.ax - mapped.a0_x, instant.ay - mapped.a0_y
    target_x, target_y = needed_x + answer[0], needed_y + answer[1]
    free = (place.held - 1.0) * (target_x * place.t_x + target_y * place.t_y)
    target_x, target_y = target_x + free * place.t_x, target_y + free * place.t_y
    h11, h12, h22 = normal_matrix(mapped, weight)
    u1, u2 = box_least_squares(
        h11,
        h12,
        h22,
        mapped.g_x1 * target_x + mapped.g_y1 * target_y,
        mapped.g_x2 * target_x + mapped.g_y2 * target_y,
        Box(box.low1 + d1, box.high1 + d1, box.low2 + d2, box.high2 + d2),
    )
    net1, net2 = u1 - d1, u2 - d2
    return mapped.g_x1 * net1 + mapped.g_x2 * net2 - needed_x, mapped.g_y1 * net1 + mapped.g_y2 * net2 - needed_y


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
