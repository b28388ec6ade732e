"""The passage condition: how far the declared loads displace the platform where the motors cannot hold it.

On the Type 2 locus no torque acts along t_s, and near it a small part of one: the drives' limit holds a load there only
from some kappa on. The faster kappa changes, the shorter the platform is left to the load. The response is that of the
error's equation along the reference, e'' = G(t) (u - u_0) + a_F t_s, with the law's feedback, its weight on torque, its
observer and the limits of the drives (docs/theory.md, section 15).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from fivebar_control.laws.reference import Reference
from fivebar_control.laws.registry import TunedController
from fivebar_control.laws.unified import Box, InputMap, UnifiedSettings, box_least_squares, input_map, normal_matrix
from fivebar_control.loop.supervisor import Supervisor
from fivebar_control.model.singularity import ParallelSvd, parallel_svd
from fivebar_control.model.state import Leg
from fivebar_control.planning.predicted_run import Peak
from fivebar_control.trajectory.desired import desired_at
from fivebar_control.trajectory.planner import Crossing, Plan
from fivebar_description.imu import STANDARD_GRAVITY
from fivebar_description.loads import Loads
from fivebar_description.parameters import FiveBar, LegParameters

BEFORE, AFTER = 0.08, 0.12
"""Time (s) about a crossing in which the response is followed: the loads' build-up, and the return to the path."""

LONGEST_STEP = 2e-3
"""Of the integration (s)."""

ONSETS = (0.5, 1.0)
"""When the push begins, as a share of its length before the crossing."""

FREE_WEIGHT = 1e-3
"""Weight on torque ((m/s^2 / Nm)^2) of a law that inverts the model: hardly any."""

MOST_LEAD = 0.05
"""Time (s) by which a displaced platform counts as ahead of its reference, or behind it, at most."""

LOST = 0.1
"""Displacement (m) at which a response ends."""

SMOOTHING = 0.02
"""Speed (rad/s) below which the friction of the passive joints counts in part."""


SLOWEST_SHIFT, SHIFT_STEPS = 1e-3, 400
"""Of `unavoidable`: the root of beta below which the closed form does, and steps of the search for the largest."""


class Feedback(NamedTuple):
    """How a law answers a displacement: gains (1/s^2, 1/s), weight on torque, and bandwidth of its observer (1/s)."""

    kp: float
    kd: float
    weight: float
    observer_rate: float


class Judged(NamedTuple):
    """A plan with all that its crossings are judged by: the arguments of `displacement`."""

    robot: FiveBar
    plan: Plan
    rate_hz: int
    follower: TunedController
    torque_limit: float
    loads: Loads


class PassageInstant(NamedTuple):
    """The robot on its reference, at a time (s) from the crossing.

    Attributes:
        time: s.
        vx, vy, ax, ay: of the platform (m/s, m/s^2).
        map: of the torques beyond friction to the acceleration.
        t_x, t_y: direction in which least torque acts.
        held: share of the feedback along it, less than 1 where a constraint law acts.
        box: of the torques beyond friction (Nm).
        lost_x, lost_y: acceleration that the law falls short of without any load (m/s^2).
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
    lost_x: float
    lost_y: float
    load: float


def displacement(
    robot: FiveBar, plan: Plan, rate_hz: int, follower: TunedController, torque_limit: float, loads: Loads
) -> Peak:
    """Return the largest displacement (m) by the loads about a crossing of a plan, at that crossing.

    Args:
        robot: as modelled.
        plan: whose crossings are judged.
        rate_hz: of the controllers.
        follower: which controller follows; its gains count.
        torque_limit: of the drives (Nm).
        loads: that act at once, along t_s at the crossing.
    """
    judged = Judged(robot, plan, rate_hz, follower, torque_limit, loads)
    start = plan.path.at(0.0)
    worst = Peak(0.0, 0.0, start.x, start.y)
    for crossing in plan.crossings:
        value = _displacement_at(judged, crossing)
        worst = worst.or_larger(value, crossing.time, crossing.x, crossing.y)
    return worst


def exposure(kappa_rate: float, gain: float, torque: float, load: float) -> float:
    """Return the displacement (m) by a lasting load that the drives' limit alone opposes, at constant speed.

    The closed form of theory.md, section 15: 1.94 a_F^3 / (gain kappa_rate torque)^2.

    Args:
        kappa_rate: of the crossing (1/s).
        gain: acceleration along t_s by torque and kappa (m/s^2 per Nm).
        torque: that is left for the load (Nm).
        load: acceleration by the load (m/s^2).
    """
    time = load / (gain * kappa_rate * torque)
    return (1.0 + 2.0 * math.sqrt(2.0) / 3.0) * load * time * time


def unavoidable(kappa_rate: float, gain: float, torque: float, load: float, speed: float) -> float:
    """Return the displacement (m) that a lasting load makes at least, whatever the law, when it begins at the worst.

    That of `exposure` for a platform that the load pushes onwards along its path, whose displacement takes it away from
    the locus: theory.md, section 15. In units of a_F t_F^2 and t_F it is the largest eta of
    eta'' = 1 - |s| - beta eta, beta = a_F t_F / speed, that begins at rest at s = -1, as long as the comparison with
    any other motion holds, sqrt(beta) (s + 1) <= pi.

    Args:
        kappa_rate: of the crossing (1/s).
        gain: largest acceleration along t_s by 1 Nm of each motor and kappa (m/s^2 per Nm).
        torque: that is left for the load (Nm).
        load: acceleration by the load (m/s^2).
        speed: at which the platform goes through the locus along t_s (m/s); infinite where it goes across.
    """
    time = load / (gain * kappa_rate * torque)
    omega = math.sqrt(load * time / speed)
    if omega < SLOWEST_SHIFT:
        return exposure(kappa_rate, gain, torque, load)
    largest = 0.0
    end = min(math.pi / omega - 1.0, 1.0 + math.sqrt(2.0))
    for step in range(SHIFT_STEPS + 1):
        s = -1.0 + (end + 1.0) * step / SHIFT_STEPS
        if s <= 0.0:
            eta = 1.0 + s - math.sin(omega * (1.0 + s)) / omega
        else:
            eta = (
                1.0
                - s
                + ((2.0 - math.cos(omega)) * math.sin(omega * s) - math.sin(omega) * math.cos(omega * s)) / omega
            )
        largest = max(largest, eta / (omega * omega))
    return largest * load * time * time


def feedback_of(follower: TunedController) -> Feedback:
    """Return how a controller answers a displacement away from its zones; a foreign law without gains as `unified`."""
    settings, usual = follower.nominal.settings, UnifiedSettings()
    return Feedback(
        float(getattr(settings, "kp", usual.kp)),
        float(getattr(settings, "kd", usual.kd)),
        float(getattr(settings, "weight", FREE_WEIGHT)),
        float(getattr(settings, "observer_rate", 0.0)),
    )


def _displacement_at(judged: Judged, crossing: Crossing) -> float:
    robot, loads, feedback = judged.robot, judged.loads, feedback_of(judged.follower)
    here = parallel_svd(_reference_at(judged, crossing.time).state)
    instants = _instants(judged, crossing, here, feedback.weight)
    lasting = STANDARD_GRAVITY * math.sin(loads.tilt)
    push = loads.push / robot.mass
    onsets = ONSETS if push > 0.0 else ONSETS[:1]
    worst = 0.0
    for sign in (1.0, -1.0) if lasting > 0.0 or push > 0.0 else (1.0,):
        for onset in onsets:
            begin = -onset * loads.push_length
            pushed = (begin, begin + loads.push_length)
            worst = max(worst, _response(instants, here, feedback, sign * lasting, sign * push, pushed))
    return worst


def _reference_at(judged: Judged, time: float) -> Reference:
    return desired_at(judged.robot, judged.plan, time, judged.plan.path.at(time))


def _instants(judged: Judged, crossing: Crossing, here: ParallelSvd, weight: float) -> list[PassageInstant]:
    """Return the robot on its reference about a crossing, in even steps.

    Args:
        judged: the plan.
        crossing: which of the plan's.
        here: at the crossing.
        weight: of the law on torque.
    """
    period, limit, controller = _step(judged.rate_hz), judged.torque_limit, judged.follower.controller
    supervise = Supervisor(judged.plan, judged.rate_hz, controller.weighting)
    first = -math.floor(min(BEFORE, crossing.time) / period)
    found = []
    for step in range(first, math.ceil(AFTER / period) + 1):
        time = step * period
        t = crossing.time + time
        reference = _reference_at(judged, t)
        mapped = input_map(judged.robot, reference.state)
        if mapped is None:
            continue
        svd = parallel_svd(reference.state)
        held = 1.0 - supervise.at(t, reference.state).sigma if controller.blended else 1.0
        box = Box(-limit - reference.f1, limit - reference.f1, -limit - reference.f2, limit - reference.f2)
        load = _passive_load(judged.robot, reference, here, judged.loads.passive)
        motion = (reference.state.vx, reference.state.vy, reference.ax, reference.ay)
        instant = PassageInstant(time, *motion, mapped, svd.t_x, svd.t_y, held, box, 0.0, 0.0, load)
        lost_x, lost_y = _acceleration_error(instant, instant, weight, (0.0, 0.0), (0.0, 0.0))
        found.append(instant._replace(lost_x=lost_x, lost_y=lost_y))
    return found


def _response(
    instants: Sequence[PassageInstant],
    here: ParallelSvd,
    feedback: Feedback,
    lasting: float,
    push: float,
    pushed: tuple[float, float],
) -> float:
    """Return the largest displacement (m) by accelerations along the crossing's t_s: lasting, and during a push."""
    period = instants[1].time - instants[0].time
    share = 1.0 - math.exp(-feedback.observer_rate * period)
    x = y = vx = vy = d1 = d2 = 0.0
    largest = 0.0
    for number, instant in enumerate(instants):
        load = lasting + instant.load + (push if pushed[0] <= instant.time < pushed[1] else 0.0)
        # a platform behind its reference is where that was before: what the motors can do is that of then
        ahead = round(_lead(instant, x, y) / period)
        place = instants[min(max(number + ahead, 0), len(instants) - 1)]
        mapped = place.map
        answer = (-feedback.kd * vx - feedback.kp * x, -feedback.kd * vy - feedback.kp * y)
        ax, ay = _acceleration_error(instant, place, feedback.weight, answer, (d1, d2))
        ax, ay = ax - instant.lost_x + load * here.t_x, ay - instant.lost_y + load * here.t_y
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
    u1, u2 = box_least_squares(
        *normal_matrix(mapped, weight),
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
    rates = (
        (state.leg1.dtheta - state.leg1.dq1, one[1] - one[0]),
        (state.leg2.dtheta - state.leg2.dq1, two[1] - two[0]),
        (state.leg2.dtheta - state.leg1.dtheta, two[1] - one[1]),
    )
    return -friction / robot.mass * sum(math.tanh(rate / SMOOTHING) * slope for rate, slope in rates)


def _rates(link: LegParameters, leg: Leg, here: ParallelSvd) -> tuple[float, float]:
    """Return the rates (rad/m) of a leg's motor and distal link for a motion of the platform along t_s."""
    motor = (leg.u_x * here.t_x + leg.u_y * here.t_y) / (link.proximal * leg.sin_q2)
    distal = -(leg.r_x * here.t_x + leg.r_y * here.t_y) / (link.distal * leg.sin_q2)
    return motor, distal


def _step(rate_hz: int) -> float:
    """Return the step (s): a sample, or a part of one where samples are far apart."""
    return 1.0 / rate_hz / math.ceil(1.0 / rate_hz / LONGEST_STEP - 1e-9)
