# SPDX-License-Identifier: Apache-2.0
"""A virtual constraint along the whole path: the robot keeps to the path, and its motion decides the timing.

`unified` follows the plan x_d(t). This law follows x_d(theta), with a clock theta of its own. Each sample theta is
moved to where the path is nearest to the robot, so that no force pulls along the path towards a place in time. The pace
rho = dtheta/dt is the one at which the robot passes along the path, and the law's acceleration along it is

    xddot = x_d'' rho^2 + x_d' drho,      drho = rate (rho_0 - rho),

with rho_0 a little above 1 while the robot is late, and below while it is early. drho is kept to what the torque limit
leaves. Across the path it is the unified law, with its gains, its weight on the torque and its observer; on the Type 2
locus it acts across the path as far as v_1 does. Where the plan is slow the place on the path says nothing of the time:
there the clock follows the plan, so that the robot sets out and comes to rest at the goal as planned.

All references of a motion have to be known when it begins. For one outside of them, as one held after a fault, the
torque is that of `unified`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_control.laws.gains import DISTURBANCE_LIMIT, KD, KP, TORQUE_LIMIT, WEIGHT, UnifiedSettings
from fivebar_control.laws.law import Feedback, Instant, Law
from fivebar_control.laws.reference import Reference, held_torque, reference_from_platform
from fivebar_control.laws.torque import Torque
from fivebar_control.laws.unified import INITIAL_MEMORY as NOTHING_OBSERVED
from fivebar_control.laws.unified import UnifiedMemory, input_map, normal_matrix, restarted, unified_step
from fivebar_control.model.state import Platform, State, WorkingMode
from fivebar_description.parameters import FiveBar, lost_torque
from fivebar_description.settings import Setting

FloatArray = NDArray[np.float64]

SEARCHED = 200
"""Samples of the plan among which a reference is looked for after a gap."""

FASTEST_CHANGE = 20.0
"""Largest change of the pace in a second (1/s)."""


class PathSettings(NamedTuple):
    """Settings of the path law; those that it shares with the unified law are by default those of section `unified`."""

    kp: Annotated[float, KP] = UnifiedSettings().kp
    kd: Annotated[float, KD] = UnifiedSettings().kd
    weight: Annotated[float, WEIGHT] = UnifiedSettings().weight
    observer_rate: Annotated[
        float, Setting("Bandwidth of the disturbance observer, 0 for none.", "1/s", at_least=0.0, at_most=1e4)
    ] = UnifiedSettings().observer_rate
    disturbance_limit: Annotated[float, DISTURBANCE_LIMIT] = UnifiedSettings().disturbance_limit
    torque_limit: Annotated[float | None, TORQUE_LIMIT] = None
    pace_rate: Annotated[
        float,
        Setting("Rate with which the pace returns to that of the plan.", "1/s", at_least=0.0, at_most=1e3),
    ] = 10.0
    catch_up: Annotated[
        float,
        Setting(
            "By what share a robot that is late may be faster than the plan, and one that is early slower.",
            at_least=0.0,
            at_most=0.9,
        ),
    ] = 0.25
    catch_up_time: Annotated[
        float,
        Setting("Delay at which a robot is faster by the whole of that share.", "s", above=0.0, at_most=10.0),
    ] = 0.05
    slow: Annotated[
        float,
        Setting(
            "Speed of the plan well below which the clock follows the plan, not the robot.",
            "m/s",
            above=0.0,
            at_most=10.0,
        ),
    ] = 0.03


class PathMemory(NamedTuple):
    """State of the law from sample to sample.

    Attributes:
        plan: float64[n, 6], the references of all samples as in `Platform`; [0, 6] where none are known.
        sample: of the plan at which the last reference was found.
        clock: theta, in samples of the plan.
        unified: of the law across the path.
    """

    plan: FloatArray
    sample: int
    clock: float
    unified: UnifiedMemory


def path_memory(
    robot: FiveBar, mode: WorkingMode, references: Sequence[Platform], period: float, settings: PathSettings
) -> PathMemory:
    """Return the memory before the first sample of a plan."""
    return PathMemory(np.array(references, dtype=np.float64).reshape(-1, 6), 0, 0.0, NOTHING_OBSERVED)


def followed(memory: PathMemory, references: FloatArray) -> PathMemory:
    """Return the memory with all references of a motion that begins, or that is another one from the next sample on.

    Where the motion under way changes, as to stop, the clock goes on.

    Args:
        memory: of the sample before.
        references: float64[n, 6], those of all samples of the motion.
    """
    known = memory.sample + 1
    if np.array_equal(memory.plan[:known], references[:known]):
        return PathMemory(references, memory.sample, memory.clock, memory.unified)
    return PathMemory(references, 0, 0.0, memory.unified)


def after_gap(memory: PathMemory) -> PathMemory:
    """Return the memory after a gap in the samples: the clock stays, and is moved with the next sample."""
    return PathMemory(memory.plan, memory.sample, memory.clock, restarted(memory.unified))


def sample_of(plan: FloatArray, last: int, reference: Reference) -> int:
    """Return the sample of the plan whose reference is given, looked for from the last one on; -1 for none."""
    if last + 1 < plan.shape[0] and _is_at(plan, last + 1, reference):
        return last + 1
    for sample in range(last, min(last + SEARCHED, plan.shape[0])):
        if _is_at(plan, sample, reference):
            return sample
    return -1


def _is_at(plan: FloatArray, sample: int, reference: Reference) -> bool:
    desired = reference.state
    return bool(
        plan[sample, 0] == desired.x
        and plan[sample, 1] == desired.y
        and plan[sample, 2] == desired.vx
        and plan[sample, 3] == desired.vy
    )


def plan_at(plan: FloatArray, clock: float, period: float) -> Platform:
    """Return the plan at a clock (samples) between two samples: places and speeds by cubics, accelerations by lines."""
    last = plan.shape[0] - 1
    at = min(int(clock), max(last - 1, 0))
    after = min(at + 1, last)
    share = clock - at
    if share <= 0.0:
        return Platform(plan[at, 0], plan[at, 1], plan[at, 2], plan[at, 3], plan[at, 4], plan[at, 5])
    return Platform(
        _cubic(plan[at, 0], plan[at, 2], plan[after, 0], plan[after, 2], share, period),
        _cubic(plan[at, 1], plan[at, 3], plan[after, 1], plan[after, 3], share, period),
        _cubic(plan[at, 2], plan[at, 4], plan[after, 2], plan[after, 4], share, period),
        _cubic(plan[at, 3], plan[at, 5], plan[after, 3], plan[after, 5], share, period),
        (1.0 - share) * plan[at, 4] + share * plan[after, 4],
        (1.0 - share) * plan[at, 5] + share * plan[after, 5],
    )


def _cubic(value1: float, slope1: float, value2: float, slope2: float, share: float, period: float) -> float:
    """Return the cubic between two values a period (s) apart with slopes (1/s), at a share of the period."""
    rest = 1.0 - share
    curved = rest * rest * share * period * slope1 - rest * share * share * period * slope2
    return rest * rest * (1.0 + 2.0 * share) * value1 + share * share * (3.0 - 2.0 * share) * value2 + curved


def nearest_clock(plan: FloatArray, clock: float, state: State, period: float, slow: float) -> float:
    """Return the clock (samples) at which the plan is nearest to the platform, the less moved the slower the plan is.

    Two Newton steps from a clock; between two samples a robot moves little along the path.
    """
    last = float(plan.shape[0] - 1)
    for _ in range(2):
        there = plan_at(plan, clock, period)
        along = there.vx * (state.x - there.x) + there.vy * (state.y - there.y)
        squared = there.vx * there.vx + there.vy * there.vy
        clock += along / (squared + slow * slow) / period
        clock = min(max(clock, 0.0), last)
    return clock


def pace_change(
    robot: FiveBar, state: State, desired: Platform, pace: float, wanted: float, off: Torque, settings: PathSettings
) -> float:
    """Return the change of the pace (1/s) nearest to the wanted one at which no motor exceeds the torque limit.

    Args:
        robot: nominal robot of the law.
        state: measured state.
        desired: the plan at the clock.
        pace: at which the robot passes along the path.
        wanted: change of the pace (1/s).
        off: torque besides that for the acceleration (Nm).
        settings: of the law.
    """
    wanted = min(max(wanted, -FASTEST_CHANGE), FASTEST_CHANGE)
    mapped = input_map(robot, state)
    if mapped is None or settings.torque_limit is None:
        return wanted
    h11, h12, h22 = normal_matrix(mapped, settings.weight)
    determinant = h11 * h22 - h12 * h12
    kp, kd = settings.kp, settings.kd
    ax = desired.ax * pace * pace + kd * (pace * desired.vx - state.vx) + kp * (desired.x - state.x) - mapped.a0_x
    ay = desired.ay * pace * pace + kd * (pace * desired.vy - state.vy) + kp * (desired.y - state.y) - mapped.a0_y
    low, high = -FASTEST_CHANGE, FASTEST_CHANGE
    u1, u2 = held_torque(robot, state, desired.ax * pace * pace, desired.ay * pace * pace)
    for motor in range(2):
        # u = H^-1 G^T (a + drho x_d')
        weight1, weight2 = (h22, -h12) if motor == 0 else (-h12, h11)
        row_x = (weight1 * mapped.g_x1 + weight2 * mapped.g_x2) / determinant
        row_y = (weight1 * mapped.g_y1 + weight2 * mapped.g_y2) / determinant
        held, slope = row_x * ax + row_y * ay, row_x * desired.vx + row_y * desired.vy
        held += settings.weight * (weight1 * u1 + weight2 * u2) / determinant
        held += off.tau1 if motor == 0 else off.tau2
        if abs(slope) * FASTEST_CHANGE < 1e-9:
            continue
        first, second = (-settings.torque_limit - held) / slope, (settings.torque_limit - held) / slope
        low, high = max(low, min(first, second)), min(high, max(first, second))
    if low > high:
        return min(max(0.5 * (low + high), -FASTEST_CHANGE), FASTEST_CHANGE)
    return min(max(wanted, low), high)


def path_step(
    robot: FiveBar, instant: Instant, memory: PathMemory, settings: PathSettings
) -> tuple[Torque, PathMemory]:
    """Return the torque (Nm) of the path law and its memory for the next sample."""
    state, reference, plan, period = instant.state, instant.reference, memory.plan, instant.period
    across = UnifiedSettings(
        settings.kp,
        settings.kd,
        settings.weight,
        settings.observer_rate,
        settings.disturbance_limit,
        settings.torque_limit,
    )
    sample = sample_of(plan, memory.sample, reference)
    if sample < 0 or reference.by_motors:
        torque, kept = unified_step(robot, state, reference, memory.unified, across, period)
        return torque, PathMemory(plan, memory.sample, memory.clock, kept)
    # the clock goes on over missing samples, and begins with the first reference
    going_on = memory.clock + max(0, sample - memory.sample - 1)
    begin = float(sample) if memory.clock == 0.0 else going_on
    clock = nearest_clock(plan, begin, state, period, settings.slow)
    desired = plan_at(plan, clock, period)
    squared, floor = desired.vx * desired.vx + desired.vy * desired.vy, settings.slow * settings.slow
    pace = (desired.vx * state.vx + desired.vy * state.vy + floor) / (squared + floor)
    late = (sample - clock) * period / settings.catch_up_time
    goal = 1.0 + settings.catch_up * min(max(late, -1.0), 1.0)
    # what the reference compensates besides its friction
    desired0 = reference.state
    d1 = lost_torque(robot, robot.leg1, desired0.leg1.q1, desired0.leg1.dq1) - reference.f1
    d2 = lost_torque(robot, robot.leg2, desired0.leg2.q1, desired0.leg2.dq1) - reference.f2
    friction = reference_from_platform(
        robot,
        instant.mode,
        Platform(desired.x, desired.y, pace * desired.vx, pace * desired.vy, 0.0, 0.0),
    )
    f1, f2 = friction.f1 - d1, friction.f2 - d2
    off = Torque(f1 - memory.unified.d1, f2 - memory.unified.d2)
    change = pace_change(robot, state, desired, pace, settings.pace_rate * (goal - pace), off, settings)
    ax, ay = desired.ax * pace * pace + desired.vx * change, desired.ay * pace * pace + desired.vy * change
    u1, u2 = held_torque(robot, friction.state, ax, ay)
    timed = Reference(
        state=friction.state,
        ax=ax,
        ay=ay,
        f1=f1,
        f2=f2,
        by_motors=False,
        u1=u1,
        u2=u2,
    )
    torque, kept = unified_step(robot, state, timed, memory.unified, across, period)
    # where the plan is slow the clock goes on as the plan does
    onward = clock + (pace * squared + floor) / (squared + floor)
    lagging = (sample + 1.0 - onward) * floor / (squared + floor)
    return torque, PathMemory(plan, sample, min(max(onward + lagging, 0.0), plan.shape[0] - 1.0), kept)


def across_feedback(settings: PathSettings) -> Feedback:
    """Return the feedback of the law across the path."""
    return Feedback(settings.kp, settings.kd, settings.weight, settings.observer_rate)


LAW = Law(
    name="path",
    title="path law",
    settings=PathSettings,
    step=path_step,
    after_gap=after_gap,
    prepare=path_memory,
    follow=followed,
    observes_disturbance=True,
    feedback=across_feedback,
    like_unified=True,
    timed=False,
)
