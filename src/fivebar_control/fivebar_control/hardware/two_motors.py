# SPDX-License-Identifier: Apache-2.0
"""Two motors of any interface as one thing: a driver sends and receives, everything else is the same for all of them.

An interface of one's own needs a `MotorDriver`; `TwoMotors` is the `DriveInterface` on it.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import NamedTuple, Protocol

from fivebar_control.fault import Fault
from fivebar_control.hardware.configuration import MICROSECONDS, USUAL_MISSING
from fivebar_control.hardware.cycle_pace import CycleCount, CyclePace
from fivebar_control.hardware.drive_connection import DriveConnection
from fivebar_control.hardware.drive_interface import (
    ZERO,
    DriveReading,
    Exchange,
    JointTarget,
    Torques,
    set_up_or_closed,
)
from fivebar_control.hardware.fault import DriveError
from fivebar_control.hardware.motors_file import DrivenMotor, MotorsFile, load_motors
from fivebar_description.interface import ACTIVE_JOINTS

SETTLE_CYCLES = 3
"""Cycles at zero torque in which both drives must answer before they count as there, or as enabled."""

TEND_PERIOD = 0.1
"""Period (s) in which inactive drives are told that they get no power."""


class ShaftReading(NamedTuple):
    """One motor at one measurement, in the drive's own sense of rotation.

    Attributes:
        position: angle (rad) of the motor from where the drive reads 0.
        velocity: its speed (rad/s).
        torque: torque (Nm) that has acted at its shaft until then, not the one that a command asks for from then on.
    """

    position: float
    velocity: float
    torque: float


class PairCommand(NamedTuple):
    """The command for both drives in one cycle.

    Attributes:
        power: whether they are to have power.
        torques: torques (Nm) at the shafts of the motors, in the drives' own sense; zero without power.
        target: of the drives' own control of angle and speed, None where it is not to act.
    """

    power: bool
    torques: Torques
    target: JointTarget | None = None


class PairAnswer(NamedTuple):
    """The answer of both drives.

    Attributes:
        readings: as the command found each motor; None where no answer has come in time.
        powered: whether both have power.
        fault: what a drive or the link reports, None while nothing is wrong.
        periods: sampling periods since the last answer, by the drives' own clock; None where they have none.
        late: answers to earlier commands that have come since the last exchange.
    """

    readings: tuple[ShaftReading | None, ShaftReading | None]
    powered: bool
    fault: Fault | None = None
    periods: int | None = None
    late: int = 0


NO_POWER = PairCommand(False, ZERO)


class MotorDriver(Protocol):
    """Two drives on an open bus or port. Every method is for one thread."""

    def exchange(self, command: PairCommand, timeout: float) -> PairAnswer:
        """Send both drives a command, and wait for their answers for a time (s)."""
        ...

    def clear(self) -> None:
        """Clear the errors of both drives, which have no power."""
        ...

    def close(self) -> None:
        """Close the bus or the port."""
        ...


class TwoMotors:
    """The `DriveInterface` on a `MotorDriver`: limits, gears and signs, missing answers, enabling and stopping.

    A torque that is written acts from the next exchange on, which sends it.
    """

    def __init__(self, file: MotorsFile, driver: MotorDriver) -> None:
        """Take over the drives, which have no power."""
        self._file = file
        self._driver = driver
        self._pace = CyclePace(file.period_us / MICROSECONDS)
        self._cycles = CycleCount(file.period_us / MICROSECONDS)
        self._power = self._enabled = False
        self._torques: Torques = ZERO
        self._target: JointTarget | None = None
        self._silent = [0, 0]
        self._missing = self._late = 0
        self._positions = (0.0, 0.0)
        self.notes: tuple[str, ...] = ()
        """The error of an earlier run that has been cleared."""

    @property
    def enabled(self) -> bool:
        """Whether both drives have been enabled and nothing has stopped them since."""
        return self._enabled

    @property
    def unused(self) -> tuple[tuple[str, int], ...]:
        """Answers that did not come in time so far, and those that came late."""
        return ("missing_answers", self._missing), ("late_answers", self._late)

    def set_up(self) -> None:
        """Wait until both drives answer a command without power; errors that they still have are cleared, and noted.

        Raises:
            DriveError: one does not answer, or reports a fault that cannot be cleared.
        """
        timeout = self._file.set_up_timeout_ms / 1e3
        fault = self._await(lambda answer: True, timeout, "answered", whatever_fault=True)
        if fault is not None:
            self._driver.clear()
            self._await(lambda answer: True, timeout, "answered")
            self.notes = (f"cleared {fault}",)

    def tend(self) -> None:
        """Tell both drives again that they get no power."""
        self._driver.exchange(NO_POWER, self._file.gather_time)

    def confirm_start(self, timeout: float) -> None:
        """Confirm that both encoders read the declared posture.

        Raises:
            DriveError: a fault, another posture than the declared one, or no answer within `timeout` (s).
        """
        self._await(lambda answer: True, timeout, "answered")
        if self._file.posture is not None:
            self._file.posture.confirm(self._positions, "correct zero_rad")

    def enable(self, timeout: float) -> None:
        """Enable both drives at zero torque.

        Raises:
            DriveError: a fault, or they have no power within `timeout` (s); they are off then.
        """
        self._power = True
        try:
            self._await(lambda answer: answer.powered, timeout, "had power")
        except DriveError:
            self.switch_off()
            raise
        self._enabled = True

    def exchange(self) -> Exchange:
        """Send power and torques, and take the measurements that the commands found."""
        # a robot that moves on with the commands has moved on by one period, however late this one is
        passed = 1 if self._file.paced_by_commands else self._cycles.passed(time.monotonic())
        return self._judged(self._driver.exchange(self._command, self._file.gather_time), passed)

    def write(self, torques: Torques, target: JointTarget | None = None) -> None:
        """Keep torques (Nm, at the joints) for the next exchange, within the limits; zero unless both are enabled.

        Raises:
            ValueError: a torque is not finite; zero is kept instead.
        """
        self._torques, self._target = ZERO, None
        if not all(math.isfinite(torque) for torque in torques):
            raise ValueError(f"torques {torques} Nm: expected finite numbers")
        if self._enabled:
            first, second = map(shaft_torque, self._file.pair, torques)
            self._torques, self._target = (first, second), target

    @property
    def _command(self) -> PairCommand:
        """Power and torques of the next command."""
        return PairCommand(self._power, self._torques, self._target)

    def quick_stop(self) -> None:
        """Take the power with a command that is sent now: without torque the robot coasts."""
        self.switch_off()

    def switch_off(self) -> None:
        """Take the power of both with a command that is sent now."""
        self._power = self._enabled = False
        self._torques, self._target = ZERO, None
        self._driver.exchange(NO_POWER, 0.0)

    def disable(self, timeout: float) -> None:
        """Command zero torque, then take the power.

        Raises:
            DriveError: they still have power after `timeout` (s).
        """
        self._torques, self._target = ZERO, None
        self.exchange()
        self.switch_off()
        self._await(lambda answer: not answer.powered, timeout, "been off")

    def reset(self, timeout: float) -> None:
        """Clear the drives' errors; they stay off.

        Raises:
            DriveError: a fault is still there after `timeout` (s).
        """
        self.switch_off()
        self._silent = [0, 0]
        self._driver.clear()
        self._await(lambda answer: True, timeout, "answered")

    def release(self) -> None:
        """Take the power of both."""
        self.switch_off()

    def close(self) -> None:
        """Close the bus or the port."""
        self._driver.close()

    def _await(
        self, reached: Callable[[PairAnswer], bool], timeout: float, words: str, whatever_fault: bool = False
    ) -> Fault | None:
        """Exchange without torque until both drives have reached something in some cycles in a row.

        Only `whatever_fault` lets them have a fault, which is returned.
        """
        end, settled = time.monotonic() + timeout, 0
        fault: Fault | None = None
        while settled < SETTLE_CYCLES:
            if time.monotonic() > end:
                raise DriveError(
                    fault or Fault("drive_missing", f"{self._missing_ones()} not {words} in {timeout:g} s")
                )
            self._pace.wait()
            answer = self._driver.exchange(PairCommand(self._power, ZERO), self._file.gather_time)
            complete = None not in answer.readings
            fault = self._judged(answer).fault if complete else answer.fault
            sound = complete and (fault is None or whatever_fault)
            settled = settled + 1 if sound and reached(answer) else 0
        return fault

    def _missing_ones(self) -> str:
        silent = [self._place(number) for number, cycles in enumerate(self._silent) if cycles]
        return f"{' and '.join(silent or [self._place(0), self._place(1)])} have"

    def _place(self, number: int) -> str:
        return f"{ACTIVE_JOINTS[number]} (id {self._file.pair[number].id})"

    def _judged(self, answer: PairAnswer, passed: int = 1) -> Exchange:
        """Return the exchange of an answer; for a fault both drives lose their power.

        Args:
            answer: of the drives.
            passed: periods since the last one, where the drives have no clock.
        """
        fault = answer.fault
        self._late += answer.late
        for number, reading in enumerate(answer.readings):
            self._silent[number] = self._silent[number] + self._file.patience if reading is None else 0
            self._missing += reading is None
            if fault is None and self._silent[number] > self._file.most_missing:
                silent = self._silent[number]
                fault = Fault("feedback_missing", f"{self._place(number)}: no answer in {silent} cycles in a row")
            if fault is None and reading is not None and not _finite(reading):
                read = f"{reading.position} rad, {reading.velocity} rad/s"
                fault = Fault("feedback_invalid", f"{self._place(number)}: {read}: expected finite numbers")
        if fault is None and self._enabled and not answer.powered and None not in answer.readings:
            fault = Fault("drive_dropped_out", f"{self._place(0)} or {self._place(1)} has lost its power")
        if fault is not None and self._enabled:
            self.switch_off()
        first, second = (
            None if reading is None or not _finite(reading) else joint_reading(motor, reading)
            for motor, reading in zip(self._file.pair, answer.readings, strict=True)
        )
        if first is not None and second is not None:
            self._positions = first.position, second.position
        return Exchange((first, second), fault, passed if answer.periods is None else answer.periods)


def _finite(reading: ShaftReading) -> bool:
    return math.isfinite(reading.position) and math.isfinite(reading.velocity)


class PromptDriver(MotorDriver, Protocol):
    """Two drives that measure in a rhythm of their own, and apply a command from their next cycle on."""

    @property
    def unused(self) -> tuple[tuple[str, int], ...]:
        """Measurements that were not used so far: why, and how many."""
        ...

    def send(self, command: PairCommand) -> None:
        """Send both drives a command."""
        ...

    def receive(self, timeout: float) -> PairAnswer:
        """Return what has been measured since the last time, and wait for it for a time (s)."""
        ...


class PromptMotors(TwoMotors):
    """The `DriveInterface` on a `PromptDriver`: a torque is sent when it is written."""

    def __init__(self, file: MotorsFile, driver: PromptDriver) -> None:
        """Take over the drives, which have no power."""
        super().__init__(file, driver)
        self._prompt = driver

    @property
    def unused(self) -> tuple[tuple[str, int], ...]:
        """Answers and measurements that did not come or were not used so far."""
        return (*super().unused, *self._prompt.unused)

    def exchange(self) -> Exchange:
        """Take the measurements of the next sample."""
        return self._judged(self._prompt.receive(self._file.gather_time))

    def write(self, torques: Torques, target: JointTarget | None = None) -> None:
        """Send torques (Nm, at the joints), within the limits; zero unless both are enabled.

        Raises:
            ValueError: a torque is not finite; zero is sent instead.
        """
        try:
            super().write(torques, target)
        finally:
            self._prompt.send(self._command)


def joint_reading(motor: DrivenMotor, reading: ShaftReading) -> DriveReading:
    """Return what a drive's reading is at the joint.

    An encoder of N counts says in which of N intervals the angle lies. The estimator expects the interval's lower edge,
    and a drive that counts the other way round rounds to the upper one.
    """
    sign, gear = motor.sign, motor.gear_ratio
    interval = math.tau / (motor.counts_per_revolution * gear)
    position = motor.zero_rad + sign * reading.position / gear - (interval if sign < 0 else 0.0)
    return DriveReading(position, sign * reading.velocity / gear, sign * reading.torque * gear)


def shaft_torque(motor: DrivenMotor, torque: float) -> float:
    """Return the torque (Nm) at a motor's shaft for one at its joint (Nm), within its limits."""
    limit = motor.shaft_torque_limit
    return max(-limit, min(limit, motor.sign * torque / motor.gear_ratio))


def connecting(open_driver: Callable[[MotorsFile], MotorDriver]) -> Callable[[str], DriveConnection]:
    """Return the `connection` of a `DriveKind`, which reads a configuration given by its path.

    Args:
        open_driver: opens the bus or the port of a configuration, or raises a `DriveError`; called when the bridge is
            configured.
    """

    def connection(configuration: str) -> DriveConnection:
        file = load_motors(configuration)

        def opened(missing: int = USUAL_MISSING) -> TwoMotors:
            bearing = file.bearing(missing)
            return set_up_or_closed(TwoMotors(bearing, open_driver(bearing)))

        return DriveConnection(file.period_us, "period_us", TEND_PERIOD, opened, file.paced_by_commands)

    return connection
