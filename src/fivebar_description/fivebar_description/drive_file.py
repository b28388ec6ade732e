# SPDX-License-Identifier: Apache-2.0
"""Common keys of the bridge's configuration of bus and drives and of the file of the emulated drives.

Each side reads a file of its own, as on a real robot, so that each checks the other; what a key means and which values
it takes stands here once.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from fivebar_description.physical_bounds import Positive
from fivebar_description.strict_yaml import StrictModel

NodeId = Annotated[int, Field(ge=1, le=127)]
Unsigned32 = Annotated[int, Field(ge=0, le=0xFFFFFFFF)]
SyncPeriod = Annotated[int, Field(ge=500, le=100_000)]

SYNC_PERIOD_US = 2000
"""Default period of SYNC (us)."""


class CanChannel(StrictModel):
    """A CAN interface.

    `channel` is the network device for socketcan ("can0"), an IPv4 multicast address for udp_multicast, and any word
    for virtual.
    """

    interface: Literal["socketcan", "udp_multicast", "virtual"]
    channel: Annotated[str, Field(min_length=1)]
    port: Annotated[int, Field(ge=1024, le=65535)] = 43113


class DriveMotor(StrictModel):
    """One drive with its motor and encoder.

    Attributes:
        node_id: CANopen node id.
        counts_per_revolution: encoder counts (0x6064) per revolution of the motor.
        gear_ratio: motor revolutions per revolution of the joint; 1 for a direct drive.
        sign: +1 where counts grow with the joint angle, else -1.
        home_offset_rad: joint angle where 0x6064 reads 0.
        rated_torque_nm: rated torque at the motor shaft; 0x6076 has it in mNm.
        velocity_units_per_rev_s: value of 0x606C at one motor revolution per second: 60 for rpm,
            counts_per_revolution for counts per second.
    """

    node_id: NodeId
    counts_per_revolution: Annotated[int, Field(ge=1, le=2**31 - 1)]
    gear_ratio: Positive = 1.0
    sign: Literal[1, -1] = 1
    home_offset_rad: Annotated[float, Field(ge=-100.0, le=100.0)] = 0.0
    rated_torque_nm: Positive
    velocity_units_per_rev_s: Positive
