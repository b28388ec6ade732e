# SPDX-License-Identifier: Apache-2.0
"""The drives' own position and speed control as a small inner loop besides the law's torque.

They close i = i_ff + kp (q* - q) + kd (v* - v) at their own rate; i is a current or a torque. Away from the Type 2
locus that adds a joint stiffness and a damping to the law. On the locus they would fight the constraint, so that both
are faded to zero there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, NamedTuple

from pydantic import Field

from fivebar_control.hardware.configuration import MICROSECONDS
from fivebar_control.hardware.drive_interface import JointTarget
from fivebar_control.laws.blend import blending_weight
from fivebar_control.model.kinematics import assembly_mode, state_from_joints, state_from_platform, working_mode
from fivebar_control.model.singularity import NEAR_LOCUS, inverse_condition
from fivebar_description.robot_file import load_robot
from fivebar_description.scenario_file import DEFAULT_ROBOT
from fivebar_description.strict_yaml import StrictModel
from fivebar_description.whole_turns import nearest_turn

HALF_TURN_MARGIN = 0.5
"""Distance (rad) of an encoder's reading from half a turn, where it jumps by a whole one, below which there is no inner
loop; from twice that on it is whole."""


class InnerLoopSettings(StrictModel):
    """Section `inner_loop`: the drives' own control of angle and speed, besides the law's torque; off by default.

    Attributes:
        stiffness: the drives' kp, in A/rad or Nm/rad as they take their efforts.
        damping: their kd, in A/(rad/s) or Nm/(rad/s).
        share: largest part of a motor's limit that both may command together.
        epsilon: kappa = 1/cond(A) up to which there is none of either; from twice that on they are whole.
        robot: file of the robot, for the joint angles of the reference.
    """

    stiffness: Annotated[float, Field(ge=0.0)] = 0.0
    damping: Annotated[float, Field(ge=0.0)] = 0.0
    share: Annotated[float, Field(gt=0.0, le=0.5)] = 0.2
    epsilon: Annotated[float, Field(gt=0.0, lt=0.5)] = NEAR_LOCUS
    robot: Annotated[str, Field(min_length=1)] = DEFAULT_ROBOT

    @property
    def on(self) -> bool:
        """Whether there is an inner loop."""
        return self.stiffness > 0.0 or self.damping > 0.0


class MotorSetPoint(NamedTuple):
    """A set point for a drive besides its effort: gains in A or Nm per rad and rad/s, targets in rad and rad/s."""

    kp: float
    kd: float
    angle: float
    speed: float


OPEN = MotorSetPoint(0.0, 0.0, 0.0, 0.0)
"""No inner loop."""


class LoopTargets:
    """Targets of the inner loop from the reference and the state of one sample."""

    def __init__(self, loop: InnerLoopSettings, period_us: int) -> None:
        """Read the robot, which is commanded in a period (us).

        Raises:
            InputError: the robot file is missing or wrong.
        """
        self._robot = load_robot(loop.robot)
        self._epsilon = loop.epsilon
        self._half_period = 0.5 * period_us / MICROSECONDS

    def target(
        self, reference: Sequence[float], position: Sequence[float], velocity: Sequence[float]
    ) -> JointTarget | None:
        """Return where the motors should be, and how much of the stiffness acts; None where none does.

        The target of a motor is on the turn on which the motor is.

        Args:
            reference: x, y (m), vx, vy (m/s) of the platform.
            position, velocity: q11, q12, q21, q22 (rad) and their rates (rad/s), measured or estimated.
        """
        state = state_from_joints(self._robot, *position, *velocity)
        desired = state_from_platform(self._robot, working_mode(state), *reference)
        angles, speeds = (desired.leg1.q1, desired.leg2.q1), (desired.leg1.dq1, desired.leg2.dq1)
        kappa = min(inverse_condition(state), inverse_condition(desired))
        if not all(map(math.isfinite, (*angles, *speeds, kappa))) or assembly_mode(state) != assembly_mode(desired):
            return None
        weight = 1.0 - blending_weight(kappa, self._epsilon)
        if weight <= 0.0:
            return None
        # the target is held for a period, during which the reference moves on: take the middle
        q11, q21 = (
            nearest_turn(angle, motor) + speed * self._half_period
            for motor, angle, speed in zip((position[0], position[2]), angles, speeds, strict=True)
        )
        return JointTarget(weight, (q11, q21), speeds)


def set_point(
    loop: InnerLoopSettings,
    limit: float,
    effort: float,
    weight: float,
    angle: tuple[float, float],
    speed: tuple[float, float],
) -> MotorSetPoint:
    """Return a drive's set point, bounded so that the sum of all efforts keeps the motor's limit.

    Stiffness and damping may each take half of the share of the limit, and together no more than the law has left.

    Args:
        loop: settings.
        limit: largest effort, a current (A) or a torque (Nm).
        effort: of the law's torque, in the same unit.
        weight: how much of stiffness and damping acts, from 0 to 1.
        angle: reading of the encoder and target (rad), as the drive counts.
        speed: the drive's speed and the target (rad/s).
    """
    most = 0.5 * min(loop.share * limit, limit - abs(effort))
    if weight <= 0.0 or most <= 0.0:
        return OPEN
    kp, kd = weight * loop.stiffness, weight * loop.damping
    return MotorSetPoint(kp, kd, _within(most, kp, *angle), _within(most, kd, *speed))


def away_from_jump(reading: float) -> float:
    """Return how much of an inner loop acts, from 0 to 1, at the reading of an encoder that jumps at half a turn."""
    from_half_turn = (math.pi - abs(reading)) / HALF_TURN_MARGIN - 1.0
    return max(0.0, min(1.0, from_half_turn))


def _within(most: float, gain: float, measured: float, target: float) -> float:
    """Return the target, no farther from the reading than makes an effort of `most`."""
    if gain <= 0.0:
        return target
    farthest = most / gain
    return measured + max(-farthest, min(farthest, target - measured))
