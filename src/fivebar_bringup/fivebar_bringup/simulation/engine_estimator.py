# SPDX-License-Identifier: Apache-2.0
"""The state of the robot as controllers know it in the engine's loop: measured, or estimated as `StateEstimator`
does."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from fivebar_bringup.simulation.case import EngineRun, FloatArray
from fivebar_bringup.simulation.engine_robot import Robot
from fivebar_control.estimation.frozen import FrozenMemory, nothing_read
from fivebar_control.estimation.readings import EstimatorMemory, longest_gap, with_readings
from fivebar_control.estimation.step import estimator_step, first_update
from fivebar_control.estimation.trips import ESTIMATE_LOST
from fivebar_control.loop.sampled_plan import X, Y
from fivebar_control.model.geometry import inverse_geometry
from fivebar_control.model.kinematics import assembly_mode, state_from_joints
from fivebar_control.model.state import Joints, State
from fivebar_control.safety.stages import NO_FAULT
from fivebar_description.parameters import FiveBar
from fivebar_sim.sensors import passive_reading, sensed_rate


class LateReadings(NamedTuple):
    """Readings of the late sensors, one for each sample at which they are made; the arrays are changed in place.

    Attributes:
        rates: float64[N + 1, 2], of the gyroscope: moment of the stamp in samples, and rate (rad/s), NaN for none; [0,
            2] without a gyroscope.
        elbows: float64[N + 1, 2], of the passive joint's encoder: moment and angle (rad), NaN for none; [0, 2] without.
        sights: float64[N + 1, 2], where the platform is (m); [0, 2] without a camera.
        fixes: float64[n, 4], the camera's positions by arrival: moment, x, y and deviation (m).
        turned: angle (rad) of the link that carries the gyroscope.
        rate: what the gyroscope senses of its rate (rad/s), without errors.
        reading: its last reading (rad/s), also of samples at which none is made.
    """

    rates: FloatArray
    elbows: FloatArray
    sights: FloatArray
    fixes: FloatArray
    turned: float
    rate: float
    reading: float


class EngineKnown(NamedTuple):
    """The knowledge of the robot at a sample: see `closed_loop.Known`, and the estimator's own.

    Attributes:
        memory: of the filter.
        frozen: what the watch for frozen encoders has seen.
        joints: estimated.
        came: the last sample that reached the controllers.
        seen_frames: how many of the camera's positions have come.
        deviations: standard deviations between the estimate and the other assembly mode.
        late: what the late sensors have read so far.
    """

    present: bool
    state: State
    d1: float
    d2: float
    trip: int
    memory: EstimatorMemory
    frozen: FrozenMemory
    joints: Joints
    came: int
    seen_frames: int
    deviations: float
    late: LateReadings


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


def unestimated(run: EngineRun, robot: Robot) -> EngineKnown:
    """Return what is known before the first sample: the assembly mode of the declared posture, for an estimator."""
    estimation, control, plan = run.case.estimation, run.case.control, run.plan.rows
    home = inverse_geometry(control.robot, control.mode1, control.mode2, plan[0, X], plan[0, Y])
    at_home = state_from_joints(control.robot, home.q11, home.q12, home.q21, home.q22, 0.0, 0.0, 0.0, 0.0)
    exact, frames = robot.exact, estimation.frames.shape[0]
    late = LateReadings(
        rates=np.full((estimation.gyro_errors.shape[0], 2), math.nan),
        elbows=np.full((estimation.passive_made.shape[0], 2), math.nan),
        sights=np.zeros((plan.shape[0] if frames > 0 else 0, 2)),
        fixes=np.zeros((frames, 4)),
        turned=exact.q21 + exact.q22,
        rate=exact.dq21 + exact.dq22,
        reading=0.0,
    )
    memory = first_update(estimation.model, assembly_mode(at_home), robot.readings.q11, robot.readings.q21)
    return EngineKnown(True, at_home, 0.0, 0.0, NO_FAULT, memory, nothing_read(), exact, 0, 0, math.inf, late)


class MeasuredKnown(NamedTuple):
    """The knowledge of a robot without an estimator at a sample: see `closed_loop.Known`, and the joints measured."""

    present: bool
    state: State
    d1: float
    d2: float
    trip: int
    joints: Joints


def unmeasured(run: EngineRun, robot: Robot) -> MeasuredKnown:
    """Return what is known before the first sample."""
    return MeasuredKnown(True, state_of(run.case.control.robot, robot.readings), 0.0, 0.0, NO_FAULT, robot.readings)


def measured(run: EngineRun, before: MeasuredKnown, robot: Robot, number: int) -> MeasuredKnown:
    """Return what is known after the readings of a sample."""
    present = not run.case.missing[number]
    joints = robot.readings if present else before.joints
    return MeasuredKnown(present, state_of(run.case.control.robot, joints), 0.0, 0.0, NO_FAULT, joints)


def estimated(run: EngineRun, before: EngineKnown, robot: Robot, number: int) -> EngineKnown:
    """Return what is known after the readings of a sample."""
    case = run.case
    present = not case.missing[number]
    came = number if present else before.came
    estimation = case.estimation
    late = with_late_readings(run, before.late, robot, number)
    memory, joints, trip, seen_frames = before.memory, before.joints, NO_FAULT, before.seen_frames
    deviations, frozen, delay = before.deviations, before.frozen, case.equipment.delay_samples
    if present:
        start, coasts = 1, False
        if number > 0:
            # the command that answered the sample before
            newest = (number - 1) % (delay + 1)
            coasts = robot.commands[newest, 0] == 0.0 and robot.commands[newest, 1] == 0.0
            while seen_frames < estimation.frames.shape[0] and estimation.frames[seen_frames, 1] <= number:
                seen_frames += 1
            placed = with_readings(
                estimation.model,
                memory,
                number,
                min(number - before.came, longest_gap(case.rate_hz)),
                robot.readings.q11,
                robot.readings.q21,
                robot.applied1,
                robot.applied2,
                arrived(late.rates, number - estimation.latency),
                arrived(late.elbows, number - estimation.passive_latency),
                fixes_among(run, late, before.seen_frames, seen_frames),
            )
            memory, start = placed.memory, placed.start
        stepped = estimator_step(estimation.model, memory, frozen, start, robot.commands, number - delay, coasts)
        result, frozen = stepped.prediction, stepped.frozen
        memory, deviations = result.memory, result.ambiguity.deviations
        trip = result.trip
        if not result.lost:
            joints = result.joints
            if number - before.came > longest_gap(case.rate_hz):
                trip = ESTIMATE_LOST
    return EngineKnown(
        present=present,
        state=state_of(case.control.robot, joints),
        d1=memory.belief.estimate.d1,
        d2=memory.belief.estimate.d2,
        trip=trip,
        memory=memory,
        frozen=frozen,
        joints=joints,
        came=came,
        seen_frames=seen_frames,
        deviations=deviations,
        late=late,
    )


def with_late_readings(run: EngineRun, late: LateReadings, robot: Robot, number: int) -> LateReadings:
    """Return the late sensors after what they read at a sample."""
    estimation, exact = run.case.estimation, robot.exact
    turned, rate, reading = late.turned, late.rate, late.reading
    if late.rates.shape[0] > 0:
        turned = exact.q21 + exact.q22
        mean = (turned - late.turned) / (1.0 / run.case.rate_hz)
        rate = sensed_rate(estimation.gyro_keep, late.rate, mean, exact.dq21 + exact.dq22)
        if not estimation.gyro_frozen.first <= number < estimation.gyro_frozen.end:
            reading = estimation.gyro_gain * rate + estimation.gyro_errors[number]
        if estimation.gyro_made[number]:
            at_end = abs(reading) >= estimation.gyro_limit
            late.rates[number, 0] = estimation.stamps[number]
            late.rates[number, 1] = math.inf if at_end else reading
    if late.elbows.shape[0] > 0 and estimation.passive_made[number]:
        angle = exact.q12 if estimation.model.elbow == 1 else exact.q22
        late.elbows[number, 0], late.elbows[number, 1] = float(number), passive_reading(estimation.passive, angle)
    if late.sights.shape[0] > 0:
        there = state_of(run.case.actual, exact)
        late.sights[number, 0], late.sights[number, 1] = there.x, there.y
    return LateReadings(late.rates, late.elbows, late.sights, late.fixes, turned, rate, reading)


def arrived(readings: FloatArray, made: int) -> FloatArray:
    """Return the reading that was made at a sample, float64[1, 2], or none, [0, 2]."""
    if made < 0 or made >= readings.shape[0] or math.isnan(readings[made, 1]):
        return readings[:0]
    return readings[made : made + 1]


def fixes_among(run: EngineRun, late: LateReadings, first: int, last: int) -> FloatArray:
    """Return the camera's positions from one, by arrival, up to before another, float64[n, 4]."""
    for one in range(first, last):
        frame = run.case.estimation.frames[one]
        exposed = int(frame[0])
        late.fixes[one, 0] = float(exposed)
        late.fixes[one, 1] = late.sights[exposed, 0] + frame[2]
        late.fixes[one, 2] = late.sights[exposed, 1] + frame[3]
        late.fixes[one, 3] = run.case.estimation.seen_deviation
    return late.fixes[first:last]
