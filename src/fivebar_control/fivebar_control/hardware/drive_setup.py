# SPDX-License-Identifier: Apache-2.0
"""Setting up one drive over SDO: identity, mode 10, limits, PDO mapping, heartbeats."""

from __future__ import annotations

import struct
import time
from typing import NamedTuple, NoReturn, Protocol

from canopen.sdo.exceptions import SdoAbortedError, SdoCommunicationError

from fivebar_control.fault import Fault
from fivebar_control.hardware.configuration import DriveFile
from fivebar_control.hardware.drive_link import DriveLink
from fivebar_control.hardware.fault import DriveError
from fivebar_control.hardware.frames import COMMAND_BASE, STATUS_BASE, TORQUE_BASE

CYCLIC_SYNCHRONOUS_TORQUE = 10
"""Mode of operation, 0x6060."""

FAULT_ON_CONNECTION_LOSS = 1
"""Abort connection option code, 0x6007."""

EVERY_SYNC = 1
"""Transmission type of a PDO."""

NOT_VALID = 1 << 31
"""Bit of a PDO's id that switches the PDO off."""

RATED_TORQUE_TOLERANCE = 0.01
"""Relative difference between the configured rated torque and 0x6076 that is taken for rounding."""

NO_SUCH_OBJECT = (0x06020000, 0x06090011)


class Sdo(Protocol):
    """The part of canopen's SDO client that is used."""

    def upload(self, index: int, subindex: int) -> bytes:
        """Read an object."""

    def download(self, index: int, subindex: int, data: bytes, force_segment: bool = False) -> None:
        """Write an object."""


class Pdo(NamedTuple):
    """A PDO: its communication and mapping objects, its id, and what it carries (index << 16 | sub << 8 | bits)."""

    communication: int
    mapping: int
    can_id: int
    entries: tuple[int, ...]


class DriveSetup:
    """Sets up one drive; every refusal is a DriveError that names drive and object."""

    def __init__(self, sdo: Sdo, link: DriveLink, drives: DriveFile) -> None:
        """Prepare the set-up of the drive that `link` belongs to."""
        self._sdo = sdo
        self._link = link
        self._drives = drives
        self.notes: list[str] = []
        """Optional objects that the drive does not have."""

    def run(self) -> None:
        """Check and write everything, in pre-operational state.

        Raises:
            DriveError: the drive is missing, is another one than expected, or refuses an object.
        """
        self._check_identity()
        self._check_rated_torque()
        self._write(0x6071, 0, "<h", 0)
        self._write(0x6040, 0, "<H", 0)
        self._select_mode()
        self._write(0x6072, 0, "<H", self._link.scale.torque_limit)
        self._write_interpolation_period()
        self._write_optional(0x6007, 0, "<h", FAULT_ON_CONNECTION_LOSS)
        self._write_optional(0x605A, 0, "<h", self._link.drive.quick_stop_option)
        self._map_pdos()
        drive, master = self._link.drive, self._drives.master
        self._write(0x1016, 1, "<I", master.node_id << 16 | master.timeout_ms)
        self._write(0x1017, 0, "<H", drive.heartbeat_ms)

    def _check_identity(self) -> None:
        identity = self._link.drive.identity
        vendor, product = self._read(0x1018, 1, "<I"), self._read(0x1018, 2, "<I")
        if identity is not None and (vendor, product) != (identity.vendor, identity.product):
            self._fail(
                "drive_identity",
                f"0x1018 says vendor 0x{vendor:08X}, product 0x{product:08X}, expected 0x{identity.vendor:08X},"
                f" 0x{identity.product:08X}",
            )

    def _check_rated_torque(self) -> None:
        rated, configured = self._read(0x6076, 0, "<I") / 1e3, self._link.drive.rated_torque_nm
        if abs(rated - configured) > RATED_TORQUE_TOLERANCE * configured:
            self._fail("drive_scale", f"0x6076 says a rated torque of {rated:g} Nm, the configuration {configured:g}")

    def _select_mode(self) -> None:
        self._write(0x6060, 0, "<b", CYCLIC_SYNCHRONOUS_TORQUE)
        end = time.monotonic() + self._drives.sdo_timeout_ms / 1e3
        # each read is an exchange on the bus, which paces this loop
        while (mode := self._read(0x6061, 0, "<b")) != CYCLIC_SYNCHRONOUS_TORQUE:
            if time.monotonic() > end:
                self._fail("drive_mode", f"0x6061 says mode {mode}, expected 10 (cyclic synchronous torque)")

    def _write_interpolation_period(self) -> None:
        """Write the SYNC period as mantissa and power of ten (0x60C2), where the drive has the object."""
        mantissa, exponent = self._drives.sync_period_us, -6
        while mantissa % 10 == 0:
            mantissa, exponent = mantissa // 10, exponent + 1
        if mantissa <= 0xFF and self._write_optional(0x60C2, 1, "<B", mantissa):
            self._write_optional(0x60C2, 2, "<b", exponent)

    def _map_pdos(self) -> None:
        node = self._link.drive.node_id
        effort = (0x60770010, 0x606C0020) if self._link.drive.velocity_in_pdo else (0x60770010,)
        used = (
            Pdo(0x1400, 0x1600, COMMAND_BASE + node, (0x60400010, 0x60710010)),
            Pdo(0x1800, 0x1A00, STATUS_BASE + node, (0x60410010, 0x60640020)),
            Pdo(0x1801, 0x1A01, TORQUE_BASE + node, effort),
        )
        for pdo in used:
            self._map(pdo)
        for communication in (0x1401, 0x1402, 0x1403, 0x1802, 0x1803):
            self._switch_off(communication)

    def _map(self, pdo: Pdo) -> None:
        self._write(pdo.communication, 1, "<I", pdo.can_id | NOT_VALID)
        self._write(pdo.communication, 2, "<B", EVERY_SYNC)
        self._write(pdo.mapping, 0, "<B", 0)
        for number, entry in enumerate(pdo.entries, 1):
            self._write(pdo.mapping, number, "<I", entry)
        self._write(pdo.mapping, 0, "<B", len(pdo.entries))
        self._write(pdo.communication, 1, "<I", pdo.can_id)

    def _switch_off(self, communication: int) -> None:
        """Keep a PDO that the drive came with off the bus; a drive without it has nothing to switch off."""
        try:
            (can_id,) = struct.unpack("<I", self._sdo.upload(communication, 1))
            if not can_id & NOT_VALID:
                self._sdo.download(communication, 1, struct.pack("<I", can_id | NOT_VALID))
        except (SdoAbortedError, struct.error) as error:
            self.notes.append(f"{self._link.place}: 0x{communication:04X}: {error}")
        except SdoCommunicationError as error:
            self._missing(error)

    def _read(self, index: int, subindex: int, form: str) -> int:
        try:
            data = self._sdo.upload(index, subindex)
            return int(struct.unpack(form, data)[0])
        except (SdoAbortedError, struct.error) as error:
            self._fail("drive_setup", f"reading 0x{index:04X}:{subindex:02X}: {error}")
        except SdoCommunicationError as error:
            self._missing(error)

    def _write(self, index: int, subindex: int, form: str, value: int) -> None:
        try:
            self._sdo.download(index, subindex, struct.pack(form, value))
        except SdoAbortedError as error:
            self._fail("drive_setup", f"writing {value} to 0x{index:04X}:{subindex:02X}: {error}")
        except SdoCommunicationError as error:
            self._missing(error)

    def _write_optional(self, index: int, subindex: int, form: str, value: int) -> bool:
        try:
            self._sdo.download(index, subindex, struct.pack(form, value))
        except SdoAbortedError as error:
            if error.code not in NO_SUCH_OBJECT:
                self._fail("drive_setup", f"writing {value} to 0x{index:04X}:{subindex:02X}: {error}")
            self.notes.append(f"{self._link.place}: 0x{index:04X}:{subindex:02X}: {error}")
            return False
        except SdoCommunicationError as error:
            self._missing(error)
        return True

    def _missing(self, error: Exception) -> NoReturn:
        self._fail("drive_missing", str(error))

    def _fail(self, name: str, detail: str) -> NoReturn:
        raise DriveError(Fault(name, f"{self._link.place}: {detail}"))
