# SPDX-License-Identifier: Apache-2.0
"""One motor of the emulated board: current loop, encoder, and the speeds derived from its counts."""

from __future__ import annotations

import math

from fivebar_motkin_emulation.configuration import BoardMotorFacts
from fivebar_motkin_emulation.protocol import MotorCommand, MotorState

OFF = MotorCommand(0.0, 0.0, 0.0, 0.0, 0.0)


class EmulatedMotor:
    """Follows a current with the bandwidth of the board's loop. Angles and currents are signed as the board's."""

    def __init__(self, facts: BoardMotorFacts, tick: float) -> None:
        """Make a motor without current whose angle is sensed every `tick` (s)."""
        self._facts = facts
        self._tick = tick
        rate = math.tau * facts.current_bandwidth_hz * tick
        self._kept = math.exp(-rate)
        self._mean_kept = -math.expm1(-rate) / rate
        self._smoothing = -math.expm1(-math.tau * facts.speed_bandwidth_hz * tick)
        self._counts: int | None = None
        self._speed = self._raw_speed = 0.0
        self._current = self._target = 0.0
        self.frozen = False
        """Whether the encoder repeats its reading."""

    @property
    def angle(self) -> float:
        """The board's angle (rad), of the encoder's reading."""
        return (self._counts or 0) * math.tau / self._facts.counts_per_revolution

    @property
    def joint_angle(self) -> float:
        """The joint angle (rad) of the encoder's reading."""
        return self._facts.zero_rad + self._facts.sign * self.angle

    @property
    def state(self) -> MotorState:
        """The reported state: its angle is within half a turn of zero, as that of an absolute encoder."""
        angle = math.remainder(self.angle, math.tau)
        return MotorState(angle, self._speed, self._raw_speed, self._current, self._target)

    def joint_torque(self, current: float) -> float:
        """Return the torque (Nm) at the joint by a current (A)."""
        return self._facts.sign * self._facts.torque_constant * current

    def place(self, joint_angle: float) -> None:
        """Begin at a joint angle (rad), at rest and without current."""
        self._counts = None
        self._speed = self._raw_speed = self._current = self._target = 0.0
        self._read(joint_angle)

    def sense(self, joint_angle: float) -> None:
        """Read the encoder at a joint angle (rad), one tick after the last time."""
        before = self._counts
        if not self.frozen:
            self._read(joint_angle)
        moved = (self._counts or 0) - (before or 0)
        self._raw_speed = moved * math.tau / self._facts.counts_per_revolution / self._tick
        self._speed += self._smoothing * (self._raw_speed - self._speed)

    def _read(self, joint_angle: float) -> None:
        turns = self._facts.sign * (joint_angle - self._facts.zero_rad) / math.tau
        self._counts = math.floor(turns * self._facts.counts_per_revolution)

    def drive(self, command: MotorCommand) -> float:
        """Follow a command for one tick; return the mean torque (Nm) at the joint."""
        limit = self._facts.current_limit
        wanted = (
            command.current
            + command.kp * (command.angle - math.remainder(self.angle, math.tau))
            + command.kd * (command.speed - self._speed)
        )
        self._target = max(-limit, min(limit, wanted))
        missing = self._target - self._current
        mean = self._target - missing * self._mean_kept
        self._current = self._target - missing * self._kept
        return self.joint_torque(mean)
