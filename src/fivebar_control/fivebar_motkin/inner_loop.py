# SPDX-License-Identifier: Apache-2.0
"""The board's own position and speed control as a small inner loop besides the law's torque.

The board closes i = i_ff + kp (q* - q) + kd (v* - v) at its own rate. Away from the Type 2 locus that adds a joint
stiffness and a damping to the law. On the locus they would fight the constraint, so that both are faded to zero there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from fivebar_control.hardware.configuration import MICROSECONDS
from fivebar_control.hardware.drive_interface import JointTarget
from fivebar_control.laws.blend import blending_weight
from fivebar_control.model.kinematics import assembly_mode, state_from_joints, state_from_platform, working_mode
from fivebar_control.model.singularity import inverse_condition
from fivebar_description.robot_file import load_robot
from fivebar_motkin.board_file import BoardDrive, BoardFile
from fivebar_motkin.board_units import current_limit

HALF_TURN_MARGIN = 0.5
"""Distance (rad) of an encoder's reading from half a turn, where it jumps by a whole one, below which there is no inner
loop; from twice that on it is whole."""


class MotorSetPoint(NamedTuple):
    """A set point for the board besides the current: gains in A/rad and A/(rad/s), targets in rad and rad/s."""

    kp: float
    kd: float
    angle: float
    speed: float


OPEN = MotorSetPoint(0.0, 0.0, 0.0, 0.0)
"""No inner loop."""


class BoardTargets:
    """Targets of the inner loop from the reference and the state of one sample."""

    def __init__(self, board: BoardFile) -> None:
        """Read the robot.

        Raises:
            InputError: the robot file is missing or wrong.
        """
        self._robot = load_robot(board.inner_loop.robot)
        self._epsilon = board.inner_loop.epsilon
        self._half_period = 0.5 * board.period_us / MICROSECONDS

    def target(
        self, reference: Sequence[float], position: Sequence[float], velocity: Sequence[float]
    ) -> JointTarget | None:
        """Return where the motors should be, and how much of the stiffness acts; None where none does.

        Args:
            reference: x, y (m), vx, vy (m/s) of the platform.
            position, velocity: q11, q12, q21, q22 (rad) and their rates (rad/s), measured or estimated.
        """
        state = state_from_joints(self._robot, *position, *velocity)
        desired = state_from_platform(self._robot, *working_mode(state), *reference)
        angles, speeds = (desired.leg1.q1, desired.leg2.q1), (desired.leg1.dq1, desired.leg2.dq1)
        kappa = min(inverse_condition(state), inverse_condition(desired))
        if not all(map(math.isfinite, (*angles, *speeds, kappa))) or assembly_mode(state) != assembly_mode(desired):
            return None
        weight = 1.0 - blending_weight(kappa, self._epsilon)
        if weight <= 0.0:
            return None
        # the target is held for a period, during which the reference moves on: take the middle
        q11, q21 = (angle + speed * self._half_period for angle, speed in zip(angles, speeds, strict=True))
        return JointTarget(weight, (q11, q21), speeds)


def set_point(
    board: BoardFile,
    drive: BoardDrive,
    current: float,
    weight: float,
    angle: tuple[float, float],
    speed: tuple[float, float],
) -> MotorSetPoint:
    """Return the board's set point, bounded so that the sum of all currents keeps the motor's limit.

    Stiffness and damping may each take half of the share of the limit, and together no more than the law has left.

    Args:
        board, drive: configuration.
        current: of the law's torque (A).
        weight: how much of stiffness and damping acts, from 0 to 1.
        angle: reading of the encoder and target (rad), as the board counts.
        speed: the board's filtered speed and the target (rad/s).
    """
    loop, limit = board.inner_loop, current_limit(drive)
    from_half_turn = (math.pi - abs(angle[0])) / HALF_TURN_MARGIN - 1.0
    scale = weight * max(0.0, min(1.0, from_half_turn))
    most = 0.5 * min(loop.share * limit, limit - abs(current))
    if scale <= 0.0 or most <= 0.0:
        return OPEN
    kp, kd = scale * loop.stiffness, scale * loop.damping
    return MotorSetPoint(kp, kd, _within(most, kp, *angle), _within(most, kd, *speed))


def _within(most: float, gain: float, found: float, target: float) -> float:
    """Return the target, no farther from what was found than makes a current of `most` (A)."""
    if gain <= 0.0:
        return target
    farthest = most / gain
    return found + max(-farthest, min(farthest, target - found))
