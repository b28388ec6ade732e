"""The closed loop from the first sample to the last, in the order of the offline runner; compiled as a whole."""

from __future__ import annotations

import math

import numpy as np

from fivebar_bringup.simulation.case import (
    AX,
    AY,
    DIRECTION_X,
    DIRECTION_Y,
    EPSILON,
    VX,
    VY,
    WEIGHT,
    FloatArray,
    Numbers,
    Sampled,
    X,
    Y,
)
from fivebar_bringup.simulation.outcome import (
    ESTIMATE_AMBIGUOUS,
    ESTIMATE_INCONSISTENT,
    ESTIMATE_LOST,
    LEFT,
    PLANT_DIVERGED,
    Outcome,
    TraceRow,
)
from fivebar_bringup.simulation.robot import ideal_later, ideal_sensed, ideal_start
from fivebar_control.estimation.readings import longest_gap, with_elbow, with_motors, with_rate, with_seen
from fivebar_control.estimation.step import estimator_step, first_update
from fivebar_control.laws.law import no_step, unchanged
from fivebar_control.laws.reference import Reference, against_disturbance, reference_from_platform
from fivebar_control.laws.torque import UNDEFINED, ZERO
from fivebar_control.laws.vhc_cartesian import line_constraint
from fivebar_control.loop.cycle import CycleMemory, CycleSettings, control_cycle
from fivebar_control.loop.plan_sample import PlanSample
from fivebar_control.model.geometry import inverse_geometry
from fivebar_control.model.kinematics import assembly_mode, det_a, state_from_joints
from fivebar_control.model.line import Line
from fivebar_control.model.singularity import type1_distance
from fivebar_control.model.state import Joints, Platform, State
from fivebar_control.safety.stages import NO_FAULT
from fivebar_control.trajectory.reference_row import reference_of
from fivebar_description.parameters import FiveBar
from fivebar_sim.imu import sensed_rate
from fivebar_sim.passive_encoder import passive_reading
from fivebar_sim.sensors import counted, drive_limit, encoder_resolution, shaped

nominal_step = constraint_step = no_step
nominal_after_gap = constraint_after_gap = unchanged
robot_start, robot_later, robot_sensed = ideal_start, ideal_later, ideal_sensed
"""The laws and the robot (`simulation/robot.py`) of :func:`run_loop`, to be replaced before it is compiled."""


def run_loop(first: CycleMemory, case: Numbers, sampled: Sampled, trace: FloatArray) -> Outcome:
    """Make a run.

    Args:
        first: memory before the first sample.
        case: the crossing.
        sampled: its plan.
        trace: float64[N + 1, len(TraceRow._fields)] to be filled, or [0, ...] for none.
    """
    control, estimating = case.control, case.estimation.on
    delay = case.equipment.delay_samples
    lead = delay if estimating else 0
    plan = sampled.rows
    state_is_exact = (
        not estimating
        and case.mechanism is None
        and encoder_resolution(case.equipment) == 0.0
        and same_lengths(control.robot, case.actual)
    )
    last = plan.shape[0] - 1 - lead
    period, resolution, limit = 1.0 / case.rate_hz, encoder_resolution(case.equipment), drive_limit(case.equipment)
    robot, actual, mechanism, mode1, mode2 = control.robot, case.actual, case.mechanism, control.mode1, control.mode2
    plant = robot_start(robot, actual, mode1, mode2, mechanism, plan[0, X], plan[0, Y])
    exact, seen = robot_sensed(mechanism, plant)
    readings = read(seen, exact, resolution, period, True) if resolution > 0.0 else seen
    measured = exact
    commands = np.zeros((delay + 1, 2))
    estimated_places = np.zeros((lead + 1, 2))
    applied1 = applied2 = 0.0
    kept, command = first, ZERO
    # the estimator is initialised in the assembly mode of the declared posture
    home = inverse_geometry(robot, mode1, mode2, plan[0, X], plan[0, Y])
    at_home = state_from_joints(robot, home.q11, home.q12, home.q21, home.q22, 0.0, 0.0, 0.0, 0.0)
    estimator = case.estimation.model
    memory = first_update(estimator, assembly_mode(at_home), readings.q11, readings.q21)
    rates = np.full(case.estimation.gyro_errors.shape[0], math.nan)
    turned, rate = exact.q21 + exact.q22, exact.dq21 + exact.dq22
    elbows = np.full(case.estimation.passive_made.shape[0], math.nan)
    frames = case.estimation.frames
    sights = np.zeros((last + 1 if frames.shape[0] > 0 else 0, 2))
    seen_frames = 0

    fault, fault_sample, left_sample = NO_FAULT, -1, -1
    samples = mode_changes = saturated = came = 0
    side = 0.0
    error_x = error_y = error_peak = error_final = constraint_error = 0.0
    requested1 = requested2 = peak1 = peak2 = work = sigma_max = estimate_error = misfit = loop_gap = 0.0
    sigma = kappa = 0.0
    requested = UNDEFINED
    type1_least = deviations_least = math.inf

    for number in range(last + 1):
        readings = read(seen, readings, resolution, period, number == 0) if resolution > 0.0 else seen
        present, trip = not case.missing[number], NO_FAULT
        measured_before = measured
        if present:
            measured = readings
        if estimating:
            # the watch for frozen encoders of `StateEstimator` is left out: no encoder of this plant freezes, and the
            # verdicts of earlier sweeps stay comparable
            if rates.shape[0] > 0:
                turned_before, turned = turned, exact.q21 + exact.q22
                mean = (turned - turned_before) / period
                rate = sensed_rate(case.estimation.gyro_keep, rate, mean, exact.dq21 + exact.dq22)
                rates[number] = rate + case.estimation.gyro_errors[number]
            if elbows.shape[0] > 0 and case.estimation.passive_made[number]:
                angle = exact.q12 if estimator.elbow == 1 else exact.q22
                elbows[number] = passive_reading(case.estimation.passive, angle)
            if frames.shape[0] > 0:
                exactly = state_of(case.actual, exact)
                sights[number, 0], sights[number, 1] = exactly.x, exactly.y
        if estimating and present:
            start = 1
            if number > 0:
                periods = min(number - came, longest_gap(case.rate_hz))
                memory = with_motors(memory, number, periods, readings.q11, readings.q21, applied1, applied2)
                start = memory.newest
                if rates.shape[0] > 0:
                    made = number - case.estimation.latency
                    if made >= 0 and not math.isnan(rates[made]):
                        start = min(
                            start, with_rate(estimator, memory, case.estimation.stamps[made], rates[made]).start
                        )
                if elbows.shape[0] > 0:
                    made = number - case.estimation.passive_latency
                    if made >= 0 and not math.isnan(elbows[made]):
                        placed = with_elbow(estimator, memory, float(made), elbows[made])
                        memory, start = placed.memory, min(start, placed.start)
                while seen_frames < frames.shape[0] and frames[seen_frames, 1] <= number:
                    exposed = int(frames[seen_frames, 0])
                    there_x = sights[exposed, 0] + frames[seen_frames, 2]
                    there_y = sights[exposed, 1] + frames[seen_frames, 3]
                    variance = case.estimation.seen_variance
                    begin = with_seen(estimator, memory, float(exposed), there_x, there_y, variance).start
                    start = min(start, begin)
                    seen_frames += 1
            estimated = estimator_step(estimator, memory, start, commands, number - delay).prediction
            memory = estimated.memory
            if estimated.lost:
                trip, measured = ESTIMATE_LOST, measured_before
            elif number - came > longest_gap(case.rate_hz):
                trip, measured = ESTIMATE_LOST, estimated.joints
            else:
                if estimated.ambiguity.ambiguous:
                    trip = ESTIMATE_AMBIGUOUS
                elif estimated.inconsistent:
                    trip = ESTIMATE_INCONSISTENT
                measured = estimated.joints
            deviations_least = min(deviations_least, estimated.ambiguity.deviations)
            misfit = max(misfit, memory.misfit.encoders, memory.misfit.gyro, memory.misfit.elbow)
        state = state_of(control.robot, measured)
        if present:
            if number - came > 1:
                kept = CycleMemory(
                    nominal=nominal_after_gap(kept.nominal),
                    constraint=constraint_after_gap(kept.constraint),
                    command=kept.command,
                    excess=kept.excess,
                    braking=kept.braking,
                )
            came = number
            moment = number + lead
            planned = planned_at(case, sampled, moment)
            reference = planned.reference
            if estimating and case.estimation.feed_forward:
                disturbance = memory.belief.estimate
                reference = against_disturbance(reference, disturbance.d1, disturbance.d2)
            if fault == NO_FAULT and trip != NO_FAULT:
                fault, fault_sample = trip, number
            latched = fault != NO_FAULT
            sound = trip == NO_FAULT
            cycle = control_cycle(
                nominal_step, constraint_step, control, kept, state, reference, planned, latched, sound
            )
            kept, command, sigma, kappa = cycle.memory, cycle.command, cycle.sigma, cycle.kappa
            requested = UNDEFINED if latched else cycle.requested
            if cycle.fault != NO_FAULT:
                fault, fault_sample = cycle.fault, number

        # metrics of the actual robot
        truth = state if state_is_exact and present else state_of(case.actual, exact)
        off_x, off_y = truth.x - plan[number, X], truth.y - plan[number, Y]
        error_x, error_y = largest(error_x, off_x), largest(error_y, off_y)
        error_final = math.sqrt(off_x * off_x + off_y * off_y)
        error_peak = max(error_peak, error_final)
        if left_sample < 0 and not error_final <= LEFT:
            left_sample = number
        determinant = det_a(truth)
        if determinant * side < 0.0:
            mode_changes += 1
        if determinant != 0.0:
            side = determinant
        if sigma > 0.0:
            here = Line(plan[number, X], plan[number, Y], plan[number, DIRECTION_X], plan[number, DIRECTION_Y])
            h = line_constraint(here, truth.x, truth.y, truth.vx, truth.vy).h
            constraint_error = largest(constraint_error, h)
        sigma_max = max(sigma_max, sigma)
        type1_least = min(type1_least, type1_distance(case.actual, truth))
        requested1, requested2 = largest(requested1, requested.tau1), largest(requested2, requested.tau2)
        if abs(requested.tau1) > control.limits.torque_limit or abs(requested.tau2) > control.limits.torque_limit:
            saturated += 1
        if estimating:
            estimated_places[number % (lead + 1), 0], estimated_places[number % (lead + 1), 1] = state.x, state.y
            if number >= lead and not case.missing[number - lead]:
                then = (number - lead) % (lead + 1)
                estimate_error = max(
                    estimate_error, math.hypot(estimated_places[then, 0] - truth.x, estimated_places[then, 1] - truth.y)
                )
        samples += 1
        if trace.shape[0] > 0:
            row = TraceRow(
                q11=exact.q11,
                q12=exact.q12,
                q21=exact.q21,
                q22=exact.q22,
                dq11=exact.dq11,
                dq12=exact.dq12,
                dq21=exact.dq21,
                dq22=exact.dq22,
                estimated_x=state.x,
                estimated_y=state.y,
                estimated_vx=state.vx,
                estimated_vy=state.vy,
                sigma=sigma,
                kappa=kappa,
                requested1=requested.tau1,
                requested2=requested.tau2,
                command1=command.tau1,
                command2=command.tau2,
                applied1=applied1,
                applied2=applied2,
            )
            for column, value in enumerate(row):
                trace[number, column] = value
        if case.stop_at_fault and fault != NO_FAULT:
            break
        if number == last:
            break

        commands[number % (delay + 1), 0], commands[number % (delay + 1), 1] = command.tau1, command.tau2
        waiting = (number + 1) % (delay + 1)
        if number < delay or not case.lost[number - delay]:
            applied1 = shaped(commands[waiting, 0], case.equipment.torque_quantum, limit)
            applied2 = shaped(commands[waiting, 1], case.equipment.torque_quantum, limit)
        peak1, peak2 = max(peak1, abs(applied1)), max(peak2, abs(applied2))
        after = robot_later(actual, mechanism, case.steps, case.step, plant, number, applied1, applied2)
        if math.isinf(after.gap):
            if fault == NO_FAULT:
                fault, fault_sample = PLANT_DIVERGED, number
            break
        plant = after.state
        loop_gap = max(loop_gap, after.gap)
        now, seen = robot_sensed(mechanism, plant)
        work += abs(applied1 * (now.q11 - exact.q11)) + abs(applied2 * (now.q21 - exact.q21))
        exact = now

    return Outcome(
        samples=samples,
        fault=fault,
        fault_sample=fault_sample,
        mode_changes=mode_changes,
        error_x=error_x,
        error_y=error_y,
        error_peak=error_peak,
        error_final=error_final,
        left_sample=left_sample,
        constraint_error=constraint_error,
        requested1=requested1,
        requested2=requested2,
        applied1=peak1,
        applied2=peak2,
        saturated=saturated,
        work=work,
        sigma_max=sigma_max,
        type1_distance=type1_least,
        estimate_error=estimate_error,
        mirror_deviations=deviations_least,
        misfit=misfit,
        loop_gap=loop_gap,
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


def planned_at(case: Numbers, sampled: Sampled, moment: int) -> PlanSample:
    """Return the plan at the moment of a sample."""
    row = sampled.rows[moment]
    platform = Platform(row[X], row[Y], row[VX], row[VY], row[AX], row[AY])
    return PlanSample(
        reference=reference_at(case.control, sampled, moment, platform),
        platform=platform,
        direction_x=row[DIRECTION_X],
        direction_y=row[DIRECTION_Y],
        epsilon=row[EPSILON],
        time_weight=row[WEIGHT],
        ahead=None,
    )


def reference_at(control: CycleSettings, sampled: Sampled, moment: int, platform: Platform) -> Reference:
    """Return the desired instant of a sample for its platform reference."""
    if sampled.references.shape[0] == 0:
        return reference_from_platform(control.robot, control.mode1, control.mode2, platform)
    return reference_of(sampled.references[moment])


def read(exact: Joints, before: Joints, resolution: float, period: float, first: bool) -> Joints:
    """Return the encoder readings: counts of `resolution` (rad) and their differences, as `sensors.Encoder` does."""
    q11, q12 = counted(exact.q11, resolution), counted(exact.q12, resolution)
    q21, q22 = counted(exact.q21, resolution), counted(exact.q22, resolution)
    if first:
        return Joints(q11, q12, q21, q22, 0.0, 0.0, 0.0, 0.0)
    return Joints(
        q11,
        q12,
        q21,
        q22,
        (q11 - before.q11) / period,
        (q12 - before.q12) / period,
        (q21 - before.q21) / period,
        (q22 - before.q22) / period,
    )


def state_of(robot: FiveBar, joints: Joints) -> State:
    """Return the state that follows from joints."""
    return state_from_joints(
        robot,
        joints.q11,
        joints.q12,
        joints.q21,
        joints.q22,
        joints.dq11,
        joints.dq12,
        joints.dq21,
        joints.dq22,
    )
