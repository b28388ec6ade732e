# SPDX-License-Identifier: Apache-2.0
"""The state of the robot as controllers know it in the engine's loop: measured, or estimated as `StateEstimator`
does."""

from __future__ import annotations

import math
from typing import NamedTuple

from fivebar_bringup.simulation.case import EngineRun
from fivebar_bringup.simulation.engine_robot import Robot
from fivebar_bringup.simulation.engine_sensors import LateState, arrived, sensed, unsensed
from fivebar_control.estimation.fault_numbers import ESTIMATE_LOST
from fivebar_control.estimation.frozen import FrozenMemory, nothing_read
from fivebar_control.estimation.late_sensors import with_readings
from fivebar_control.estimation.readings import EstimatorMemory, longest_gap
from fivebar_control.estimation.step import estimator_step, first_update
from fivebar_control.loop.sampled_plan import X, Y
from fivebar_control.model.geometry import inverse_geometry
from fivebar_control.model.kinematics import assembly_mode, state_from_joints
from fivebar_control.model.state import Joints, State
from fivebar_control.safety.stages import NO_FAULT
from fivebar_description.parameters import FiveBar


class EngineKnown(NamedTuple):
    """The knowledge of the robot at a sample: see `closed_loop.Known`, and the estimator's own.

    Attributes:
        memory: of the filter.
        frozen: what the watch for frozen encoders has seen.
        joints: estimated.
        came: the last sample that reached the controllers.
        deviations: standard deviations between the estimate and the other assembly mode.
        late: what the late sensors have sensed so far.
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
    deviations: float
    late: LateState


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
    home = inverse_geometry(control.robot, control.mode, plan[0, X], plan[0, Y])
    at_home = state_from_joints(control.robot, home.q11, home.q12, home.q21, home.q22, 0.0, 0.0, 0.0, 0.0)
    late = unsensed(estimation.sensors, robot.exact, plan.shape[0])
    memory = first_update(estimation.model, assembly_mode(at_home), robot.readings.q11, robot.readings.q21)
    return EngineKnown(True, at_home, 0.0, 0.0, NO_FAULT, memory, nothing_read(), robot.exact, 0, math.inf, late)


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
    late = sensed(estimation.sensors, before.late, case.actual, robot.exact, number, 1.0 / case.rate_hz)
    memory, joints, trip = before.memory, before.joints, NO_FAULT
    deviations, frozen, delay = before.deviations, before.frozen, case.equipment.delay_samples
    if present:
        start, coasts = 1, False
        if number > 0:
            # the command that answered the sample before
            newest = (number - 1) % (delay + 1)
            coasts = robot.commands[newest, 0] == 0.0 and robot.commands[newest, 1] == 0.0
            came_late = arrived(estimation.sensors, late, number)
            late = came_late.sensed
            placed = with_readings(
                estimation.model,
                memory,
                number,
                min(number - before.came, longest_gap(case.rate_hz)),
                robot.readings.q11,
                robot.readings.q21,
                robot.applied1,
                robot.applied2,
                came_late.readings,
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
        deviations=deviations,
        late=late,
    )
