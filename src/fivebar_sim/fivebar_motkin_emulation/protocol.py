# SPDX-License-Identifier: Apache-2.0
"""The board's side of its USB protocol, version 2: reading command frames, writing state frames.

Written from the protocol's figures, independently of the driver that is its client in the tests: little endian, two
magic bytes, a type, the version and the length of the frame, and the exclusive or of all bytes before the last one.
"""

from __future__ import annotations

import functools
import math
import operator
import struct
from typing import NamedTuple

MAGIC = b"\xa5\x5a"
VERSION = 2
COMMAND, STATE = ord("C"), ord("S")

HEAD = struct.Struct("<2sBBB")
"""Magic bytes, type, version, length of the frame."""

COMMAND_BODY = struct.Struct("<IBH10f")
STATE_BODY = struct.Struct("<HIIf10fB")
COMMAND_LENGTH = HEAD.size + COMMAND_BODY.size + 1
STATE_LENGTH = HEAD.size + STATE_BODY.size + 1

CONTROL_FAULT = 1 << 2
CAUSE_SHIFT = 3

CAUSES = {
    0: "unspecified",
    1: "motor driver",
    2: "current feedback",
    3: "ADC frame skipped",
    4: "ADC frame out of step with the PWM",
    5: "encoder of motor 0",
    6: "encoder of motor 1",
    7: "control result not finite",
    8: "PWM output late",
    9: "emergency stop button",
}
"""Causes of a control fault by number."""

BUTTON = 9


class MotorCommand(NamedTuple):
    """Set points of a motor: i = current + kp (angle - q) + kd (speed - v), in A, rad and s."""

    kp: float
    kd: float
    current: float
    angle: float
    speed: float


class CommandFrame(NamedTuple):
    """One command frame: bit i of `enabled` lets current into motor i; with a timeout of 0 ms no watchdog runs."""

    number: int
    enabled: int
    timeout_ms: int
    motors: tuple[MotorCommand, MotorCommand]


class MotorState(NamedTuple):
    """The reported state of a motor, in rad, rad/s and A."""

    angle: float
    speed: float
    raw_speed: float
    current: float
    target: float


class StateFrame(NamedTuple):
    """One state frame: its own number, and that of the newest command."""

    sequence: int
    time_us: int
    answered: int
    loop_us: float
    motors: tuple[MotorState, MotorState]
    flags: int


def fault_flags(cause: int) -> int:
    """Return the bits of a control fault."""
    return CONTROL_FAULT | cause << CAUSE_SHIFT


def checksum(data: bytes) -> int:
    """Return the exclusive or of all bytes."""
    return functools.reduce(operator.xor, data, 0)


def write_state(state: StateFrame) -> bytes:
    """Return the frame of a state."""
    head = HEAD.pack(MAGIC, STATE, VERSION, STATE_LENGTH)
    numbers = (number for motor in state.motors for number in motor)
    body = STATE_BODY.pack(
        state.sequence & 0xFFFF, state.time_us & 0xFFFFFFFF, state.answered, state.loop_us, *numbers, state.flags
    )
    frame = head + body
    return frame + bytes((checksum(frame),))


class CommandReader:
    """Finds command frames in a stream of bytes, and skips everything else."""

    def __init__(self) -> None:
        self._buffer = bytearray()
        self.refused = 0
        """Frames with a wrong checksum, or with a number that is not finite."""

    def read(self, data: bytes) -> list[CommandFrame]:
        """Return the commands that more bytes complete."""
        self._buffer += data
        commands: list[CommandFrame] = []
        while True:
            start = self._buffer.find(MAGIC)
            # the last byte may be the first half of the magic
            del self._buffer[: start if start >= 0 else max(0, len(self._buffer) - 1)]
            if start < 0 or len(self._buffer) < COMMAND_LENGTH:
                return commands
            if self._buffer[: HEAD.size] != HEAD.pack(MAGIC, COMMAND, VERSION, COMMAND_LENGTH):
                del self._buffer[0]
                continue
            command = self._command(bytes(self._buffer[:COMMAND_LENGTH]))
            if command is None:
                self.refused += 1
                del self._buffer[0]
            else:
                del self._buffer[:COMMAND_LENGTH]
                commands.append(command)

    @staticmethod
    def _command(frame: bytes) -> CommandFrame | None:
        number, enabled, timeout_ms, *numbers = COMMAND_BODY.unpack_from(frame, HEAD.size)
        if checksum(frame[:-1]) != frame[-1] or not all(map(math.isfinite, numbers)):
            return None
        return CommandFrame(number, enabled, timeout_ms, (MotorCommand(*numbers[:5]), MotorCommand(*numbers[5:])))
