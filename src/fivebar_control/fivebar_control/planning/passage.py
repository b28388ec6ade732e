# SPDX-License-Identifier: Apache-2.0
"""The passage condition: how far the declared loads displace the platform where the motors cannot hold it.

On the Type 2 locus no torque acts along t_s, and near it a small part of one: the drives' limit holds a load there only
from some kappa on. The faster kappa changes, the shorter the platform is left to the load. The response is that of the
error's equation along the reference, e'' = G(t) (u - u_0) + a_F t_s, with the law's feedback, its weight on torque, its
observer and the limits of the drives (docs/bounds.md).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_control.compiling import as_machine_code
from fivebar_control.laws.law import Feedback
from fivebar_control.laws.reference import Reference
from fivebar_control.laws.registry import TunedController
from fivebar_control.laws.unified import Box, InputMap, acceleration, box_least_squares, input_map, normal_matrix
from fivebar_control.loop.supervisor import Supervisor
from fivebar_control.model.kinematics import state_from_platform
from fivebar_control.model.singularity import ParallelSvd, parallel_svd
from fivebar_control.model.state import Leg, WorkingMode
from fivebar_control.planning.predicted_run import Peak
from fivebar_control.trajectory.desired import desired_along, desired_at, reference_of
from fivebar_control.trajectory.path_distance import PATH, TIMED, path_place
from fivebar_control.trajectory.planner import Crossing, Plan
from fivebar_description.imu import STANDARD_GRAVITY
from fivebar_description.loads import Loads
from fivebar_description.parameters import FiveBar, LegParameters, with_floats

BEFORE, AFTER = 0.08, 0.12
"""Time (s) about a crossing in which the response is followed at least: the loads' build-up, and the return to the
path."""

KAPPA_BEFORE, KAPPA_AFTER = 0.1, 0.2
"""The same in kappa, as it changes at the crossing: a slow one leaves the platform to the loads for longer."""

LONGEST_WINDOW = 1.0
"""Time (s) on either side of a crossing in which the response is followed at most."""

LONGEST_STEP = 2e-3
"""Longest step of the integration (s)."""

ONSETS = (0.5, 1.0)
"""When the push begins, as a share of its length before the crossing."""

FloatArray = NDArray[np.float64]

LOST = 0.1
"""Displacement (m) at which a response ends."""

NO_PATH: FloatArray = np.zeros((0, 2))
"""The path where a response is measured from its timed reference."""

BESIDE = 50
"""Instants of the path before and after those of a response: a displaced platform may be nearest to one of them."""

SMOOTHING = 0.02
"""Speed (rad/s) below which the friction of the passive joints counts in part."""


class Judged(NamedTuple):
    """A plan with all that its crossings are judged by: the arguments of `displacement`."""

    robot: FiveBar
    plan: Plan
    rate_hz: int
    follower: TunedController
    torque_limit: float
    loads: Loads
    judge: str


def displacement(
    robot: FiveBar,
    plan: Plan,
    rate_hz: int,
    follower: TunedController,
    torque_limit: float,
    loads: Loads,
    judge: str = TIMED,
) -> Peak:
    """Return the largest displacement (m) by the loads about a crossing of a plan, at that crossing.

    Args:
        robot: as modelled.
        plan: whose crossings are judged.
        rate_hz: of the controllers.
        follower: which controller follows; its gains count.
        torque_limit: of the drives (Nm).
        loads: that act at once, along t_s at the crossing.
        judge: by which distance of the platform, that from its reference or that from its path.
    """
    judged = Judged(robot, plan, rate_hz, follower, torque_limit, loads, judge)
    start = plan.path.at(0.0)
    worst = Peak(0.0, 0.0, start.x, start.y)
    for crossing in plan.crossings:
        value = _displacement_at(judged, crossing)
        worst = worst.or_larger(value, crossing.time, crossing.x, crossing.y)
    return worst


def _displacement_at(judged: Judged, crossing: Crossing) -> float:
    robot, plan, controller = with_floats(judged.robot), judged.plan, judged.follower.controller
    here = desired_at(robot, plan, crossing.time, plan.path.at(crossing.time)).state
    # a sample, or a part of one where samples are far apart
    period = 1.0 / judged.rate_hz / math.ceil(1.0 / judged.rate_hz / LONGEST_STEP - 1e-9)
    before = min(_followed(crossing, BEFORE, KAPPA_BEFORE), crossing.time)
    after = _followed(crossing, AFTER, KAPPA_AFTER)
    if plan.modes:
        # the segments beside it may have another working mode
        segment = plan.path.segments[crossing.segment]
        before = min(before, crossing.time - segment.start_time)
        after = min(after, segment.start_time + segment.duration - crossing.time - period)
    first = -math.floor(before / period)
    times = [step * period for step in range(first, math.ceil(after / period) + 1)]
    references = desired_along(robot, plan, [crossing.time + time for time in times])
    held = np.ones(len(times))
    if controller.blended:
        supervise = Supervisor(plan, judged.rate_hz, controller.weighting)
        for number, (time, row) in enumerate(zip(times, references.tolist(), strict=True)):
            held[number] = 1.0 - supervise.at(crossing.time + time, reference_of(row).state).sigma
    passage = JudgedPassage(
        robot,
        plan.mode_at(crossing.time),
        parallel_svd(here),
        judged.follower.nominal.feedback,
        float(judged.torque_limit),
        float(judged.loads.passive),
    )
    path = _path_about(plan, crossing.time, times) if judged.judge == PATH else NO_PATH
    loads = np.array(_load_cases(robot, judged.loads), dtype=np.float64)
    return as_machine_code(largest_response)(passage, np.array(times), references, held, path, loads)


def _path_about(plan: Plan, crossed: float, times: Sequence[float]) -> FloatArray:
    """Return the path (m) at even times (s) from a crossing, with `BESIDE` more of them on each side, [N, 2]."""
    period = times[1] - times[0]
    steps = range(-BESIDE, len(times) + BESIDE)
    instants = (crossed + times[0] + step * period for step in steps)
    places = (plan.path.at(min(max(instant, 0.0), plan.path.duration)) for instant in instants)
    return np.array([(place.x, place.y) for place in places])


def _followed(crossing: Crossing, least: float, kappa: float) -> float:
    """Return the time (s) on one side of a crossing in which the response is followed, up to a kappa."""
    if kappa >= LONGEST_WINDOW * crossing.kappa_rate:
        return LONGEST_WINDOW
    return max(least, kappa / crossing.kappa_rate)


def _load_cases(robot: FiveBar, loads: Loads) -> list[LoadCase]:
    """Return the loads besides friction, to either side, with the pushes that begin at each of `ONSETS`."""
    lasting = STANDARD_GRAVITY * math.sin(loads.tilt)
    push = loads.push / robot.mass
    onsets = ONSETS if push > 0.0 else ONSETS[:1]
    return [
        LoadCase(sign * lasting, sign * push, begin, begin + loads.push_length)
        for sign in ((1.0, -1.0) if lasting > 0.0 or push > 0.0 else (1.0,))
        for begin in (-onset * loads.push_length for onset in onsets)
    ]


class JudgedPassage(NamedTuple):
    """A passage through the locus.

    Attributes:
        robot: as modelled, its numbers floats.
        mode: working mode.
        here: singular values and vectors at the crossing; loads act along its t_s.
        feedback: of the law.
        limit: of the drives (Nm).
        friction: of the passive joints (Nm).
    """

    robot: FiveBar
    mode: WorkingMode
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


def largest_response(
    passage: JudgedPassage,
    times: FloatArray,
    references: FloatArray,
    held: FloatArray,
    path: FloatArray,
    loads: FloatArray,
) -> float:
    """Return the largest displacement (m) by any of some loads about a crossing.

    Args:
        passage: through the locus.
        times: in even steps, from the crossing (s), [N].
        references: at these times as `write_reference` writes them, [N, REFERENCE_VALUES].
        held: share of the feedback along t_s at these times, less than 1 where a constraint law acts, [N].
        path: from which the displacement is measured (m), [N + 2 BESIDE, 2]; `NO_PATH` for the timed references.
        loads: to which the platform responds one at a time, [M, 4] as in `LoadCase`.
    """
    instants = _instants(passage, times, references, held)
    worst = 0.0
    for number in range(len(loads)):
        load = loads[number]
        load_case = LoadCase(float(load[0]), float(load[1]), float(load[2]), float(load[3]))
        worst = max(worst, _response(passage, instants, path, load_case))
    return worst


def _instants(
    passage: JudgedPassage, times: FloatArray, references: FloatArray, held: FloatArray
) -> list[PassageInstant]:
    """Return the reference at the times; arguments as for `largest_response`."""
    limit = passage.limit
    instants = []
    for number in range(len(times)):
        reference = reference_of(references[number])
        state = reference.state
        svd = parallel_svd(state)
        instants.append(
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
    return instants


def _response(passage: JudgedPassage, instants: list[PassageInstant], path: FloatArray, load_case: LoadCase) -> float:
    """Return the largest distance from the reference (m) under a load and the friction of the passive joints.

    Args:
        passage: through the locus.
        instants: the reference.
        path: from which the distance counts in place of the reference.
        load_case: the load.
    """
    robot, here, feedback = passage.robot, passage.here, passage.feedback
    period = instants[1].time - instants[0].time
    share = 1.0 - math.exp(-feedback.observer_rate * period)
    x = y = vx = vy = d1 = d2 = 0.0
    largest, line = 0.0, BESIDE
    for number, instant in enumerate(instants):
        state = state_from_platform(
            robot,
            passage.mode,
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
        if len(path) > 0:
            nearest = path_place(path, line, BESIDE + number, instant.x + x, instant.y + y)
            distance, line = nearest.distance, nearest.line
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
    rates1, rates2 = _rates(robot.leg1, state.leg1, here), _rates(robot.leg2, state.leg2, here)
    total = 0.0
    for rate, slope in (
        (state.leg1.dtheta - state.leg1.dq1, rates1[1] - rates1[0]),
        (state.leg2.dtheta - state.leg2.dq1, rates2[1] - rates2[0]),
        (state.leg2.dtheta - state.leg1.dtheta, rates2[1] - rates1[1]),
    ):
        total += math.tanh(rate / SMOOTHING) * slope
    return -friction / robot.mass * total


def _rates(link: LegParameters, leg: Leg, here: ParallelSvd) -> tuple[float, float]:
    """Return the rates (rad/m) of a leg's motor and distal link for a motion of the platform along t_s."""
    motor = (leg.u_x * here.t_x + leg.u_y * here.t_y) / (link.proximal * leg.sin_q2)
    distal = -(leg.r_x * here.t_x + leg.r_y * here.t_y) / (link.distal * leg.sin_q2)
    return motor, distal
