# SPDX-License-Identifier: Apache-2.0
"""Two ODrive S1, Pro or Micro (firmware 0.6) on one CAN bus, by the protocol CAN Simple, as a `MotorDriver`.

An id on the bus is node_id * 32 + command. All values are little-endian; angles are in revolutions of the motor.
"""

from __future__ import annotations

import math
import struct
import time
from collections.abc import Mapping

from fivebar_control.fault import Fault
from fivebar_control.hardware.can_pair import CanPair, DriveOnBus, finite
from fivebar_control.hardware.can_port import open_bus
from fivebar_control.hardware.configuration import Bus
from fivebar_control.hardware.fault import DriveError
from fivebar_control.hardware.motors_file import MotorsFile
from fivebar_control.hardware.two_motors import PairAnswer, PairCommand, ShaftReading, connecting
from fivebar_description.interface import ACTIVE_JOINTS
from fivebar_description.strict_yaml import validate

GET_VERSION, HEARTBEAT, GET_ERROR, SET_AXIS_STATE = 0x00, 0x01, 0x03, 0x07
GET_ENCODER_ESTIMATES, SET_CONTROLLER_MODE, SET_INPUT_TORQUE, GET_TORQUES, CLEAR_ERRORS = 0x09, 0x0B, 0x0E, 0x1C, 0x18
"""Commands."""

IDLE, CLOSED_LOOP_CONTROL = 1, 8
"""States of an axis."""

TORQUE_CONTROL, PASSTHROUGH = 1, 1
"""Control mode and input mode."""

NOT_CALIBRATED = 14
"""Result of a procedure: the axis has refused to be controlled."""

FIRMWARE = (0, 6)

ERRORS = {
    0x1: "INITIALIZING",
    0x2: "SYSTEM_LEVEL",
    0x4: "TIMING_ERROR",
    0x8: "MISSING_ESTIMATE",
    0x10: "BAD_CONFIG",
    0x20: "DRV_FAULT",
    0x40: "MISSING_INPUT",
    0x100: "DC_BUS_OVER_VOLTAGE",
    0x200: "DC_BUS_UNDER_VOLTAGE",
    0x400: "DC_BUS_OVER_CURRENT",
    0x800: "DC_BUS_OVER_REGEN_CURRENT",
    0x1000: "CURRENT_LIMIT_VIOLATION",
    0x2000: "MOTOR_OVER_TEMP",
    0x4000: "INVERTER_OVER_TEMP",
    0x8000: "VELOCITY_LIMIT_VIOLATION",
    0x10000: "POSITION_LIMIT_VIOLATION",
    0x1000000: "WATCHDOG_TIMER_EXPIRED",
    0x2000000: "ESTOP_REQUESTED",
    0x4000000: "SPINOUT_DETECTED",
    0x8000000: "BRAKE_RESISTOR_DISARMED",
    0x10000000: "THERMISTOR_DISCONNECTED",
    0x40000000: "CALIBRATION_ERROR",
}
"""Bits of an axis' errors and disarm reasons, by the vendor's names."""

HEARTBEAT_TIMEOUT = 0.35
"""Age (s) of the last heartbeat, which is due every 0.1 s by default, beyond which a drive counts as lost."""

FIRST_HEARTBEAT = 0.15
"""Longest time (s) for which the first heartbeats are waited for."""

ASK_PERIOD = 0.1
"""Shortest time (s) between two requests of the same axis state, and of why an axis was disarmed."""

FAULTS: Mapping[str, tuple[str, str]] = {
    "odrive_error": (
        "An axis is in error or was disarmed; the message names the vendor's errors.",
        "Remove the cause, then reset and enable.",
    ),
    "odrive_uncalibrated": (
        "An axis takes no power, since motor or encoder has not been calibrated.",
        "Calibrate it with the vendor's tool and save that, then reset and enable.",
    ),
    "odrive_firmware": ("A drive has another firmware than 0.6.", "Update the drive with the vendor's tool."),
    "drive_lost": ("A drive sends no heartbeat.", "Check cable, power and node id, then reset and enable."),
    "drive_missing": ("A drive does not answer.", "Check power, node id and bit rate, then configure again."),
    "feedback_missing": ("Encoder estimates are missing.", "Check the load of the bus and the cable, then reset."),
}
"""Meaning and recovery of the faults."""


class Axis(DriveOnBus):
    """The known state of one drive."""

    def __init__(self, node: int, joint: str) -> None:
        super().__init__(node, joint, "node")
        self.version: tuple[int, int] | None = None
        self.state, self.errors, self.disarmed, self.result = 0, 0, 0, 0
        self.heard = -math.inf
        self.estimate: tuple[float, float] | None = None
        self.torque: float | None = None
        self.asked = -math.inf


def frame_id(node: int, command: int) -> int:
    """Return the id on the bus."""
    return node << 5 | command


def error_names(errors: int) -> str:
    """Return the vendor's names of errors, and the number of those without one."""
    names = [name for bit, name in ERRORS.items() if errors & bit]
    unknown = errors & ~sum(ERRORS)
    return ", ".join([*names, *([f"{unknown:#x}"] if unknown else [])])


class ODrives(CanPair[Axis]):
    """Both drives on an open bus, in torque control."""

    def __init__(self, file: MotorsFile) -> None:
        """Open the bus, check the firmware of both drives, and have them follow torques.

        Raises:
            DriveError: the bus cannot be opened, a drive does not answer, or it has another firmware.
        """
        bus = validate(dict(file.link), Bus, f"{file.name}: link")
        first, second = (Axis(motor.id, joint) for motor, joint in zip(file.pair, ACTIVE_JOINTS, strict=True))
        self._power = False
        self._torques = (0.0, 0.0)
        super().__init__(open_bus(bus), (first, second))
        try:
            self._check_firmware()
            # which tell of errors that are still there
            self.wait_for_both(lambda axis: axis.heard > 0.0, FIRST_HEARTBEAT)
            for axis in self.drives:
                self._command(axis, SET_CONTROLLER_MODE, struct.pack("<II", TORQUE_CONTROL, PASSTHROUGH))
        except DriveError:
            self.leave()
            raise

    def exchange(self, command: PairCommand, timeout: float) -> PairAnswer:
        """Send state and torque, and ask for the encoder estimates that they find."""
        now = time.monotonic()
        for axis, torque in zip(self.drives, command.torques, strict=True):
            axis.estimate, axis.awaited = None, True
            self._ask_for_power(axis, command.power, now)
            # in any state, since it feeds the drive's watchdog
            self._command(axis, SET_INPUT_TORQUE, struct.pack("<f", torque if command.power else 0.0))
            self._request(axis, GET_ENCODER_ESTIMATES)
        self.wait_for_answers(timeout)
        with self.received:
            first, second = (
                self._reading(axis, torque) for axis, torque in zip(self.drives, self._torques, strict=True)
            )
            powered = all(axis.state == CLOSED_LOOP_CONTROL for axis in self.drives)
            fault = self._fault(now, command.power)
        self._power, self._torques, _ = command
        return PairAnswer((first, second), powered, fault, late=self.take_late())

    def clear(self) -> None:
        """Clear the errors of both drives."""
        for axis in self.drives:
            self._command(axis, CLEAR_ERRORS, b"\x00")
            axis.errors = axis.disarmed = 0

    def close(self) -> None:
        """Leave the bus, both axes idle."""
        for axis in self.drives:
            self._command(axis, SET_AXIS_STATE, struct.pack("<I", IDLE))
        self.leave()

    def _check_firmware(self) -> None:
        self.expect_both(lambda axis: axis.version is not None, lambda axis: self._request(axis, GET_VERSION))
        for axis in self.drives:
            if axis.version is not None and axis.version != FIRMWARE:
                running, expected = (".".join(map(str, version)) for version in (axis.version, FIRMWARE))
                raise DriveError(Fault("odrive_firmware", f"{axis.place}: firmware {running}, expected {expected}"))

    def _ask_for_power(self, axis: Axis, power: bool, now: float) -> None:
        wanted = CLOSED_LOOP_CONTROL if power else IDLE
        if power != self._power or (axis.state != wanted and now - axis.asked > ASK_PERIOD and not axis.errors):
            axis.asked, axis.result = now, 0
            self._command(axis, SET_AXIS_STATE, struct.pack("<I", wanted))

    def _reading(self, axis: Axis, commanded: float) -> ShaftReading | None:
        """Return a reading; the torque is what was commanded where the drive does not publish its own."""
        if axis.estimate is None:
            return None
        turns, speed = axis.estimate
        return ShaftReading(math.tau * turns, math.tau * speed, commanded if axis.torque is None else axis.torque)

    def _fault(self, now: float, power: bool) -> Fault | None:
        for axis in self.drives:
            if axis.errors or axis.disarmed:
                return Fault("odrive_error", f"{axis.place}: {error_names(axis.errors | axis.disarmed)}")
            if power and axis.state == IDLE and axis.result == NOT_CALIBRATED:
                return Fault("odrive_uncalibrated", f"{axis.place}: NOT_CALIBRATED")
            if now - axis.heard > HEARTBEAT_TIMEOUT and axis.heard > 0.0:
                return Fault("drive_lost", f"{axis.place}: no heartbeat for {HEARTBEAT_TIMEOUT:g} s")
            if power and self._power and axis.state == IDLE and now - axis.asked > ASK_PERIOD:
                self._request(axis, GET_ERROR)
        return None

    def _command(self, axis: Axis, command: int, data: bytes) -> None:
        self.send(frame_id(axis.id, command), data)

    def _request(self, axis: Axis, command: int) -> None:
        self.request(frame_id(axis.id, command))

    def take(self, can_id: int, data: bytes) -> None:
        """Take a frame. Frames of other nodes and lengths are not used."""
        axis, command = self.by_id.get(can_id >> 5), can_id & 31
        if axis is None or len(data) != 8:
            return
        if command == HEARTBEAT:
            axis.errors, axis.state, axis.result = struct.unpack_from("<IBB", data)
            axis.heard = time.monotonic()
        elif command == GET_ENCODER_ESTIMATES:
            position, velocity = struct.unpack("<ff", data)
            axis.estimate = (position, velocity) if finite(position, velocity) else None
            self.note_answer(axis)
        elif command == GET_TORQUES:
            target, torque = struct.unpack("<ff", data)
            axis.torque = torque if finite(target, torque) else None
        elif command == GET_ERROR:
            axis.errors, axis.disarmed = struct.unpack("<II", data)
        elif command == GET_VERSION:
            axis.version = data[4], data[5]


CONNECTION = connecting(ODrives)
"""The `connection` of the interface."""
