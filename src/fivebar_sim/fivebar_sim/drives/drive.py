# SPDX-License-Identifier: Apache-2.0
"""One emulated drive: object dictionary, power state machine, PDOs on SYNC, heartbeats and fault injection."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Any

import can
import canopen
from canopen.sdo.exceptions import SdoAbortedError

from fivebar_sim.drives.configuration import DriveFacts
from fivebar_sim.drives.drive_network import DriveNetwork
from fivebar_sim.drives.object_dictionary import INJECT, PDO_INVALID, object_dictionary
from fivebar_sim.drives.power_state import PowerState, PowerStateMachine

TORQUE_MODE = 10

VALUE_RANGE = 0x06090030
WRONG_STATE = 0x08000022

ENCODER_EMERGENCY = 0x7305
HEARTBEAT_EMERGENCY = 0x8130
CONNECTION_EMERGENCY = 0x8100
SHORT_PDO_EMERGENCY = 0x8210
OVERSPEED_EMERGENCY = 0x8480

GENERIC_ERROR = 0x01
COMMUNICATION_ERROR = 0x11

BRAKE = 0.5
"""Torque (Nm) at the joint per rad/s with which a quick stop brakes, within 0x6072."""

AT_REST = 0.01
"""Speed (rad/s) of the joint at which a quick stop is over."""

LATE_BY = 0.005
"""Default delay (s) of PDOs under the injection LATE."""


class InjectedFault(Enum):
    """Ways to break a drive; the numbers are those of object 0x2000."""

    NONE = 0
    FAULT = 1
    LOST = 2
    FROZEN = 3
    LATE = 4
    MUTE = 5


@dataclass(frozen=True)
class PdoEntry:
    """One object in a PDO and its size in bytes."""

    index: int
    subindex: int
    size: int


class EmulatedDrive:
    """A drive in cyclic synchronous torque mode."""

    def __init__(self, facts: DriveFacts, bus: can.BusABC, clock: Callable[[], float]) -> None:
        """Boot the drive."""
        self._facts = facts
        self._clock = clock
        self.network = DriveNetwork(bus, clock)
        node: Any = canopen.LocalNode(facts.node_id, object_dictionary(facts))
        self._node = node
        self._power = PowerStateMachine()
        # the factory default of 0x605A
        self._power.brakes = True
        self._command: bytes | None = None
        self._master_heard: float | None = None
        self._error_code = 0
        self._applied = 0
        self._counts = self._speed = 0
        self._frozen = False
        self._mode = 0
        self._node.add_write_callback(self._written)
        self._node.add_read_callback(self._reading)
        self.network.add_node(self._node)
        self._node.nmt.state = "INITIALISING"
        self._node.nmt.state = "PRE-OPERATIONAL"

    @property
    def state(self) -> PowerState:
        """The power state."""
        return self._power.state

    @property
    def operational(self) -> bool:
        """Whether PDOs are exchanged."""
        return bool(self._node.nmt.state == "OPERATIONAL")

    @property
    def angle(self) -> float:
        """The joint angle (rad) of the encoder reading (0x6064)."""
        facts = self._facts
        return (
            facts.sign * self._counts * math.tau / (facts.gear_ratio * facts.counts_per_revolution)
            + facts.home_offset_rad
        )

    @property
    def torque(self) -> float:
        """Torque (Nm) at the joint that acts until the next SYNC."""
        facts = self._facts
        return facts.sign * self._applied / 1000.0 * facts.rated_torque_nm * facts.gear_ratio

    def sense(self, angle: float, velocity: float) -> None:
        """Update the encoder with a joint angle (rad) and velocity (rad/s)."""
        if self._frozen:
            self._speed = 0
            return
        turns = self._facts.sign * self._facts.gear_ratio / math.tau
        self._counts = math.floor((angle - self._facts.home_offset_rad) * turns * self._facts.counts_per_revolution)
        self._speed = round(velocity * turns * self._facts.velocity_units_per_rev_s)

    def take(self, can_id: int, data: bytes) -> None:
        """Process a frame other than SYNC."""
        if self.network.cut:
            return
        was_operational = self.operational
        try:
            self.network.notify(can_id, bytearray(data), 0.0)
        except struct.error:
            return
        if was_operational and not self.operational and self.state is not PowerState.SWITCH_ON_DISABLED:
            self.trip(CONNECTION_EMERGENCY, COMMUNICATION_ERROR)
        if can_id == 0x700 + self._master[0]:
            self._master_heard = self._clock()
        elif self.operational and can_id == self._pdo_id(0x1400):
            self._take_command(data)

    def answer_sync(self) -> None:
        """Send the TPDOs, then apply the command received since the last SYNC."""
        if self.network.cut or not self.operational:
            self._applied = 0
            return
        for number in range(3):
            if self._pdo_id(0x1800 + number) is not None:
                entries = self._entries(0x1A00 + number)
                content = b"".join(self._node.get_data(entry.index, entry.subindex) for entry in entries)
                self.network.send_message(self._pdo_id(0x1800 + number) or 0, content)
        command, self._command = self._command, None
        if command is not None:
            for entry in self._entries(0x1600):
                self._node.set_data(entry.index, entry.subindex, command[: entry.size])
                command = command[entry.size :]
        self._applied = self._torque_to_apply()

    def tend(self, now: float) -> None:
        """Send heartbeats and monitor that of the master."""
        self.network.tend(now)
        _, timeout = self._master
        if self._master_heard is not None and timeout > 0.0 and now - self._master_heard > timeout:
            self._master_heard = None
            self.trip(HEARTBEAT_EMERGENCY, COMMUNICATION_ERROR)

    def trip(self, code: int, register: int = GENERIC_ERROR) -> None:
        """Enter the fault state without torque and send an emergency message."""
        self._power.trip()
        self._applied = 0
        self._error_code = code
        self._node.data_store.setdefault(0x1001, {})[0] = bytes((register,))
        self._node.emcy.send(code, register)

    def inject(self, injection: InjectedFault, seconds: float = LATE_BY, code: int = ENCODER_EMERGENCY) -> None:
        """Break the drive, or mend it with NONE; a latched fault stays until it is reset.

        Args:
            injection: how it is broken.
            seconds: by which PDOs are late.
            code: emergency code of a fault.
        """
        if injection is InjectedFault.FAULT:
            self.trip(code)
            return
        self.network.cut = injection is InjectedFault.LOST
        self._frozen = injection is InjectedFault.FROZEN
        self.network.mute = injection is InjectedFault.MUTE
        self.network.delay = seconds if injection is InjectedFault.LATE else 0.0

    def _take_command(self, data: bytes) -> None:
        if len(data) == sum(entry.size for entry in self._entries(0x1600)):
            self._command = data
        else:
            # a warning: the last command stays
            self._node.emcy.send(SHORT_PDO_EMERGENCY, COMMUNICATION_ERROR)

    def _torque_to_apply(self) -> int:
        limit = self._number(0x6072)
        if self.state is PowerState.QUICK_STOP:
            return max(-limit, min(limit, self._braking()))
        if self.state is not PowerState.ENABLED or self._mode != TORQUE_MODE:
            return 0
        return max(-limit, min(limit, self._number(0x6071)))

    def _braking(self) -> int:
        """Return the torque of a quick stop in units of 0x6071, 0 once the motor is at rest."""
        facts = self._facts
        speed = self._speed / facts.velocity_units_per_rev_s * math.tau / facts.gear_ratio
        if abs(speed) < AT_REST:
            self._power.come_to_rest()
            return 0
        return -round(1000.0 * BRAKE * speed / (facts.rated_torque_nm * facts.gear_ratio))

    def _number(self, index: int, subindex: int = 0) -> int:
        raw = self._node.get_data(index, subindex)
        entry = self._node.object_dictionary[index]
        variable = entry if subindex == 0 and not hasattr(entry, "subindices") else entry[subindex]
        return int(variable.decode_raw(raw))

    @property
    def _master(self) -> tuple[int, float]:
        """Node id of the master and its heartbeat timeout (s), 0 for none."""
        entry = self._number(0x1016, 1)
        return entry >> 16 & 0x7F, (entry & 0xFFFF) / 1e3

    def _pdo_id(self, communication: int) -> int | None:
        """The CAN id of a PDO, None while it is disabled."""
        can_id = self._number(communication, 1)
        return None if can_id & PDO_INVALID else can_id & 0x7FF

    def _entries(self, mapping: int) -> list[PdoEntry]:
        words = [self._number(mapping, number) for number in range(1, self._number(mapping, 0) + 1)]
        return [PdoEntry(word >> 16, word >> 8 & 0xFF, (word & 0xFF) // 8) for word in words]

    def _reading(self, index: int, **_: Any) -> int | None:
        readings = {
            0x603F: self._error_code,
            0x6041: self._power.statusword,
            0x6061: self._mode,
            0x6064: self._counts,
            0x606C: self._speed,
            0x6077: self._applied,
        }
        return readings.get(index)

    def _written(self, index: int, subindex: int, data: bytes, **_: Any) -> None:
        value = int.from_bytes(data, "little")
        if index == 0x605A:
            option = self._node.object_dictionary[index].decode_raw(data)
            self._power.brakes, self._power.stays = option != 0, option in (5, 6, 7)
        elif index == 0x6040:
            if self._power.control(value):
                self._error_code = 0
                self._node.data_store.setdefault(0x1001, {})[0] = b"\x00"
                self._node.emcy.send(0)
        elif index == 0x6060:
            if value != TORQUE_MODE:
                raise SdoAbortedError(VALUE_RANGE)
            self._mode = value
        elif index == INJECT:
            if value not in {injection.value for injection in InjectedFault}:
                raise SdoAbortedError(VALUE_RANGE)
            self.inject(InjectedFault(value))
        elif 0x1600 <= index < 0x1700 or 0x1A00 <= index < 0x1B00:
            self._check_mapping(index, subindex)

    def _check_mapping(self, mapping: int, subindex: int) -> None:
        """Refuse to map while the PDO is valid, or objects while their count is not 0, as CiA 301 asks."""
        if self._pdo_id(mapping - 0x200) is not None or (subindex and self._number(mapping, 0)):
            raise SdoAbortedError(WRONG_STATE)
