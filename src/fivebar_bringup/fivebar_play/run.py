# SPDX-License-Identifier: Apache-2.0
"""Computations of the page: a straight motion through the Type 2 locus, and the run of each controller.

The closed loop, the laws, the model and both simulated robots are the project's own; here is what binds them together
without arrays, as scalar functions that are translated. A run is the same as one of `fivebar simulate`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from fivebar_bringup.simulation.engine_estimator import state_of
from fivebar_bringup.simulation.robot import (
    ideal_later,
    ideal_sensed,
    ideal_start,
    later_with_effects,
    sensed_with_effects,
    start_with_effects,
)
from fivebar_control.laws.reference import reference_from_platform
from fivebar_control.laws.torque import Torque
from fivebar_control.loop.closed_loop import Answered, Known, LoopSettings
from fivebar_control.loop.cycle import CycleMemory, CycleSettings
from fivebar_control.loop.plan_sample import PlanSample
from fivebar_control.model.geometry import reach_margin
from fivebar_control.model.kinematics import det_a, state_from_platform
from fivebar_control.model.singularity import STRETCHED
from fivebar_control.model.state import Joints, WorkingMode
from fivebar_control.root_search import zero_between
from fivebar_control.safety.stages import NO_FAULT
from fivebar_control.trajectory.path import SEARCH_STEPS, Segment
from fivebar_control.trajectory.planner import Crossing, crossing_at
from fivebar_description.parameters import FiveBar
from fivebar_sim.effects.loads import Push
from fivebar_sim.effects.mechanism import Mechanism
from fivebar_sim.sensors import shaped


class PlayMotion(NamedTuple):
    """A straight motion of the platform, and its first crossing of the Type 2 locus.

    Attributes:
        segment: the motion.
        share: of the way, where it crosses; NaN where it does not.
        crossing: see there; without meaning where it does not cross.
    """

    segment: Segment
    share: float
    crossing: Crossing


class PlayRun(NamedTuple):
    """The parts of a run.

    Attributes:
        control: of the control cycle, with the robot as the controllers know it.
        actual: the simulated robot.
        mechanism: the same with its effects, None for an ideal one.
        rate_hz: samples per second.
        steps, step: integration steps per sample, and their length (s).
        torque_limit: of the drives (Nm).
        motion: what is asked for.
        samples: of the run so far, a `PlaySample` each; it grows.
    """

    control: CycleSettings
    actual: FiveBar
    mechanism: Any
    rate_hz: int
    steps: int
    step: float
    torque_limit: float
    motion: PlayMotion
    samples: Any


class PlayRobot(NamedTuple):
    """The robot at a sample: the state of its plant, exact and measured joints, and whether it can be moved on."""

    plant: Any
    exact: Joints
    seen: Joints
    diverged: bool


class PlaySample(NamedTuple):
    """The shown values of a sample: platform (m), motors (rad), distance from the reference (m), det A, sigma, torque.

    Torques (Nm) are what the controller asks for and what is commanded; none is asked for once a fault has stopped it.
    """

    x: float
    y: float
    q11: float
    q21: float
    error: float
    determinant: float
    kappa: float
    sigma: float
    asked1: float
    asked2: float
    command1: float
    command2: float


class PlayOutcome(NamedTuple):
    """A run: its samples, the number of its first fault and the sample of that, -1 without one."""

    samples: Any
    fault: int
    fault_sample: int


def assembly_at(robot: FiveBar, mode: WorkingMode, segment: Segment, share: float) -> float:
    """Return det A at a share of a segment's way."""
    place = segment.moved(share, 0.0, 0.0)
    return det_a(state_from_platform(robot, mode, place.x, place.y, 0.0, 0.0))


def first_crossing(robot: FiveBar, mode: WorkingMode, segment: Segment) -> float:
    """Return the share of the way at which a segment first meets the Type 2 locus, NaN where it never does."""
    before = assembly_at(robot, mode, segment, 0.0) > 0.0
    for number in range(SEARCH_STEPS):
        after = assembly_at(robot, mode, segment, (number + 1) / SEARCH_STEPS) > 0.0
        if before != after:
            low, high = number / SEARCH_STEPS, (number + 1) / SEARCH_STEPS
            return zero_between(lambda s: assembly_at(robot, mode, segment, s), low, high, 1e-15)
    return math.nan


def least_reach(robot: FiveBar, segment: Segment) -> float:
    """Return how far (m) inside the reach of both legs a segment stays; negative where it leaves it."""
    least = math.inf
    for number in range(SEARCH_STEPS + 1):
        place = segment.moved(number / SEARCH_STEPS, 0.0, 0.0)
        least = min(least, reach_margin(robot.leg1, place.x, place.y), reach_margin(robot.leg2, place.x, place.y))
    return least


def play_motion(robot: FiveBar, mode: WorkingMode, segment: Segment, zone_time: float) -> PlayMotion:
    """Return a motion with its first crossing, whose blending zone takes a time (s)."""
    share = first_crossing(robot, mode, segment)
    if math.isnan(share):
        nowhere = Crossing(0, math.nan, math.nan, math.nan, math.nan, math.nan, 0.0, STRETCHED)
        return PlayMotion(segment, share, nowhere)
    return PlayMotion(segment, share, crossing_at(robot, mode, segment, 0, share, zone_time, None))


def pushed(mechanism: Mechanism, force: float, start: float) -> Mechanism:
    """Return a robot whose platform is pushed with another force (N) from another time (s) on."""
    push = mechanism.push
    return Mechanism(
        leg1=mechanism.leg1,
        leg2=mechanism.leg2,
        robot=mechanism.robot,
        step=mechanism.step,
        period=mechanism.period,
        elastic=mechanism.elastic,
        compliant=mechanism.compliant,
        half_play=mechanism.half_play,
        tip_mass=mechanism.tip_mass,
        joint_stiffness=mechanism.joint_stiffness,
        joint_damping=mechanism.joint_damping,
        clearance=mechanism.clearance,
        platform_friction=mechanism.platform_friction,
        bandwidth=mechanism.bandwidth,
        weight_x=mechanism.weight_x,
        weight_y=mechanism.weight_y,
        shaking=mechanism.shaking,
        force_x=mechanism.force_x,
        force_y=mechanism.force_y,
        push=Push(force, push.heading, push.along, start, push.length),
        cable=mechanism.cable,
        heating=mechanism.heating,
        supply=mechanism.supply,
        delays=mechanism.delays,
    )


def begin_ideal(run: PlayRun) -> PlayRobot:
    """Return the rigid robot at rest at the start of the motion."""
    control, start = run.control, run.motion.segment
    plant = ideal_start(control.robot, run.actual, control.mode, None, start.start_x, start.start_y)
    sensed = ideal_sensed(None, plant)
    return PlayRobot(plant, sensed.exact, sensed.seen, False)


def begin_with_effects(run: PlayRun) -> PlayRobot:
    """Return the robot with effects at rest where its encoders say that the motion starts."""
    control, start = run.control, run.motion.segment
    plant = start_with_effects(control.robot, run.actual, control.mode, run.mechanism, start.start_x, start.start_y)
    sensed = sensed_with_effects(run.mechanism, plant)
    return PlayRobot(plant, sensed.exact, sensed.seen, False)


def advance_ideal(run: PlayRun, robot: PlayRobot, number: int, command: Torque) -> PlayRobot:
    """Return the rigid robot one sample later under a command (Nm)."""
    limit = run.torque_limit
    applied = Torque(shaped(command.tau1, 0.0, limit), shaped(command.tau2, 0.0, limit))
    after = ideal_later(run.actual, None, run.steps, run.step, robot.plant, number, applied)
    if after.gap == math.inf:
        return PlayRobot(robot.plant, robot.exact, robot.seen, True)
    sensed = ideal_sensed(None, after.state)
    return PlayRobot(after.state, sensed.exact, sensed.seen, False)


def advance_with_effects(run: PlayRun, robot: PlayRobot, number: int, command: Torque) -> PlayRobot:
    """Return the robot with effects one sample later under a command (Nm)."""
    limit = run.torque_limit
    applied = Torque(shaped(command.tau1, 0.0, limit), shaped(command.tau2, 0.0, limit))
    after = later_with_effects(run.actual, run.mechanism, run.steps, run.step, robot.plant, number, applied)
    if after.gap == math.inf:
        return PlayRobot(robot.plant, robot.exact, robot.seen, True)
    sensed = sensed_with_effects(run.mechanism, after.state)
    return PlayRobot(after.state, sensed.exact, sensed.seen, False)


def measured(run: PlayRun, estimator: None, robot: PlayRobot, number: int) -> Known:
    """Return what the controllers know: encoders on all joints, and their own lengths."""
    return Known(True, state_of(run.control.robot, robot.seen), 0.0, 0.0, NO_FAULT)


def planned(run: PlayRun, moment: int) -> PlanSample:
    """Return the plan at a sample."""
    control, segment = run.control, run.motion.segment
    t = moment / run.rate_hz
    platform, line = segment.at(t), segment.line_at(t)
    return PlanSample(
        reference=reference_from_platform(control.robot, control.mode, platform),
        platform=platform,
        direction_x=line.direction_x,
        direction_y=line.direction_y,
        epsilon=run.motion.crossing.epsilon,
        time_weight=0.0,
        ahead=None,
    )


def recorded(
    run: PlayRun,
    log: None,
    number: int,
    robot: PlayRobot,
    known: Known,
    planned: PlanSample,
    loop: Answered,
) -> None:
    """Add a sample to the run."""
    cycle, latched = loop.cycle, loop.latched
    truth = state_of(run.actual, robot.exact)
    sample = PlaySample(
        x=truth.x,
        y=truth.y,
        q11=robot.exact.q11,
        q21=robot.exact.q21,
        error=math.hypot(truth.x - planned.platform.x, truth.y - planned.platform.y),
        determinant=det_a(truth),
        kappa=cycle.kappa,
        sigma=cycle.sigma,
        asked1=math.nan if latched else cycle.requested.tau1,
        asked2=math.nan if latched else cycle.requested.tau2,
        command1=cycle.command.tau1,
        command2=cycle.command.tau2,
    )
    run.samples.append(sample)


def never_ends(run: PlayRun, fault: int) -> bool:
    """Return that a run goes on after a fault: the robot brakes, and coasts."""
    return False


def outcome(run: PlayRun, log: None, robot: PlayRobot, fault: int, fault_sample: int) -> PlayOutcome:
    """Return the run with its first fault."""
    return PlayOutcome(run.samples, fault, fault_sample)


def play(loop: Any, run: PlayRun, memory: CycleMemory) -> PlayOutcome:
    """Return what becomes of a run from a controller's memory on; `loop` is the closed loop, bound to this module."""
    last = math.ceil(run.motion.segment.duration * run.rate_hz - 1e-6)
    outcome: PlayOutcome = loop(run, LoopSettings(run.control, 0, last, 0, False), memory)
    return outcome


RUN: Mapping[str, Callable[..., Any]] = {
    "estimate": measured,
    "plan_at": planned,
    "record": recorded,
    "ended": never_ends,
    "conclude": outcome,
}
IDEAL: Mapping[str, Callable[..., Any]] = {"begin": begin_ideal, "advance": advance_ideal}
WITH_EFFECTS: Mapping[str, Callable[..., Any]] = {"begin": begin_with_effects, "advance": advance_with_effects}
"""The functions of the page's runs, by the names under which the closed loop knows them."""
