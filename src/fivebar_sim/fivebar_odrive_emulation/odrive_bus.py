# SPDX-License-Identifier: Apache-2.0
"""The side of two ODrives on a CAN bus, by the protocol CAN Simple of firmware 0.6.

Frames are put together here anew, and not taken from the bridge, so that each side checks the other.
"""

from __future__ import annotations

import math
import struct
import time

import can

from fivebar_description.drive_file import CanChannel
from fivebar_description.strict_yaml import StrictModel
from fivebar_sim.motors.can_link import CanLink
from fivebar_sim.motors.configuration import MotorsEmulationFile
from fivebar_sim.motors.emulation import emulating
from fivebar_sim.motors.motors import EmulatedMotors, ShaftState, SimulatedMotor

HEARTBEAT_PERIOD = 0.1
"""Period (s) of heartbeats, the drive's default."""

PROTOCOL = 2
"""Protocol version that is reported."""

IDLE, CLOSED_LOOP = 1, 8

SUCCESS, NOT_CALIBRATED = 0, 14
"""Results of the last procedure."""

ERRORS = {
    "INITIALIZING": 0x1,
    "SYSTEM_LEVEL": 0x2,
    "TIMING_ERROR": 0x4,
    "MISSING_ESTIMATE": 0x8,
    "BAD_CONFIG": 0x10,
    "DRV_FAULT": 0x20,
    "MISSING_INPUT": 0x40,
    "DC_BUS_OVER_VOLTAGE": 0x100,
    "DC_BUS_UNDER_VOLTAGE": 0x200,
    "DC_BUS_OVER_CURRENT": 0x400,
    "DC_BUS_OVER_REGEN_CURRENT": 0x800,
    "CURRENT_LIMIT_VIOLATION": 0x1000,
    "MOTOR_OVER_TEMP": 0x2000,
    "INVERTER_OVER_TEMP": 0x4000,
    "VELOCITY_LIMIT_VIOLATION": 0x8000,
    "POSITION_LIMIT_VIOLATION": 0x10000,
    "WATCHDOG_TIMER_EXPIRED": 0x1000000,
    "ESTOP_REQUESTED": 0x2000000,
    "SPINOUT_DETECTED": 0x4000000,
    "BRAKE_RESISTOR_DISARMED": 0x8000000,
    "THERMISTOR_DISCONNECTED": 0x10000000,
    "CALIBRATION_ERROR": 0x40000000,
}
"""Errors that can be injected, by the vendor's names."""

DEFAULT_ERROR = "DRV_FAULT"
"""The error of a fault that is injected without a name."""


class ODriveLinkFile(CanChannel, StrictModel):
    """Section `link`: the bus, and what both drives report of themselves.

    Attributes:
        bitrate: of the wire (bit/s), which an emulated bus has not.
        firmware: major and minor number.
        calibrated: whether both axes know motor and encoder, without which they take no power.
    """

    bitrate: int = 1_000_000
    firmware: tuple[int, int] = (0, 6)
    calibrated: bool = True


class AxisState:
    """The memory of a drive."""

    def __init__(self) -> None:
        self.wanted = False
        self.torque_mode = False
        self.errors = self.disarmed = self.result = 0
        self.found: ShaftState | None = None


class ODriveBus(CanLink[ODriveLinkFile]):
    """The `MotorLink` of two ODrives."""

    def __init__(self, file: MotorsEmulationFile) -> None:
        """Open the bus.

        Raises:
            InputError: it cannot be opened.
        """
        super().__init__(file, ODriveLinkFile)
        self._axes = AxisState(), AxisState()
        self._beat_due = 0.0

    def tend(self, motors: EmulatedMotors) -> None:
        """Send the heartbeats that are due."""
        now = time.monotonic()
        if now >= self._beat_due:
            self._beat_due = now + HEARTBEAT_PERIOD
            for number in range(2):
                self._beat(motors, number)

    def watch(self, motors: EmulatedMotors) -> None:
        """Note injected faults, and power that the watchdog has taken."""
        for number, (axis, motor) in enumerate(zip(self._axes, motors.motors, strict=True)):
            before = axis.errors
            if motor.faulty and not axis.errors:
                axis.errors = ERRORS[motor.fault or DEFAULT_ERROR]
            elif axis.wanted and not motor.powered and axis.found is not None and not motor.faulty:
                axis.errors = ERRORS["WATCHDOG_TIMER_EXPIRED"]
            if axis.errors and not before:
                axis.disarmed, axis.wanted = axis.errors, False
                self._beat(motors, number)

    def answer(self, motors: EmulatedMotors, message: can.Message) -> None:
        """Answer a frame to one of the drives."""
        number = motors.number_of(message.arbitration_id >> 5)
        if number is None:
            return
        axis, motor, command = self._axes[number], motors.motors[number], message.arbitration_id & 31
        data = bytes(message.data)
        if message.is_remote_frame:
            if command == 0x00:
                self._send(motor, command, bytes((PROTOCOL, 5, 2, 0, *self.link.firmware, 11, 0)))
            elif command == 0x03:
                self._send(motor, command, struct.pack("<II", axis.errors, axis.disarmed))
            elif command == 0x09:
                state = axis.found or motor.state
                self._send(motor, command, struct.pack("<ff", state.position / math.tau, state.velocity / math.tau))
            return
        if command == 0x07:
            (wanted,) = struct.unpack_from("<I", data)
            axis.result = SUCCESS if self.link.calibrated or wanted != CLOSED_LOOP else NOT_CALIBRATED
            axis.wanted = wanted == CLOSED_LOOP and axis.torque_mode and not (axis.errors or axis.result)
            axis.found = None
            if not axis.wanted:
                motor.command(False, 0.0)
            self._beat(motors, number)
        elif command == 0x0B:
            axis.torque_mode = struct.unpack("<II", data) == (1, 1)
        elif command == 0x0E:
            (torque,) = struct.unpack_from("<f", data)
            axis.found = motors.command(number, axis.wanted, torque, time.monotonic())
        elif command == 0x18:
            axis.errors = axis.disarmed = 0
            motor.faulty = False

    def _beat(self, motors: EmulatedMotors, number: int) -> None:
        axis, motor = self._axes[number], motors.motors[number]
        if not motor.silent:
            state = CLOSED_LOOP if axis.wanted else IDLE
            self._send(motor, 0x01, struct.pack("<IBBBx", axis.errors, state, axis.result, 0))

    def _send(self, motor: SimulatedMotor, command: int, data: bytes) -> None:
        self.send(motor.facts.id << 5 | command, data)


EMULATOR = emulating(ODriveBus, ERRORS)
"""The emulation of the interface."""
