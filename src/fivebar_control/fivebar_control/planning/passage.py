"""The passage condition: how far the declared loads displace the platform where the motors cannot hold it.

On the Type 2 locus no torque acts along t_s, and near it a small part of one: the drives' limit holds a load there only
from some kappa on. The faster kappa changes, the shorter the platform is left to the load. The response is that of the
error's equation along the reference, e'' = G(t) (u - u_0) + a_F t_s, with the law's feedback, its weight on torque, its
observer and the limits of the drives (docs/theory.md, section 15).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from fivebar_control.laws.registry import TunedController
from fivebar_control.loop.supervisor import Supervisor
from fivebar_control.model.singularity import parallel_svd
from fivebar_control.planning.passage_response import JudgedPassage, LoadCase, largest_displacement
from fivebar_control.planning.predicted_run import Peak
from fivebar_control.trajectory.desired import desired_along, desired_at, reference_of
from fivebar_control.trajectory.planner import Crossing, Plan
from fivebar_description.imu import STANDARD_GRAVITY
from fivebar_description.loads import Loads
from fivebar_description.parameters import FiveBar, with_floats

BEFORE, AFTER = 0.08, 0.12
"""Time (s) about a crossing in which the response is followed at least: the loads' build-up, and the return to the
path."""

KAPPA_BEFORE, KAPPA_AFTER = 0.1, 0.2
"""The same in kappa, as it changes at the crossing: a slow one leaves the platform to the loads for longer."""

LONGEST_WINDOW = 1.0
"""Time (s) on either side of a crossing in which the response is followed at most."""

LONGEST_STEP = 2e-3
"""Of the integration (s)."""

ONSETS = (0.5, 1.0)
"""When the push begins, as a share of its length before the crossing."""

SLOWEST_SHIFT, SHIFT_STEPS = 1e-3, 400
"""Of `unavoidable`: the root of beta below which the closed form does, and steps of the search for the largest."""


class Judged(NamedTuple):
    """A plan with all that its crossings are judged by: the arguments of `displacement`."""

    robot: FiveBar
    plan: Plan
    rate_hz: int
    follower: TunedController
    torque_limit: float
    loads: Loads


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
    """Return the displacement (m) that a load makes at least, whatever the law, when it begins at the worst.

    The platform is on its reference and at rest relative to it when the load begins; a law that knows the load before
    may be elsewhere, and does better. The displacement is that of `exposure` for a platform that the load pushes
    onwards along its path, whose displacement takes it away from the locus: theory.md, section 15. In units of a_F
    t_F^2 and t_F it is the largest eta of eta'' = 1 - |s| - beta eta, beta = a_F t_F / speed, that begins at rest at s
    = -1, as long as the comparison with any other motion holds, sqrt(beta) (s + 1) <= pi.

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


def _displacement_at(judged: Judged, crossing: Crossing) -> float:
    robot, plan, controller = with_floats(judged.robot), judged.plan, judged.follower.controller
    here = desired_at(robot, plan, crossing.time, plan.path.at(crossing.time)).state
    period = _step(judged.rate_hz)
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
        *plan.modes_at(crossing.time),
        parallel_svd(here),
        judged.follower.nominal.feedback,
        float(judged.torque_limit),
        float(judged.loads.passive),
    )
    return largest_displacement(passage, np.array(times), references, held, _load_cases(robot, judged.loads))


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


def _step(rate_hz: int) -> float:
    """Return the step (s): a sample, or a part of one where samples are far apart."""
    return 1.0 / rate_hz / math.ceil(1.0 / rate_hz / LONGEST_STEP - 1e-9)
