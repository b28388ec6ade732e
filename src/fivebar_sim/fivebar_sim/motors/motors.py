# SPDX-License-Identifier: Apache-2.0
"""Two emulated motors and the robot that they move, without a bus or port. Times are seconds of a steady clock."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from typing import NamedTuple

from fivebar_description.imu import ImuSettings
from fivebar_sim.emulated_hardware import HISTORY, MeasuredRecord
from fivebar_sim.motors.configuration import MotorFacts, MotorsEmulationFile
from fivebar_sim.moved_robot import MovedRobot
from fivebar_sim.plant import PlantDiverged

LONGEST_CATCH_UP = 0.25
"""Longest time (s) that is simulated at once, after this process was stopped for a while."""

RESTING = 0.03
"""Speed (rad/s) of the fastest joint below which friction holds a robot that nothing moves."""


class ShaftState(NamedTuple):
    """Measurements and state of a drive, in its own sense of rotation.

    Attributes:
        position: angle (rad) of the motor's encoder from where it reads 0.
        velocity: its speed (rad/s), of the last two readings.
        torque: torque (Nm) at the shaft.
        powered: whether the drive has power.
        faulty: whether it is in error, and takes no power until that is cleared.
    """

    position: float
    velocity: float
    torque: float
    powered: bool
    faulty: bool


class SimulatedMotor:
    """One motor with its encoder."""

    def __init__(self, facts: MotorFacts, period: float) -> None:
        """Make a motor without power that is read every `period` (s)."""
        self.facts = facts
        self._period = period
        self._counts = self._before = 0
        self.torque = 0.0
        self.powered = self.faulty = self.silent = self.frozen = False
        """Whether it has power, is in error, does not answer, and whether its encoder repeats its reading."""
        self.fault = ""
        """The name of the error, where one was given."""

    @property
    def resolution(self) -> float:
        """Size (rad) of a count at the joint."""
        return math.tau / (self.facts.counts_per_revolution * self.facts.gear_ratio)

    @property
    def joint_angle(self) -> float:
        """The joint angle (rad) that is read, the lower edge of the encoder's interval."""
        facts = self.facts
        counts = self._counts + 1 if facts.sign < 0 else self._counts
        return facts.zero_rad + facts.sign * counts * self.resolution

    @property
    def state(self) -> ShaftState:
        """Measurements and state of the drive."""
        turn = math.tau / self.facts.counts_per_revolution
        speed = (self._counts - self._before) * turn / self._period
        return ShaftState(self._counts * turn, speed, self.torque, self.powered, self.faulty)

    def state_at(self, joint_angle: float) -> ShaftState:
        """Return the state where the encoder is read at a joint angle (rad), between two times of the period."""
        state = self.state
        turn = math.tau / self.facts.counts_per_revolution
        return state if self.frozen else state._replace(position=self._read(joint_angle) * turn)

    def joint_torque(self) -> float:
        """Return the torque (Nm) at the joint."""
        return self.facts.sign * self.facts.gear_ratio * self.torque

    def command(self, power: bool, torque: float) -> None:
        """Take or give power, and apply a torque (Nm) at the shaft from now on."""
        self.powered = power and not self.faulty
        limit = math.inf if self.facts.current_limit is None else self.facts.current_limit * self.facts.torque_constant
        self.torque = max(-limit, min(limit, torque)) if self.powered and math.isfinite(torque) else 0.0

    def place(self, joint_angle: float) -> None:
        """Begin at a joint angle (rad), at rest and without torque."""
        self.torque = 0.0
        self._counts = self._before = self._read(joint_angle)

    def sense(self, joint_angle: float) -> None:
        """Read the encoder at a joint angle (rad), one period after the last time."""
        self._before = self._counts
        if not self.frozen:
            self._counts = self._read(joint_angle)

    def _read(self, joint_angle: float) -> int:
        turns = self.facts.sign * (joint_angle - self.facts.zero_rad) * self.facts.gear_ratio / math.tau
        return math.floor(turns * self.facts.counts_per_revolution)


class EmulatedMotors(MovedRobot):
    """Both motors on the simulated robot, which a pair of commands moves on by a period, or the clock by its parts.

    It stays at home until a motor has torque, and without power where it comes to rest with no hand on it.
    """

    def __init__(
        self, file: MotorsEmulationFile, now: float, holds: bool = False, imu: ImuSettings | None = None
    ) -> None:
        """Switch the drives on, which hold their last torque for ever where they have no watchdog.

        Without the settings of an IMU the robot has an ideal one.

        Raises:
            InputError: the robot or its posture cannot be.
        """
        self._file = file
        self._holds = holds
        self._period = file.period_us / 1e6
        first, second = file.pair
        self.motors = SimulatedMotor(first, self._period), SimulatedMotor(second, self._period)
        self.history: deque[MeasuredRecord] = deque(maxlen=HISTORY)
        """The last measurements, the newest at the end."""
        self._measured = 0
        self._noted = False
        self._commanded: set[int] = set()
        self._commanded_at: float | None = None
        self._clock = now
        self._impulses = [0.0, 0.0]
        """Integrals of both torques (Nm s) over the present part, as far as they have been noted."""
        self._noted_until = [now, now]
        self._part = 0
        self.before_step: Callable[[float], None] | None = None
        """Called with the time (s) of the robot's state before that is moved on."""
        super().__init__(file, round(1.0 / self._period), imu, file.pace == "clock", file.least_parts)

    @property
    def _length(self) -> float:
        """Time (s) by which the robot is moved on at once."""
        return self._period / self.parts

    def go_home(self) -> None:
        """Put the robot into its initial posture, at rest; it keeps its payload.

        Raises:
            InputError: the robot or its posture cannot be.
        """
        super().go_home()
        (q11, _, q21, _), _ = self.plant.seen()
        for motor, angle in zip(self.motors, (q11, q21), strict=True):
            motor.place(angle)
        self._noted, self._part = False, 0
        self._pulled = False

    def pull(self, x: float, y: float) -> None:
        """Have a hand pull the platform with a force (N) from now on.

        Raises:
            InputError: the simulated robot has no effects, and nothing can pull it.
        """
        self._held, self._pulled = False, bool(x or y)
        self.plant.hold(x, y)

    def number_of(self, drive: int) -> int | None:
        """Return which motor, 0 or 1, has a drive of that id; None where neither has, or it does not answer."""
        for number, motor in enumerate(self.motors):
            if motor.facts.id == drive and not motor.silent:
                return number
        return None

    def command(self, number: int, power: bool, torque: float, now: float) -> ShaftState:
        """Command one drive; return what it found, as its answer has it.

        With the pace `commands` the robot moves on once both drives have been commanded.

        Args:
            number: the motor, 0 or 1.
            power: whether it is to have power.
            torque: at its shaft (Nm), in the drive's own sense.
            now: the time (s).
        """
        motor = self.motors[number]
        state = motor.state
        if self._file.pace != "commands":
            self._move_to(now)
            state = motor.state_at(self._angle_at(number, now))
            self._note_torque(number, self._clock, now)
        motor.command(power, torque)
        self._commanded_at = now
        self._commanded.add(number)
        if self._commanded == {0, 1} and self._file.pace == "commands":
            self._clock = now
            self._advance()
        return state

    def tend(self, now: float) -> None:
        """Do what is due at this time: the watchdog, and time that no command moves on."""
        watchdog = self._file.watchdog_ms / 1e3
        fed = self._commanded_at is not None and now - self._commanded_at <= watchdog
        if not fed and not self._holds:
            for motor in self.motors:
                motor.command(False, 0.0)
        if fed and self._file.pace == "commands":
            # the next command, which may be late, moves the robot on
            self._clock = now
        self._move_to(now)

    def _move_to(self, now: float) -> None:
        """Move the robot on, to the last part that begins before a time (s)."""
        length = self._length
        self._clock = max(self._clock, now - LONGEST_CATCH_UP)
        while self._clock + length <= now:
            self._clock += length
            self._advance()

    def _angle_at(self, number: int, now: float) -> float:
        """Return a joint angle (rad) at a time (s) since the robot was last moved on."""
        angles, speeds = self.plant.seen()
        passed = 0.0 if self._held else max(0.0, now - self._clock)
        return angles[2 * number] + passed * speeds[2 * number]

    def _note_torque(self, number: int, begin: float, until: float) -> None:
        """Note the torque of a motor up to a time (s), within the part that has begun at another."""
        since = max(self._noted_until[number], begin)
        self._impulses[number] += self.motors[number].joint_torque() * max(0.0, until - since)
        self._noted_until[number] = until

    def _torque(self, number: int) -> float:
        """Return the torque (Nm) at a joint in the next part: by the clock its mean over the one that has passed."""
        if self._file.pace == "commands":
            return self.motors[number].joint_torque()
        # its end is the present time of the clock
        self._note_torque(number, self._clock - self._length, self._clock)
        impulse, self._impulses[number] = self._impulses[number], 0.0
        return impulse / self._length

    def measure(self) -> MeasuredRecord:
        """Return what is measured now, which is noted once."""
        if not self._noted:
            first, second = self.motors
            self._measured += 1
            self._noted = True
            angles = first.joint_angle, second.joint_angle
            self.history.append(MeasuredRecord(self._measured, angles, self.plant.truth()))
        return self.history[-1]

    def _advance(self) -> None:
        """Note what is measured once a period, and move the robot on by a part of it."""
        self._commanded.clear()
        first, second = self.motors
        if self._part == 0:
            self.measure()
            self._noted = False
            if self.before_step is not None:
                self.before_step(self._clock - self._length)
        self._part = (self._part + 1) % self.parts
        try:
            self.move((self._torque(0), self._torque(1)))
        except PlantDiverged:
            first.faulty = second.faulty = True
            return
        if self._held:
            return
        if self._part == 0:
            (q11, _, q21, _), _ = self.plant.seen()
            for motor, angle in zip(self.motors, (q11, q21), strict=True):
                if math.isfinite(angle):
                    motor.sense(angle)
        if not (self._pulled or first.powered or second.powered):
            self._held = max(map(abs, self.plant.truth().velocity)) < RESTING
