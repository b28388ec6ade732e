# SPDX-License-Identifier: Apache-2.0
"""The robot in the engine's loop: mechanism, encoders and drives, in scalars."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from fivebar_bringup.simulation.case import EngineRun, FloatArray
from fivebar_bringup.simulation.robot import (
    Sensed,
    ideal_later,
    ideal_sensed,
    ideal_start,
    later_with_effects,
    sensed_with_effects,
    start_with_effects,
)
from fivebar_control.laws.torque import Torque
from fivebar_control.loop.sampled_plan import X, Y
from fivebar_control.model.state import Joints
from fivebar_sim.sensors import counted, drive_limit, encoder_resolution, shaped


class Robot(NamedTuple):
    """The robot at a sample.

    Attributes:
        plant: state of its mechanism.
        exact: joints.
        readings: what encoders on all joints read.
        commands: float64[delay + 1, 2], the last commands (Nm), that of sample k in row `k % (delay + 1)`; changed in
            place.
        applied1, applied2: torques (Nm) over the period before.
        gap: the loop's gap (m) that this period opened, before it was closed.
        diverged: whether the robot could be moved no further, and is where it was.
    """

    plant: Any
    exact: Joints
    readings: Joints
    commands: FloatArray
    applied1: float
    applied2: float
    gap: float
    diverged: bool


def started(run: EngineRun, start: Callable[..., Any], sensed: Callable[..., Sensed]) -> Robot:
    """Return the robot at rest at the start of the plan.

    Args:
        run: of the engine.
        start, sensed: of `simulation/robot.py`.
    """
    case, plan = run.case, run.plan.rows
    control, delay = case.control, case.equipment.delay_samples
    plant = start(control.robot, case.actual, control.mode, case.mechanism, plan[0, X], plan[0, Y])
    exact, seen = sensed(case.mechanism, plant)
    resolution = encoder_resolution(case.equipment)
    return Robot(plant, exact, read(seen, seen, resolution, 1.0, True), np.zeros((delay + 1, 2)), 0.0, 0.0, 0.0, False)


def started_ideal(run: EngineRun) -> Robot:
    """Return the rigid robot."""
    return started(run, ideal_start, ideal_sensed)


def started_with_effects(run: EngineRun) -> Robot:
    """Return the robot with effects."""
    return started(run, start_with_effects, sensed_with_effects)


def read(seen: Joints, before: Joints, resolution: float, period: float, first: bool) -> Joints:
    """Return what encoders on all joints read of what they see: counts of `resolution` (rad) and their differences."""
    if resolution == 0.0:
        return seen
    q11, q12 = counted(seen.q11, resolution), counted(seen.q12, resolution)
    q21, q22 = counted(seen.q21, resolution), counted(seen.q22, resolution)
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


def moved(
    run: EngineRun,
    robot: Robot,
    number: int,
    command: Torque,
    later: Callable[..., Any],
    sensed: Callable[..., Sensed],
) -> Robot:
    """Return the robot one sample later, under the command that answers a sample.

    Args:
        run: of the engine.
        robot: at that sample.
        number: of the sample.
        command: torque (Nm).
        later, sensed: of `simulation/robot.py`.
    """
    case, commands = run.case, robot.commands
    delay, limit, quantum = case.equipment.delay_samples, drive_limit(case.equipment), case.equipment.torque_quantum
    commands[number % (delay + 1), 0], commands[number % (delay + 1), 1] = command.tau1, command.tau2
    waiting = (number + 1) % (delay + 1)
    applied = Torque(robot.applied1, robot.applied2)
    if number < delay or not case.lost[number - delay]:
        applied = Torque(shaped(commands[waiting, 0], quantum, limit), shaped(commands[waiting, 1], quantum, limit))
    after = later(case.actual, case.mechanism, case.steps, case.step, robot.plant, number, applied)
    if math.isinf(after.gap):
        return Robot(robot.plant, robot.exact, robot.readings, commands, applied.tau1, applied.tau2, 0.0, True)
    exact, seen = sensed(case.mechanism, after.state)
    readings = read(seen, robot.readings, encoder_resolution(case.equipment), 1.0 / case.rate_hz, False)
    return Robot(after.state, exact, readings, commands, applied.tau1, applied.tau2, after.gap, False)


def moved_ideal(run: EngineRun, robot: Robot, number: int, command: Torque) -> Robot:
    """Return the rigid robot one sample later."""
    return moved(run, robot, number, command, ideal_later, ideal_sensed)


def moved_with_effects(run: EngineRun, robot: Robot, number: int, command: Torque) -> Robot:
    """Return the robot with effects one sample later."""
    return moved(run, robot, number, command, later_with_effects, sensed_with_effects)
