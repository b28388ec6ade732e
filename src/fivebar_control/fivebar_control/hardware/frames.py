# SPDX-License-Identifier: Apache-2.0
"""CAN frames of two CiA 402 drives: identifiers and decoding. Nothing in here raises."""

from __future__ import annotations

import struct
from typing import NamedTuple

from canopen.nmt import NMT_COMMANDS, NMT_STATES

from fivebar_control.hardware.configuration import Drive

NMT_ID = 0x000
SYNC_ID = 0x080
EMERGENCY_BASE = 0x080
STATUS_BASE = 0x180
TORQUE_BASE = 0x280
COMMAND_BASE = 0x200
SDO_ANSWER_BASE = 0x580
SDO_REQUEST_BASE = 0x600
HEARTBEAT_BASE = 0x700

NMT_START = NMT_COMMANDS["OPERATIONAL"]
NMT_PRE_OPERATIONAL = NMT_COMMANDS["PRE-OPERATIONAL"]

BOOT_UP, STOPPED, OPERATIONAL, PRE_OPERATIONAL = 0x00, 0x04, 0x05, 0x7F
"""NMT states as a heartbeat carries them; `canopen` knows two more, of no CiA 301 device."""

NMT_NAMES = {BOOT_UP: "boot-up"} | {
    state: NMT_STATES[state].lower() for state in (STOPPED, OPERATIONAL, PRE_OPERATIONAL)
}
"""Boot-up is the message that a node sends once, when it has started."""

_STATUS = struct.Struct("<Hi")
_TORQUE = struct.Struct("<h")
_TORQUE_AND_VELOCITY = struct.Struct("<hi")
_COMMAND = struct.Struct("<Hh")
_EMERGENCY = struct.Struct("<HB5s")
SDO_LENGTH = 8


class Status(NamedTuple):
    """TPDO 1: statusword (0x6041) and position (0x6064, counts) of drive 0 or 1."""

    drive: int
    statusword: int
    counts: int


class Effort(NamedTuple):
    """TPDO 2: torque (0x6077) and, where mapped, velocity (0x606C), raw, of drive 0 or 1."""

    drive: int
    torque: int
    velocity: int | None


class Heartbeat(NamedTuple):
    """The NMT state that drive 0 or 1 announces."""

    drive: int
    state: int


class Emergency(NamedTuple):
    """An EMCY of drive 0 or 1."""

    drive: int
    code: int
    register: int
    own: bytes


class SdoAnswer(NamedTuple):
    """An answer to a set-up request of drive 0 or 1."""

    drive: int


class Malformed(NamedTuple):
    """A frame that must not be used: an id that nobody should send, or a known one with other contents."""

    known: bool


class MastersOwn(NamedTuple):
    """A frame that only the master sends: our own one echoed, or that of a second master."""


Frame = Status | Effort | Heartbeat | Emergency | SdoAnswer | MastersOwn | Malformed


class FrameReader:
    """Decodes frames of the two drives."""

    def __init__(self, drives: tuple[Drive, Drive], master: int) -> None:
        """Make a reader for two drives and the node id of the master."""
        self._kinds: dict[int, tuple[int, int]] = {}
        self._own = {NMT_ID, SYNC_ID, HEARTBEAT_BASE + master}
        self._own |= {base + drive.node_id for base in (COMMAND_BASE, SDO_REQUEST_BASE) for drive in drives}
        for number, drive in enumerate(drives):
            for base in (STATUS_BASE, TORQUE_BASE, HEARTBEAT_BASE, EMERGENCY_BASE, SDO_ANSWER_BASE):
                self._kinds[base + drive.node_id] = (base, number)
        self._efforts = tuple(_TORQUE_AND_VELOCITY if drive.velocity_in_pdo else _TORQUE for drive in drives)

    def read(self, can_id: int, data: bytes) -> Frame:
        """Return a decoded data frame with an 11-bit id."""
        base, drive = self._kinds.get(can_id, (-1, 0))
        if base == STATUS_BASE and len(data) == _STATUS.size:
            return Status(drive, *_STATUS.unpack(data))
        if base == TORQUE_BASE and len(data) == self._efforts[drive].size:
            torque, *velocity = self._efforts[drive].unpack(data)
            return Effort(drive, torque, velocity[0] if velocity else None)
        if base == HEARTBEAT_BASE and len(data) == 1 and data[0] in NMT_NAMES:
            return Heartbeat(drive, data[0])
        if base == EMERGENCY_BASE and len(data) == _EMERGENCY.size:
            return Emergency(drive, *_EMERGENCY.unpack(data))
        if base == SDO_ANSWER_BASE and len(data) == SDO_LENGTH:
            return SdoAnswer(drive)
        return MastersOwn() if can_id in self._own else Malformed(known=base >= 0)


def command_data(controlword: int, torque: int) -> bytes:
    """Return the data of RPDO 1: controlword (0x6040) and raw target torque (0x6071)."""
    return _COMMAND.pack(controlword, torque)
