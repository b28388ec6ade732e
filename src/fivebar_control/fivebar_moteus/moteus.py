# SPDX-License-Identifier: Apache-2.0
"""Two moteus drives (r4, c1, n1, x1) on one CAN FD bus, as a `MotorDriver`.

A drive is commanded in its position mode with all gains at zero, so that only the torque of the command is left. Angles
are in revolutions of the drive's output.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Literal

import can

from fivebar_control.fault import Fault
from fivebar_control.hardware.can_pair import ANSWER_TIMEOUT, CanPair, DriveOnBus, finite
from fivebar_control.hardware.can_port import open_bus, opened
from fivebar_control.hardware.configuration import Bus
from fivebar_control.hardware.fault import DriveError
from fivebar_control.hardware.motors_file import DrivenMotor, MotorsFile
from fivebar_control.hardware.two_motors import PairAnswer, PairCommand, ShaftReading, connecting
from fivebar_description.interface import ACTIVE_JOINTS
from fivebar_description.physical_bounds import Positive
from fivebar_description.strict_yaml import validate
from fivebar_moteus.fdcanusb import FdcanusbBus
from fivebar_moteus.moteus_faults import error_name
from fivebar_moteus.moteus_frames import (
    BROADCAST,
    TAGS,
    BusFrame,
    DriveFrames,
    Mode,
    Register,
    registers_in,
    sender,
    text_in,
)

FDCANUSB = "fdcanusb"
"""The interface of the vendor's adapters on their serial port."""

REGISTER_MAP = 5

OLDEST_FIRMWARE, NEWEST_FIRMWARE = 0x00010E, 0x01FFFF
"""ABI of the releases 1.x, and of the last one before them, which differs in nothing but its number."""

LOWEST_VOLTAGE = 10.0
"""Supply (V) from which on all of these boards work; they report a fault by themselves below 4 V only."""

ROTOR_RATIO = "motor_position.rotor_to_output_ratio"

DISARMS = "servo.timeout_mode"

TORQUE_SETTINGS = {
    DISARMS: "so that no torque is left when commands stop",
    "servo.fixed_voltage_mode": "since torques would not be followed",
    "servo.voltage_mode_control": "since torques would not be followed",
}
"""Settings that have to be 0, and why."""

CALIBRATED_SETTINGS = ("motor.poles", "motor.Kv")
"""Settings that are 0 until the motor has been calibrated."""

ENCODERS = {"motor_position.commutation_source": "commutation", "motor_position.output.source": "the position"}
"""Settings that say which encoder serves what."""

POLL_TIMEOUT, POLL_PERIOD = 0.05, 0.002
"""Longest wait (s) for one answer of the diagnostic protocol, and time between two while it has nothing to say."""

STOP_TIMEOUT, STOPS = 0.02, 3
"""Longest wait (s) until both drives have stopped when the bus is left, and how often they are told."""


class MoteusLink(Bus):
    """Section `link`; see `Bus` for the other keys. The `channel` of `fdcanusb` is a serial port.

    `rotor_to_output_ratio` is what both drives have under that name. With another one than 1 the keys of a motor, such
    as its gear ratio and its counts, are those of the drive's output.
    """

    interface: Literal["socketcan", "fdcanusb", "udp_multicast", "virtual"]  # type: ignore[assignment]
    rotor_to_output_ratio: Positive = 1.0


def open_link(link: MoteusLink) -> can.BusABC:
    """Open the bus for CAN FD, or the vendor's adapter on its serial port.

    Raises:
        DriveError: it cannot be opened.
    """
    if link.interface == FDCANUSB:
        return opened(link, lambda: FdcanusbBus(link.channel))
    return open_bus(link, fd=True)


class MoteusDrive(DriveOnBus):
    """The known state of one drive."""

    def __init__(self, motor: DrivenMotor, joint: str, watchdog: float) -> None:
        super().__init__(motor.id, joint, "id")
        self.frames = DriveFrames(motor.id, motor.shaft_torque_limit, watchdog)
        self.identity: dict[int, float] | None = None
        self.mode: float = Mode.STOPPED
        self.answer: dict[int, float] = {}
        self.tag: int | None = None
        """Tag of the answer that is awaited; None where any is taken."""
        self.text = b""
        self.polled = False


class MoteusDrives(CanPair[MoteusDrive]):
    """Both drives on an open bus."""

    def __init__(self, file: MotorsFile) -> None:
        """Open the bus, and check both drives; they get no power.

        Raises:
            DriveError: the bus cannot be opened, a drive does not answer, or it must not be used as it is.
        """
        self._link = validate(dict(file.link), MoteusLink, f"{file.name}: link")
        self._heard: set[int] = set()
        self._tag = 0
        first, second = (
            MoteusDrive(motor, joint, file.watchdog_ms / 1e3)
            for motor, joint in zip(file.pair, ACTIVE_JOINTS, strict=True)
        )
        super().__init__(open_link(self._link), (first, second), fd=True)
        try:
            self._identify()
            for drive in self.drives:
                self._check_settings(drive)
        except DriveError:
            self.close()
            raise

    def exchange(self, command: PairCommand, timeout: float) -> PairAnswer:
        """Send both drives a torque, or take their power; return the measurements that the commands found."""
        self._tag = (self._tag + 1) % TAGS
        for drive, torque in zip(self.drives, command.torques, strict=True):
            self._ask(drive, self._command(drive, command.power, torque), self._tag if command.power else None)
        self.wait_for_answers(timeout)
        with self.received:
            first, second = map(_reading, self.drives)
            powered = all(drive.mode == Mode.POSITION for drive in self.drives)
            fault = self._fault(command.power)
        return PairAnswer((first, second), powered, fault, late=self.take_late())

    def clear(self) -> None:
        """Clear the faults of both drives."""
        self._stop()

    def close(self) -> None:
        """Leave the bus, both drives stopped."""
        for _ in range(STOPS):
            self._stop()
            if self.wait_for_answers(STOP_TIMEOUT):
                break
        self.leave()

    def take(self, can_id: int, data: bytes) -> None:
        """Take a frame. Frames of other drives, and those to others, are not used."""
        number = sender(can_id)
        if number is None:
            return
        self._heard.add(number)
        drive = self.by_id.get(number)
        if drive is None:
            return
        text = text_in(data)
        if text is not None:
            drive.text += text
            drive.polled = True
            return
        registers = registers_in(data)
        if Register.FIRMWARE_VERSION in registers:
            drive.identity = registers
        elif Register.MODE in registers:
            if drive.tag is not None and drive.frames.tag_of(registers) != drive.tag:
                self.note_late()
                return
            drive.mode, drive.answer = registers[Register.MODE], registers
            self.note_answer(drive)

    def _ask(self, drive: MoteusDrive, frame: BusFrame, tag: int | None = None) -> None:
        with self.received:
            drive.answer, drive.tag, drive.awaited = {}, tag, True
        self.send(*frame)

    def _stop(self) -> None:
        for drive in self.drives:
            self._ask(drive, drive.frames.stop)

    def _command(self, drive: MoteusDrive, power: bool, torque: float) -> BusFrame:
        """Return what a drive is told. One without power is only asked, since `stop` would clear its fault."""
        if power:
            return drive.frames.torque(torque, self._tag)
        return drive.frames.query if drive.mode in (Mode.STOPPED, Mode.FAULT) else drive.frames.stop

    def _fault(self, power: bool) -> Fault | None:
        for drive in self.drives:
            answer = drive.answer
            if drive.mode == Mode.FAULT:
                code = int(answer.get(Register.FAULT, 0))
                return Fault("moteus_error", f"{drive.place}: {error_name(code)}")
            if drive.mode == Mode.TIMEOUT and power:
                return Fault("moteus_watchdog", f"{drive.place}: no command in time")
            voltage = answer.get(Register.VOLTAGE, math.inf)
            if voltage < LOWEST_VOLTAGE:
                return Fault(
                    "moteus_voltage", f"{drive.place}: {voltage:.1f} V, expected at least {LOWEST_VOLTAGE:g} V"
                )
        return None

    def _identify(self) -> None:
        self.expect_both(
            lambda drive: drive.identity is not None, lambda drive: self.send(*drive.frames.identify), self._others
        )
        for drive in self.drives:
            identity = drive.identity or {}
            firmware, registers = int(identity[Register.FIRMWARE_VERSION]), int(identity[Register.REGISTER_MAP_VERSION])
            if registers != REGISTER_MAP or not OLDEST_FIRMWARE <= firmware <= NEWEST_FIRMWARE:
                version = ".".join(map(str, firmware.to_bytes(3, "big"))) if 0 <= firmware < 1 << 24 else str(firmware)
                raise DriveError(
                    Fault(
                        "moteus_firmware",
                        f"{drive.place}: firmware {version} with register map {registers}, expected 1.x with"
                        f" register map {REGISTER_MAP}",
                    )
                )

    def _others(self) -> str:
        """Return which drives answer at all, in words."""
        self.send(*DriveFrames(BROADCAST).identify)
        self.wait_for_both(lambda drive: drive.identity is not None, POLL_TIMEOUT)
        with self.received:
            heard = ", ".join(map(str, sorted(self._heard)))
        return f"; drives that answer: {heard or 'none'}"

    def _check_settings(self, drive: MoteusDrive) -> None:
        self._quieten(drive)
        for name, reason in TORQUE_SETTINGS.items():
            self._expect(drive, name, 0.0, reason)
        self._expect(drive, ROTOR_RATIO, self._link.rotor_to_output_ratio, "as link.rotor_to_output_ratio says")
        for name in CALIBRATED_SETTINGS:
            if self._setting(drive, name) == 0.0:
                raise DriveError(Fault("moteus_uncalibrated", f"{drive.place}: {name} is 0"))
        identity = drive.identity or {}
        valid = int(identity.get(Register.ENCODER_VALIDITY, 0))
        for name, use in ENCODERS.items():
            source = int(self._setting(drive, name))
            # two bits an encoder: angle and speed
            if not valid >> 2 * source & 1:
                raise DriveError(Fault("moteus_uncalibrated", f"{drive.place}: encoder {source} of {use} has no angle"))
        if not identity.get(Register.HOME_STATE, 0):
            raise DriveError(Fault("moteus_uncalibrated", f"{drive.place}: the position refers to nothing yet"))

    def _expect(self, drive: MoteusDrive, name: str, expected: float, reason: str) -> None:
        value = self._setting(drive, name)
        if not math.isclose(value, expected, rel_tol=1e-4, abs_tol=1e-9):
            raise DriveError(
                Fault("moteus_configuration", f"{drive.place}: {name} is {value:g}, expected {expected:g}, {reason}")
            )

    def _setting(self, drive: MoteusDrive, name: str) -> float:
        """Return a setting of a drive.

        Raises:
            DriveError: it does not say it.
        """
        drive.text = b""
        self.send(*drive.frames.say(f"conf get {name}"))
        said = self._said(drive, lambda text: b"\n" in text).strip()
        try:
            return float(said)
        except ValueError:
            raise DriveError(
                Fault("moteus_configuration", f"{drive.place}: {name} cannot be read, answer {said.decode('latin1')!r}")
            ) from None

    def _quieten(self, drive: MoteusDrive) -> None:
        """Have a drive say nothing of its own, and forget what it has said."""
        self.send(*drive.frames.say("tel stop"))
        self._said(drive, lambda text: text.endswith(b"OK\r\n"))

    def _said(self, drive: MoteusDrive, complete: Callable[[bytes], bool]) -> bytes:
        """Return what a drive says until that is complete, or until it has said nothing for too long."""
        end = time.monotonic() + ANSWER_TIMEOUT
        while not complete(drive.text) and time.monotonic() < end:
            drive.polled = False
            self.send(*drive.frames.poll)
            with self.received:
                self.received.wait_for(lambda: drive.polled, POLL_TIMEOUT)
                self.received.wait_for(lambda: complete(drive.text), POLL_PERIOD)
        return drive.text


def _reading(drive: MoteusDrive) -> ShaftReading | None:
    values = [
        drive.answer.get(register, math.nan) for register in (Register.POSITION, Register.VELOCITY, Register.TORQUE)
    ]
    if not finite(*values):
        return None
    turns, speed, torque = values
    return ShaftReading(math.tau * turns, math.tau * speed, torque)


CONNECTION = connecting(MoteusDrives)
"""The `connection` of the interface."""
