# SPDX-License-Identifier: Apache-2.0
"""The closed loop from the first sample to the last, written once for all that run it without ROS.

A run is an object with methods: the offline runner's, with Pinocchio's plant, and the planner's, on the robot as
modelled. The functions below call them. The compiled engine, since numba compiles no methods, binds functions of
numbers to these names instead (`compiling.compiled_and_kept`), and compiles the loop as it stands.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, Protocol, TypeVar

from fivebar_control.estimation.fault_numbers import TRIP_NAMES
from fivebar_control.laws.law import Step, no_step, unchanged
from fivebar_control.laws.reference import against_disturbance
from fivebar_control.laws.registry import ESTIMATE, SIGMOID, Controller, TunedController
from fivebar_control.laws.torque import UNDEFINED, ZERO, Torque
from fivebar_control.loop.cycle import Cycle, CycleMemory, CycleSettings, control_cycle
from fivebar_control.loop.plan_sample import PlanSample
from fivebar_control.model.state import Platform, State, WorkingMode
from fivebar_control.safety.brake import Brake
from fivebar_control.safety.stages import NO_FAULT, STAGE_NAMES, Limits
from fivebar_description.parameters import FiveBar, with_floats
from fivebar_description.settings import as_numbers

Result = TypeVar("Result", covariant=True)

PLANT_DIVERGED = 8
"""Number of the fault of a simulated robot that can be moved no further, beside those of the guard's stages."""

FAULT_NAMES = STAGE_NAMES | TRIP_NAMES | {PLANT_DIVERGED: "plant_diverged"}
"""Names of faults by number; they are those of the node graph."""

STATE_STALE = 32
"""Number of the fault that too many samples in a row were lost, beside those of stages and estimator."""


class LoopSettings(NamedTuple):
    """Constants of the loop.

    Attributes:
        control: of the control cycle.
        first, last: samples with which the run begins and ends.
        lead: samples from a measurement to the instant for which its state holds.
        feed_forward: whether the laws compensate the estimated disturbances.
    """

    control: CycleSettings
    first: int
    last: int
    lead: int
    feed_forward: bool


class Known(NamedTuple):
    """The controllers' knowledge of the robot at a sample.

    Attributes:
        present: whether the sample reaches them at all; else the last command holds.
        state: measured or estimated.
        d1, d2: estimated disturbance torques of the motors (Nm).
        trip: number of the fault that the estimator has found, `NO_FAULT` for none.
    """

    present: bool
    state: State
    d1: float
    d2: float
    trip: int


class Advanced(NamedTuple):
    """A robot that has been moved to its next sample, unless its motion `diverged`."""

    diverged: bool


class LoopRun(Protocol[Result]):
    """A run as an object, which holds its robot, its estimator and its log itself."""

    def estimate(self, number: int) -> Known:
        """Return what is known of the robot after the readings of a sample."""

    def plan_at(self, moment: int) -> PlanSample:
        """Return the plan at the moment of a sample."""

    def record(self, number: int, known: Known, planned: PlanSample, loop: Answered) -> object:
        """Record a sample, and the loop after it."""

    def ended(self, fault: int) -> bool:
        """Return whether the run ends with the sample, given the number of its first fault so far."""

    def advance(self, number: int, command: Torque) -> Advanced:
        """Move the robot by one sample, under the command (Nm) that answers a sample."""

    def conclude(self) -> Result:
        """Return the result of the run."""


def begin(run: LoopRun[Result]) -> Advanced | None:
    """Return the robot, measured at the first sample; None where the run has it."""
    return None


def first_known(run: LoopRun[Result], robot: Advanced | None) -> Known | None:
    """Return the estimator before the first sample; None where the run has it."""
    return None


def empty_log(run: LoopRun[Result]) -> object:
    """Return the log before the first sample; None where the run has it."""
    return None


def estimate(run: LoopRun[Result], estimator: Known | None, robot: Advanced | None, number: int) -> Known:
    """Return the estimator after the readings of a sample, with what is known of the robot then."""
    return run.estimate(number)


def plan_at(run: LoopRun[Result], moment: int) -> PlanSample:
    """Return the plan at the moment of a sample."""
    return run.plan_at(moment)


def record(
    run: LoopRun[Result],
    log: object,
    number: int,
    robot: Advanced | None,
    known: Known,
    planned: PlanSample,
    loop: Answered,
) -> object:
    """Return the log with a sample, and the loop after it."""
    return run.record(number, known, planned, loop)


def ended(run: LoopRun[Result], fault: int) -> bool:
    """Return whether the run ends with the sample, given the number of its first fault so far."""
    return run.ended(fault)


def advance(run: LoopRun[Result], robot: Advanced | None, number: int, command: Torque) -> Advanced:
    """Return the robot one sample later, and measured there, under the command (Nm) that answers a sample."""
    return run.advance(number, command)


def conclude(run: LoopRun[Result], log: object, robot: Advanced | None, fault: int, fault_sample: int) -> Result:
    """Return the result of the run, given its first fault and the sample of that, -1 without one."""
    return run.conclude()


nominal_step = constraint_step = no_step
nominal_after_gap = constraint_after_gap = unchanged
"""The laws, to be bound before (`law_functions`)."""


class Answered(NamedTuple):
    """The loop after a sample.

    Attributes:
        cycle: that answered the last sample which reached the controllers; its command holds.
        came: that sample.
        latched: whether a fault had been latched before its answer.
        fault, fault_sample: number of the first fault, and its sample; `NO_FAULT` and -1 without one.
    """

    cycle: Cycle
    came: int
    latched: bool
    fault: int
    fault_sample: int


def unanswered(first: CycleMemory, number: int) -> Answered:
    """Return the loop before its first sample, given the memory of the control cycle and the sample's number."""
    cycle = Cycle(0.0, 0.0, UNDEFINED, UNDEFINED, UNDEFINED, ZERO, NO_FAULT, first)
    return Answered(cycle, number, False, NO_FAULT, -1)


def answer(
    nominal_step: Step,
    constraint_step: Step,
    nominal_after_gap: Callable[[Any], Any],
    constraint_after_gap: Callable[[Any], Any],
    settings: LoopSettings,
    before: Answered,
    number: int,
    known: Known,
    planned: PlanSample,
) -> Answered:
    """Return the loop after a sample, whose torque command is that of its cycle.

    Args:
        nominal_step, constraint_step, nominal_after_gap, constraint_after_gap: the laws (`law_functions`).
        settings: constants.
        before: the loop after the sample before.
        number: of the sample.
        known: of the robot after its readings; without a present sample the last command holds.
        planned: the plan at the moment for which the state holds.
    """
    if not known.present:
        return before
    kept, fault, fault_sample = before.cycle.memory, before.fault, before.fault_sample
    if number - before.came > 1:
        kept = CycleMemory(
            nominal=nominal_after_gap(kept.nominal),
            constraint=constraint_after_gap(kept.constraint),
            command=kept.command,
            excess=kept.excess,
            braking=kept.braking,
        )
    reference = planned.reference
    if settings.feed_forward:
        reference = against_disturbance(reference, known.d1, known.d2)
    trip = known.trip
    if fault == NO_FAULT and trip != NO_FAULT:
        fault, fault_sample = trip, number
    latched = fault != NO_FAULT
    cycle = control_cycle(
        nominal_step,
        constraint_step,
        settings.control,
        kept,
        known.state,
        reference,
        planned,
        latched,
        trip == NO_FAULT,
    )
    if cycle.fault != NO_FAULT:
        fault, fault_sample = cycle.fault, number
    return Answered(cycle, number, latched, fault, fault_sample)


def stopped(loop: Answered, number: int) -> Answered:
    """Return the loop with zero torque, at a sample from which on too many have been lost."""
    cycle, memory = loop.cycle, loop.cycle.memory
    kept = CycleMemory(memory.nominal, memory.constraint, ZERO, memory.excess, 0)
    still = Cycle(cycle.sigma, cycle.kappa, cycle.nominal, cycle.constraint, cycle.requested, ZERO, cycle.fault, kept)
    return Answered(still, loop.came, True, STATE_STALE, number)


def cleared(loop: Answered) -> Answered:
    """Return the loop without its fault."""
    return Answered(loop.cycle, loop.came, False, NO_FAULT, -1)


def run_loop(run: LoopRun[Result], settings: LoopSettings, first: CycleMemory) -> Result:
    """Make a run and return its result.

    Args:
        run: the robot, and who watches.
        settings: constants.
        first: memory of the control cycle before the first sample.
    """
    robot = begin(run)
    estimator, log = first_known(run, robot), empty_log(run)
    loop = unanswered(first, settings.first)
    fault, fault_sample = NO_FAULT, -1
    for number in range(settings.first, settings.last + 1):
        estimator = estimate(run, estimator, robot, number)
        planned = plan_at(run, number + settings.lead)
        loop = answer(
            nominal_step,
            constraint_step,
            nominal_after_gap,
            constraint_after_gap,
            settings,
            loop,
            number,
            estimator,
            planned,
        )
        fault, fault_sample = loop.fault, loop.fault_sample
        log = record(run, log, number, robot, estimator, planned, loop)
        if number == settings.last or ended(run, fault):
            break
        robot = advance(run, robot, number, loop.cycle.command)
        if robot.diverged:
            if fault == NO_FAULT:
                fault, fault_sample = PLANT_DIVERGED, number
            break
    return conclude(run, log, robot, fault, fault_sample)


def law_functions(controller: Controller) -> dict[str, Callable[..., Any]]:
    """Return what the closed loop calls of a controller's laws, by the names under which it knows these functions."""
    nominal, constraint = controller.nominal, controller.constraint
    return {
        "nominal_step": nominal.step,
        "constraint_step": no_step if constraint is None else constraint.step,
        "nominal_after_gap": nominal.after_gap,
        "constraint_after_gap": unchanged if constraint is None else constraint.after_gap,
    }


def first_memory(
    controller: Controller, settings: CycleSettings, references: Callable[[], Sequence[Platform]]
) -> CycleMemory:
    """Return the memory of a controller before the first sample.

    Args:
        controller: whose memory.
        settings: constants of its cycle.
        references: returns those of all samples, for a law that needs the whole plan.
    """
    nominal, constraint = (
        None if law is None else law.first_memory(settings.robot, settings.mode, references, settings.period, numbers)
        for law, numbers in ((controller.nominal, settings.nominal), (controller.constraint, settings.constraint))
    )
    return CycleMemory(nominal, constraint, ZERO, 0, 0)


def cycle_settings_of(
    robot: FiveBar,
    mode: WorkingMode,
    rate_hz: int,
    tuned: TunedController,
    zone_time: float,
    limits: Limits,
    brake: Brake,
) -> CycleSettings:
    """Return the constants of the control cycle.

    Args:
        robot, mode: nominal robot and its working mode.
        rate_hz: sampling rate (Hz).
        tuned: controller.
        zone_time: for which sigma is meant to be 1 at a crossing (s).
        limits, brake: of the last node.
    """
    return CycleSettings(
        robot=with_floats(robot),
        mode=mode,
        period=1.0 / rate_hz,
        nominal=as_numbers(tuned.nominal.settings),
        constraint=None if tuned.constraint is None else as_numbers(tuned.constraint.settings),
        blended=tuned.controller.blended,
        weighted_in_time=tuned.controller.weighting == SIGMOID,
        zone_time=zone_time if tuned.controller.weighting == ESTIMATE else 0.0,
        limits=limits,
        brake=brake,
    )
