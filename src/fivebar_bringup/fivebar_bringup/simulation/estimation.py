"""The estimator in lockstep: every sample has a reading, and every command is known, as in `StateEstimator.take`."""

from __future__ import annotations

import math
from typing import NamedTuple

from fivebar_bringup.simulation.case import FloatArray, Numbers
from fivebar_bringup.simulation.outcome import ESTIMATE_AMBIGUOUS, ESTIMATE_LOST
from fivebar_control.estimation.ekf import Belief, advanced, corrected, homed_belief, motor_speeds, predicted
from fivebar_control.estimation.encoder import first_angle, next_angle, next_stay
from fivebar_control.estimation.mirror import look_at
from fivebar_control.model.geometry import direct_geometry
from fivebar_control.model.kinematics import state_from_platform
from fivebar_control.model.state import State
from fivebar_control.safety.stages import NO_FAULT
from fivebar_sim.sensors import drive_limit, encoder_resolution, shaped


class Memory(NamedTuple):
    """What the estimator keeps from sample to sample: belief, last readings (rad) and stays, samples near the locus."""

    belief: Belief
    last1: float
    last2: float
    stay1: int
    stay2: int
    near: int


class Joints(NamedTuple):
    """What the controllers are told: rad and rad/s, in the order of `joint_states`."""

    q11: float
    q12: float
    q21: float
    q22: float
    dq11: float
    dq12: float
    dq21: float
    dq22: float


class Estimated(NamedTuple):
    """The answer to a sample: joints, a fault or `NO_FAULT`, standard deviations to the other assembly mode."""

    memory: Memory
    joints: Joints
    fault: int
    deviations: float


def begun(case: Numbers, assembly: int, q11: float, q21: float) -> Memory:
    """Return the memory after the first readings (rad) of a robot at rest in the assembly mode."""
    model, count = case.estimation.model, encoder_resolution(case.equipment)
    one, two = first_angle(count, q11), first_angle(count, q21)
    x, y = direct_geometry(model.robot, assembly, one.value, two.value)
    return Memory(homed_belief(model, x, y, one.variance), q11, q21, 1, 1, 0)


def followed(case: Numbers, memory: Memory, q11: float, q21: float, tau1: float, tau2: float) -> Memory:
    """Return the memory after the next readings (rad), under the torques (Nm) applied before them."""
    model, count = case.estimation.model, encoder_resolution(case.equipment)
    expected = predicted(model, memory.belief, tau1, tau2)
    speed1, speed2 = motor_speeds(model, expected.estimate)
    stay1, stay2 = next_stay(memory.last1, memory.stay1, q11), next_stay(memory.last2, memory.stay2, q21)
    belief = corrected(
        model,
        expected,
        next_angle(count, case.rate_hz, memory.last1, stay1, q11, speed1),
        next_angle(count, case.rate_hz, memory.last2, stay2, q21, speed2),
    )
    return Memory(belief, q11, q21, stay1, stay2, memory.near)


def told(case: Numbers, memory: Memory, before: Joints, commands: FloatArray, sample: int) -> Estimated:
    """Return what is published for a sample.

    Args:
        case: the case.
        memory: after this sample's readings.
        before: the joints published last, which stay where the estimate is lost.
        commands: float64[delay + 1, 2], the commands of the last samples, each in row `sample % (delay + 1)`.
        sample: number of the sample.
    """
    model, drives = case.estimation.model, case.equipment
    limit, estimate = drive_limit(drives), memory.belief.estimate
    for number in range(sample - drives.delay_samples, sample):
        row = number % (drives.delay_samples + 1)
        tau1 = shaped(commands[row, 0], 0.0, limit)
        tau2 = shaped(commands[row, 1], 0.0, limit)
        estimate = advanced(model, estimate, tau1, tau2)
    mode1, mode2 = case.control.mode1, case.control.mode2
    state = state_from_platform(model.robot, mode1, mode2, estimate.x, estimate.y, estimate.vx, estimate.vy)
    joints = joints_of(state)
    if not math.isfinite(joints.dq11 + joints.dq12 + joints.dq21 + joints.dq22):
        return Estimated(memory, before, ESTIMATE_LOST, math.inf)
    look = look_at(model, case.estimation.dwell_limit, memory.near, memory.belief)
    memory = Memory(memory.belief, memory.last1, memory.last2, memory.stay1, memory.stay2, look.near)
    dwelt = look.near * model.period > case.estimation.dwell_limit
    ambiguous = dwelt or not look.deviations >= case.estimation.mirror_deviations
    return Estimated(memory, joints, ESTIMATE_AMBIGUOUS if ambiguous else NO_FAULT, look.deviations)


def joints_of(state: State) -> Joints:
    """Return a state's joints."""
    leg1, leg2 = state.leg1, state.leg2
    return Joints(
        leg1.q1,
        leg1.q2,
        leg2.q1,
        leg2.q2,
        leg1.dq1,
        leg1.dtheta - leg1.dq1,
        leg2.dq1,
        leg2.dtheta - leg2.dq1,
    )
