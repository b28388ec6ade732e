# SPDX-License-Identifier: Apache-2.0
"""Configuration of one robot's bus and drives, read from a file and validated before anything is sent."""

from __future__ import annotations

import ipaddress
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from fivebar_control.fault import Fault
from fivebar_control.hardware.fault import DriveError
from fivebar_description.drive_file import SYNC_PERIOD_US, CanChannel, DriveMotor, NodeId, SyncPeriod, Unsigned32
from fivebar_description.files import share_file, yaml_path
from fivebar_description.interface import ACTIVE_JOINTS
from fivebar_description.physical_bounds import Positive
from fivebar_description.strict_yaml import StrictModel, read_yaml

Milliseconds = Annotated[int, Field(ge=1, le=0xFFFF)]

Angle = Annotated[float, Field(ge=-100.0, le=100.0)]

MICROSECONDS = 1_000_000
"""Microseconds in a second."""

COMMAND_BYTES, STATUS_BYTES = 4, 6
"""Data of the frames that each drive gets and answers in a cycle, besides that with its effort."""

LARGEST_RAW_TORQUE = 0x7FFF
"""Largest value of 0x6071, which has 16 bits and a sign."""


class StartPosture(StrictModel):
    """Section `posture`: where the robot is said to stand when a run starts.

    Attributes:
        q11, q21: joint angles (rad).
        tolerance_rad: how far the encoders may be off.
    """

    q11: Angle
    q21: Angle
    tolerance_rad: Positive = 0.05

    def confirm(self, angles: Sequence[float], remedy: str) -> None:
        """Confirm that the robot stands there.

        Args:
            angles: joint angles (rad) of both motors.
            remedy: what to do about their encoders where it does not.

        Raises:
            DriveError: it stands elsewhere.
        """
        for joint, declared, angle in zip(ACTIVE_JOINTS, (self.q11, self.q21), angles, strict=True):
            if abs(angle - declared) > self.tolerance_rad:
                raise DriveError(
                    Fault(
                        "posture_unconfirmed",
                        f"{joint} reads {angle:.4f} rad, declared {declared:.4f} rad within {self.tolerance_rad:g}:"
                        f" move the robot to where its motion starts, or {remedy}",
                    )
                )


def check_period(key: str, period_us: int, gather_deadline_us: int) -> None:
    """Check the period of a control loop, which has a key, and how long its answers are waited for.

    Raises:
        ValueError: no whole number of periods makes a second, or the wait takes longer than one.
    """
    if MICROSECONDS % period_us:
        raise ValueError(f"{key} {period_us}: expected a divisor of {MICROSECONDS}")
    if gather_deadline_us >= period_us:
        raise ValueError(f"gather_deadline_us {gather_deadline_us}: expected less than {key} {period_us}")


class Bus(CanChannel):
    """Section `bus`: which CAN interface.

    `bitrate` (bit/s) is that of the wire; socketcan's is set by the operating system and must agree.
    """

    bitrate: Literal[125_000, 250_000, 500_000, 800_000, 1_000_000] = 1_000_000

    @model_validator(mode="after")
    def _channel_fits_interface(self) -> Self:
        if self.interface == "udp_multicast":
            try:
                good = ipaddress.IPv4Address(self.channel).is_multicast
            except ValueError:
                good = False
            if not good:
                raise ValueError(f"channel {self.channel!r}: expected an IPv4 multicast address such as 239.74.163.2")
        return self


class Master(StrictModel):
    """Section `master`: our own node, whose heartbeat the drives watch.

    A drive that has not received it for `timeout_ms` must stop by itself (0x1016).
    """

    node_id: NodeId = 127
    heartbeat_ms: Milliseconds = 20
    timeout_ms: Milliseconds = 100

    @model_validator(mode="after")
    def _timeout_leaves_room(self) -> Self:
        if self.timeout_ms < 2 * self.heartbeat_ms:
            raise ValueError(f"timeout_ms {self.timeout_ms}: expected at least twice heartbeat_ms {self.heartbeat_ms}")
        return self


class Identity(StrictModel):
    """Section `identity` of a drive: what 0x1018 must say."""

    vendor: Unsigned32
    product: Unsigned32


class Stall(StrictModel):
    """Section `stall` of a drive: this torque (Nm, at the joint) for this long (ms) must move the encoder."""

    torque_nm: Positive
    time_ms: Milliseconds


class Drive(DriveMotor):
    """One drive: how its raw values are to be read, and what it may do; see `DriveMotor` for the other keys.

    Attributes:
        identity: what its object 0x1018 must say; not checked when left out.
        torque_units_per_rated: value of 0x6071 and 0x6077 that means rated torque; 1000 for per mille.
        velocity_in_pdo: whether 0x606C comes along every cycle; without it, positions are differenced.
        torque_limit_nm: largest torque that is ever commanded, at the joint.
        quick_stop_option: what the drive does on a quick stop (0x605A): 0 torque off at once, 1 to 3 brake in its own
            way and switch off, 5 to 7 brake and stay powered. Written where the drive has the object.
        heartbeat_ms: period of the drive's heartbeat (0x1017).
        heartbeat_timeout_ms: age of its last heartbeat beyond which it counts as lost.
        stall: when an encoder counts as frozen; not watched when left out.
    """

    identity: Identity | None = None
    torque_units_per_rated: Annotated[int, Field(ge=1, le=LARGEST_RAW_TORQUE)] = 1000
    velocity_in_pdo: bool = True
    torque_limit_nm: Positive
    quick_stop_option: Literal[0, 1, 2, 3, 5, 6, 7] = 0
    heartbeat_ms: Milliseconds = 20
    heartbeat_timeout_ms: Milliseconds = 100
    stall: Stall | None = None

    @model_validator(mode="after")
    def _figures_fit_together(self) -> Self:
        if self.heartbeat_timeout_ms < 2 * self.heartbeat_ms:
            raise ValueError(
                f"heartbeat_timeout_ms {self.heartbeat_timeout_ms}: expected at least twice heartbeat_ms"
                f" {self.heartbeat_ms}"
            )
        raw = self.torque_limit_nm / self.gear_ratio / self.rated_torque_nm * self.torque_units_per_rated
        if not 1.0 <= raw <= LARGEST_RAW_TORQUE:
            raise ValueError(
                f"torque_limit_nm {self.torque_limit_nm}: is {raw:.3g} units of 0x6071, expected 1 to"
                f" {LARGEST_RAW_TORQUE}"
            )
        return self


class DrivePair(StrictModel):
    """Section `drives`: the drive of each motor joint."""

    q11: Drive
    q21: Drive


def frame_bits(data_bytes: int) -> int:
    """Return the longest time, in bits, that a data frame with an 11-bit id takes on the CAN bus.

    47 bits of frame and gap besides the data; after every 4 equal bits (5 with the stuffed one before) of the
    34 + 8 n that are stuffed, another bit may be stuffed.
    """
    return 47 + 8 * data_bytes + (34 + 8 * data_bytes - 1) // 4


USUAL_MISSING = 3
"""Cycles in a row that may be without an answer where neither a file nor a motion says how many."""


class CycledFile(StrictModel):
    """The key that all configurations of drives have in common.

    Attributes:
        missing_limit: cycles in a row without an answer beyond which it is a fault; None for what the motion bears.
    """

    missing_limit: Annotated[int, Field(ge=0, le=1000)] | None = None

    @property
    def most_missing(self) -> int:
        """Cycles in a row that may be without an answer."""
        return USUAL_MISSING if self.missing_limit is None else self.missing_limit

    def bearing(self, missing: int) -> Self:
        """Return the file for a motion that bears so many cycles without an answer, unless the file says how many."""
        return self if self.missing_limit is not None else self.model_copy(update={"missing_limit": missing})


class DriveFile(CycledFile):
    """One configuration file.

    Attributes:
        name: what people call this set-up.
        sync_period_us: period of SYNC and thus of the control loop; a whole number of them makes a second.
        gather_deadline_us: how long after SYNC the drives' answers are waited for.
        sdo_timeout_ms: longest wait for one answer while drives are set up.
        posture: where the robot must stand when a run starts; not checked when left out.
    """

    name: Annotated[str, Field(min_length=1)]
    bus: Bus
    master: Master = Master()
    sync_period_us: SyncPeriod = SYNC_PERIOD_US
    gather_deadline_us: Annotated[int, Field(ge=100, le=100_000)] = 1200
    sdo_timeout_ms: Milliseconds = 500
    posture: StartPosture | None = None
    drives: DrivePair

    @property
    def rate_hz(self) -> int:
        """The control loop's rate (Hz)."""
        return MICROSECONDS // self.sync_period_us

    @property
    def pair(self) -> tuple[Drive, Drive]:
        """The drives in the order of the motor joints."""
        return self.drives.q11, self.drives.q21

    @property
    def cycle_bits(self) -> int:
        """Bits of one control cycle: SYNC, and per drive a command, a status and an effort frame."""
        bits = frame_bits(0)
        for drive in self.pair:
            effort_bytes = 6 if drive.velocity_in_pdo else 2
            bits += frame_bits(COMMAND_BYTES) + frame_bits(STATUS_BYTES) + frame_bits(effort_bytes)
        return bits

    @property
    def bus_load(self) -> float:
        """Share of the bus that cycles and heartbeats take at most; above 1 it cannot carry them."""
        per_second = self.cycle_bits * MICROSECONDS / self.sync_period_us
        for period in (self.master.heartbeat_ms, *(drive.heartbeat_ms for drive in self.pair)):
            per_second += frame_bits(1) * 1e3 / period
        return per_second / self.bus.bitrate

    @model_validator(mode="after")
    def _bus_carries_the_cycles(self) -> Self:
        # only a real bus has a bit rate
        if self.bus.interface == "socketcan" and self.bus_load > 1.0:
            raise ValueError(
                f"sync_period_us {self.sync_period_us}: cycles and heartbeats take {self.bus_load:.0%} of a bus with"
                f" bitrate {self.bus.bitrate}: expected a longer period or a higher bit rate"
            )
        return self

    @model_validator(mode="after")
    def _sections_fit_together(self) -> Self:
        check_period("sync_period_us", self.sync_period_us, self.gather_deadline_us)
        ids = [self.master.node_id, *(drive.node_id for drive in self.pair)]
        if len(set(ids)) < len(ids):
            raise ValueError(f"drives: node ids {ids} of master, q11 and q21: expected three different ones")
        return self


def load_drives(drives: str) -> DriveFile:
    """Read a configuration by its shipped name ("dextar_emulated") or by the path of a YAML file.

    Raises:
        InputError: the file is missing or not a configuration; the text names file and key.
    """
    return read_yaml(drives_path(drives), DriveFile)


def drives_path(drives: str) -> Path:
    """Return the configuration file for a shipped name or a path.

    Raises:
        InputError: no such name.
    """
    return yaml_path("drives", drives, share_file("fivebar_control", "config", "drives"))
