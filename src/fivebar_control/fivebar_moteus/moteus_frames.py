# SPDX-License-Identifier: Apache-2.0
"""Frames to and from a moteus drive, made and read by the vendor's library.

Only its functions without input or output are used: its transports are for asyncio, wait without a limit, and take an
answer to an earlier command for one to the last.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar, NamedTuple

import can
import moteus
from moteus.multiplex import NOP, STREAM_SERVER_DATA, StreamSubframe, parse_frame
from moteus.protocol import Mode, Register, parse_registers

__all__ = ["BROADCAST", "TAGS", "BusFrame", "DriveFrames", "Mode", "Register", "registers_in", "sender", "text_in"]

BROADCAST = 0x7F
"""The id that every drive answers to."""

WITH_ANSWER = 0x8000
"""Bit of the id on the bus that asks for an answer."""

NO_LIMIT = -1.0
"""A limit of a trajectory that does not hold, nor does the configured one."""

TAGS, TAG_STEP = 8, 1.0 / 1024.0
"""Number of tags by which answers are told apart, and by how much (relative) each lengthens the watchdog's time."""

CHANNEL, TEXT_AT_ONCE = 1, 48
"""The channel of the diagnostic protocol, and how many characters of it a frame asks for."""


class BusFrame(NamedTuple):
    """Id on the bus, and data."""

    can_id: int
    data: bytes


class _Queried(moteus.QueryResolution):
    """The values of every answer: mode, motion, torque, voltage, temperature, fault, and the tag of the command."""

    _extra: ClassVar = {Register.COMMAND_TIMEOUT: moteus.F32}


class _Compact(moteus.PositionResolution):
    """Torques and the watchdog's time as they are; the rest is zero or not a number, for which a byte is enough."""

    position = velocity = kp_scale = kd_scale = ilimit_scale = velocity_limit = accel_limit = moteus.INT8


class DriveFrames:
    """Makes the frames to one drive, which is to answer all of them."""

    def __init__(self, number: int, torque_limit: float = 0.0, watchdog: float = 0.0) -> None:
        """Make frames to the drive of that number on the bus.

        Args:
            number: its id.
            torque_limit: largest torque (Nm) that it may give.
            watchdog: time (s) after which it takes its torque by itself, without another command.
        """
        self._number = number
        self._limit, self._watchdog = torque_limit, watchdog
        self._made = moteus.Controller(id=number, query_resolution=_Queried(), position_resolution=_Compact())
        self.stop = self._framed(self._made.make_stop(query=True).data)
        """Takes the power, and clears a fault."""
        self.query = self._framed(self._made.make_query().data)
        """Asks how it is, and changes nothing."""
        versions = {Register.FIRMWARE_VERSION: moteus.INT32, Register.REGISTER_MAP_VERSION: moteus.INT32}
        states = {Register.HOME_STATE: moteus.INT8, Register.ENCODER_VALIDITY: moteus.INT8}
        self.identify = self._framed(self._made.make_custom_query(states | versions).data)
        """Asks for firmware, register map and the state of the encoders."""
        self.poll = self._framed(self._made.make_diagnostic_read(TEXT_AT_ONCE, CHANNEL).data)
        """Asks for what the diagnostic protocol has to say."""

    def torque(self, torque: float, tag: int) -> BusFrame:
        """Return the command to follow a torque (Nm), without any other loop, whose answer has a tag from 0 on."""
        command = self._made.make_position(
            position=math.nan,
            velocity=0.0,
            feedforward_torque=torque,
            kp_scale=0.0,
            kd_scale=0.0,
            ilimit_scale=0.0,
            maximum_torque=self._limit,
            # the protocol has no number of a command, but a drive repeats this time
            watchdog_timeout=self._watchdog * (1.0 + TAG_STEP * tag),
            # without a trajectory there is no feedforward of its acceleration
            velocity_limit=NO_LIMIT,
            accel_limit=NO_LIMIT,
            query=True,
        )
        return self._framed(command.data)

    def tag_of(self, registers: Mapping[int, float]) -> int:
        """Return the tag of the command that an answer is to; -1 for one without."""
        time = registers.get(Register.COMMAND_TIMEOUT, 0.0)
        return round((time / self._watchdog - 1.0) / TAG_STEP) if self._watchdog and math.isfinite(time) else -1

    def say(self, line: str) -> BusFrame:
        """Return a line of the diagnostic protocol; to this frame alone there is no answer."""
        data = self._made.make_diagnostic_write(f"{line}\n".encode("ascii"), CHANNEL).data
        return BusFrame(self._number, padded(data))

    def _framed(self, data: bytes) -> BusFrame:
        return BusFrame(self._number | WITH_ANSWER, padded(data))


def padded(data: bytes) -> bytes:
    """Return data padded to a length that CAN FD has, with bytes that mean nothing."""
    return data.ljust(can.util.dlc2len(can.util.len2dlc(len(data))), bytes((NOP,)))


def sender(can_id: int) -> int | None:
    """Return which drive has sent a frame to us, None where none has."""
    number, destination = divmod(can_id, 1 << 8)
    return number if destination == 0 and number < BROADCAST else None


def registers_in(data: bytes) -> dict[int, float]:
    """Return the registers of an answer, in the vendor's units: revolutions, seconds, Nm, V, degrees Celsius."""
    registers: dict[int, float] = parse_registers(data).response
    return registers


def text_in(data: bytes) -> bytes | None:
    """Return what an answer says in the diagnostic protocol, None where it is none of these."""
    if data[:1] != bytes((STREAM_SERVER_DATA,)):
        return None
    return b"".join(subframe.data for subframe in parse_frame(data) if isinstance(subframe, StreamSubframe))
