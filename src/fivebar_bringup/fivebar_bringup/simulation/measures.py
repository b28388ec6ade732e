"""Metrics and trace of the engine's loop, sample by sample."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from fivebar_bringup.simulation.case import DIRECTION_X, DIRECTION_Y, BoolArray, EngineRun, FloatArray, X, Y
from fivebar_bringup.simulation.engine_estimator import EngineKnown, state_of
from fivebar_bringup.simulation.engine_robot import Robot
from fivebar_bringup.simulation.outcome import LEFT, Outcome, TraceRow
from fivebar_control.estimation.readings import largest_offset, strain
from fivebar_control.laws.torque import UNDEFINED, Torque
from fivebar_control.laws.vhc_cartesian import line_constraint
from fivebar_control.loop.cycle import Cycle
from fivebar_control.loop.plan_sample import PlanSample
from fivebar_control.model.kinematics import det_a
from fivebar_control.model.line import Line
from fivebar_control.model.singularity import type1_distance
from fivebar_control.model.state import State
from fivebar_control.safety.stages import NO_FAULT
from fivebar_control.trajectory.path_distance import path_place
from fivebar_description.parameters import FiveBar
from fivebar_sim.sensors import encoder_resolution


class EngineLog(NamedTuple):
    """Metrics of a run so far.

    Attributes:
        outcome: the metrics; its fault is that of the end.
        side: last det A beside the locus.
        places: float64[lead + 1, 2], estimated platform (m) of the last samples; changed in place.
        state_is_exact: whether what is measured is the actual robot.
        line: of the path to which the platform was nearest.
    """

    outcome: Outcome
    side: float
    places: FloatArray
    state_is_exact: bool
    line: int


def unmeasured(run: EngineRun) -> EngineLog:
    """Return the metrics before the first sample."""
    case = run.case
    state_is_exact = (
        not case.estimation.on
        and case.mechanism is None
        and encoder_resolution(case.equipment) == 0.0
        and same_lengths(case.control.robot, case.actual)
    )
    outcome = Outcome(
        samples=0,
        fault=NO_FAULT,
        fault_sample=-1,
        mode_changes=0,
        error_x=0.0,
        error_y=0.0,
        error_peak=0.0,
        error_final=0.0,
        left_sample=-1,
        path_error=0.0,
        constraint_error=0.0,
        requested1=0.0,
        requested2=0.0,
        applied1=0.0,
        applied2=0.0,
        saturated=0,
        work=0.0,
        sigma_max=0.0,
        type1_distance=math.inf,
        estimate_error=0.0,
        mirror_deviations=math.inf,
        misfit=0.0,
        misfit_offset=0.0,
        misfit_jump=0.0,
        misfit_error=0.0,
        misfit_strain=0.0,
        loop_gap=0.0,
    )
    return EngineLog(outcome, 0.0, np.zeros((case.lead + 1, 2)), state_is_exact, 0)


def recorded(
    run: EngineRun,
    log: EngineLog,
    number: int,
    robot: Robot,
    known: EngineKnown,
    planned: PlanSample,
    cycle: Cycle,
    latched: bool,
) -> EngineLog:
    """Return the metrics with a sample, and fill its row of the trace."""
    case, plan, before, state = run.case, run.plan.rows, log.outcome, known.state
    requested = UNDEFINED if latched else cycle.requested
    truth = state if log.state_is_exact and known.present else state_of(case.actual, robot.exact)
    off_x, off_y = truth.x - plan[number, X], truth.y - plan[number, Y]
    distance = math.sqrt(off_x * off_x + off_y * off_y)
    nearest = path_place(plan, log.line, number, truth.x, truth.y)
    left_sample = number if before.left_sample < 0 and not distance <= LEFT else before.left_sample
    determinant = det_a(truth)
    mode_changes = before.mode_changes + (1 if determinant * log.side < 0.0 else 0)
    side = determinant if determinant != 0.0 else log.side
    off_path = 0.0
    if cycle.sigma > 0.0:
        here = Line(plan[number, X], plan[number, Y], plan[number, DIRECTION_X], plan[number, DIRECTION_Y])
        off_path = line_constraint(here, truth.x, truth.y, truth.vx, truth.vy).h
    limit = case.control.limits.torque_limit
    saturated = before.saturated + (1 if abs(requested.tau1) > limit or abs(requested.tau2) > limit else 0)
    misfit, estimate_error = before.misfit, before.estimate_error
    offset, jump, error = before.misfit_offset, before.misfit_jump, before.misfit_error
    strained = before.misfit_strain
    if case.estimation.on:
        misfit = max(misfit, known.memory.misfit.encoders, known.memory.misfit.gyro, known.memory.misfit.elbow)
        offset = max(offset, largest_offset(known.memory.pattern))
        jump = max(jump, known.memory.pattern.jump)
        error = max(error, known.memory.pattern.error)
        strained = max(strained, strain(case.estimation.model, known.memory.pattern))
        estimate_error = max(estimate_error, error_of_estimate(log.places, case.missing, number, truth, state))
    outcome = Outcome(
        samples=before.samples + 1,
        fault=NO_FAULT,
        fault_sample=-1,
        mode_changes=mode_changes,
        error_x=largest(before.error_x, off_x),
        error_y=largest(before.error_y, off_y),
        error_peak=max(before.error_peak, distance),
        error_final=distance,
        left_sample=left_sample,
        path_error=largest(before.path_error, nearest.distance),
        constraint_error=largest(before.constraint_error, off_path),
        requested1=largest(before.requested1, requested.tau1),
        requested2=largest(before.requested2, requested.tau2),
        applied1=max(before.applied1, abs(robot.applied1)),
        applied2=max(before.applied2, abs(robot.applied2)),
        saturated=saturated,
        work=before.work + robot.work,
        sigma_max=max(before.sigma_max, cycle.sigma),
        type1_distance=min(before.type1_distance, type1_distance(case.actual, truth)),
        estimate_error=estimate_error,
        mirror_deviations=min(before.mirror_deviations, known.deviations),
        misfit=misfit,
        misfit_offset=offset,
        misfit_jump=jump,
        misfit_error=error,
        misfit_strain=strained,
        loop_gap=max(before.loop_gap, robot.gap),
    )
    if run.trace.shape[0] > 0:
        fill_trace(run.trace, number, robot, known, cycle, requested)
    return EngineLog(outcome, side, log.places, log.state_is_exact, nearest.line)


def error_of_estimate(places: FloatArray, missing: BoolArray, number: int, truth: State, estimated: State) -> float:
    """Return the distance (m) of the platform from where it was estimated for this sample, 0 where it was not.

    Args:
        places: where the platform was estimated for the last samples, see `EngineLog`; gets that of this sample.
        missing: samples that did not reach the estimator.
        number: of the sample.
        truth: of the robot.
        estimated: at the sample, for the lead later.
    """
    lead = places.shape[0] - 1
    places[number % (lead + 1), 0], places[number % (lead + 1), 1] = estimated.x, estimated.y
    if number < lead or missing[number - lead]:
        return 0.0
    then = (number - lead) % (lead + 1)
    return math.hypot(places[then, 0] - truth.x, places[then, 1] - truth.y)


def fill_trace(
    trace: FloatArray, number: int, robot: Robot, known: EngineKnown, cycle: Cycle, requested: Torque
) -> None:
    """Fill a sample's row of the trace."""
    row = TraceRow(
        q11=robot.exact.q11,
        q12=robot.exact.q12,
        q21=robot.exact.q21,
        q22=robot.exact.q22,
        dq11=robot.exact.dq11,
        dq12=robot.exact.dq12,
        dq21=robot.exact.dq21,
        dq22=robot.exact.dq22,
        estimated_x=known.state.x,
        estimated_y=known.state.y,
        estimated_vx=known.state.vx,
        estimated_vy=known.state.vy,
        sigma=cycle.sigma,
        kappa=cycle.kappa,
        requested1=requested.tau1,
        requested2=requested.tau2,
        command1=cycle.command.tau1,
        command2=cycle.command.tau2,
        applied1=robot.applied1,
        applied2=robot.applied2,
        read1=robot.readings.q11,
        read2=robot.readings.q21,
    )
    for column, value in enumerate(row):
        trace[number, column] = value


def ends(run: EngineRun, fault: int) -> bool:
    """Return whether the run ends with a sample."""
    return fault != NO_FAULT and run.case.stop_at_fault


def concluded(run: EngineRun, log: EngineLog, robot: Robot, fault: int, fault_sample: int) -> Outcome:
    """Return the metrics of the whole run."""
    one = log.outcome
    return Outcome(
        samples=one.samples,
        fault=fault,
        fault_sample=fault_sample,
        mode_changes=one.mode_changes,
        error_x=one.error_x,
        error_y=one.error_y,
        error_peak=one.error_peak,
        error_final=one.error_final,
        left_sample=one.left_sample,
        path_error=one.path_error,
        constraint_error=one.constraint_error,
        requested1=one.requested1,
        requested2=one.requested2,
        # also where the robot did not get through its last period
        applied1=max(one.applied1, abs(robot.applied1)),
        applied2=max(one.applied2, abs(robot.applied2)),
        saturated=one.saturated,
        work=one.work,
        sigma_max=one.sigma_max,
        type1_distance=one.type1_distance,
        estimate_error=one.estimate_error,
        mirror_deviations=one.mirror_deviations,
        misfit=one.misfit,
        misfit_offset=one.misfit_offset,
        misfit_jump=one.misfit_jump,
        misfit_error=one.misfit_error,
        misfit_strain=one.misfit_strain,
        loop_gap=one.loop_gap,
    )


def largest(so_far: float, value: float) -> float:
    """Return the larger magnitude, NaN left out."""
    return abs(value) if abs(value) > so_far else so_far


def same_lengths(one: FiveBar, other: FiveBar) -> bool:
    """Return whether two robots have the same geometry, so that equal joints mean equal platform positions."""
    return (
        one.leg1.base_x == other.leg1.base_x
        and one.leg1.proximal == other.leg1.proximal
        and one.leg1.distal == other.leg1.distal
        and one.leg2.base_x == other.leg2.base_x
        and one.leg2.proximal == other.leg2.proximal
        and one.leg2.distal == other.leg2.distal
    )
