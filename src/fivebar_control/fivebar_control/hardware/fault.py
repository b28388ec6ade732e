# SPDX-License-Identifier: Apache-2.0
"""The error that a fault of the hardware raises, and names for the emergency codes of CiA 301 and CiA 402."""

from __future__ import annotations

from fivebar_control.fault import Fault


class DriveError(Exception):
    """The drives cannot reach the requested state."""

    def __init__(self, fault: Fault) -> None:
        super().__init__(str(fault))
        self.fault = fault


EMERGENCY_CODES = {
    0x2310: "continuous over-current",
    0x2320: "short circuit or earth leakage",
    0x3210: "over-voltage of the DC link",
    0x3220: "under-voltage of the DC link",
    0x4310: "over-temperature of the drive",
    0x7110: "brake chopper",
    0x7121: "motor blocked",
    0x7305: "incremental encoder 1",
    0x8110: "CAN overrun, frames lost",
    0x8120: "CAN error passive",
    0x8130: "heartbeat lost",
    0x8140: "recovered from bus off",
    0x8210: "PDO too short",
    0x8220: "PDO too long",
    0x8250: "RPDO overdue",
    0x8480: "overspeed",
    0x8611: "following error",
}
"""Names of whole codes."""

EMERGENCY_CLASSES = {
    0x10: "unspecified error",
    0x20: "current",
    0x21: "input current",
    0x22: "internal current",
    0x23: "output current",
    0x30: "voltage",
    0x31: "mains voltage",
    0x32: "internal voltage",
    0x33: "output voltage",
    0x40: "temperature",
    0x41: "ambient temperature",
    0x42: "drive temperature",
    0x43: "motor temperature",
    0x50: "device hardware",
    0x60: "device software",
    0x63: "parameter set",
    0x70: "additional module",
    0x71: "motor or brake",
    0x73: "sensor",
    0x80: "monitoring",
    0x81: "communication",
    0x83: "torque control",
    0x84: "velocity control",
    0x86: "position control",
    0x87: "synchronisation",
    0x90: "external error",
    0xF0: "additional function",
    0xFF: "manufacturer's own",
}
"""Names of high bytes; one that is missing has the name of its first digit."""

ERROR_RESET = 0x0000
"""The code that says that all errors are gone."""


def emergency_name(code: int) -> str:
    """Return words for an emergency code (16 bits), the most specific ones that are known."""
    high = code >> 8
    if code in EMERGENCY_CODES:
        return EMERGENCY_CODES[code]
    return EMERGENCY_CLASSES.get(high) or EMERGENCY_CLASSES.get(high & 0xF0, "unknown error")
