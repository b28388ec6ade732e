"""Load of the CAN bus."""

from __future__ import annotations

from fivebar_control.hardware.configuration import MICROSECONDS, DriveFile

COMMAND_BYTES = 4
STATUS_BYTES = 6


def frame_bits(data_bytes: int) -> int:
    """Return the longest time, in bits, that a data frame with an 11-bit id takes.

    47 bits of frame and gap besides the data; after every 4 equal bits (5 with the stuffed one before) of the
    34 + 8 n that are stuffed, another bit may be stuffed.
    """
    return 47 + 8 * data_bytes + (34 + 8 * data_bytes - 1) // 4


def cycle_bits(drives: DriveFile) -> int:
    """Return the bits of one control cycle: SYNC, and per drive a command, a status and an effort frame."""
    bits = frame_bits(0)
    for drive in drives.pair:
        effort_bytes = 6 if drive.velocity_in_pdo else 2
        bits += frame_bits(COMMAND_BYTES) + frame_bits(STATUS_BYTES) + frame_bits(effort_bytes)
    return bits


def bus_load(drives: DriveFile) -> float:
    """Return the share of the bus, 0 to 1, that cycles and heartbeats take at most."""
    per_second = cycle_bits(drives) * MICROSECONDS / drives.sync_period_us
    for period in (drives.master.heartbeat_ms, *(drive.heartbeat_ms for drive in drives.pair)):
        per_second += frame_bits(1) * 1e3 / period
    return per_second / drives.bus.bitrate
