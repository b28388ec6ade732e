# SPDX-License-Identifier: Apache-2.0
"""One emulated drive by itself: what its encoder says, and when it gives torque."""

from __future__ import annotations

import math
from collections.abc import Iterator
from uuid import uuid4

import can
import pytest
from emulation_file import load_emulation

from fivebar_sim.drives.drive import EmulatedDrive
from fivebar_sim.drives.power_state import PowerState

COUNTS, GEAR, OFFSET, UNITS = 1000, 5.0, 0.3, 600.0


@pytest.fixture
def bus() -> Iterator[can.BusABC]:
    with can.Bus(interface="virtual", channel=uuid4().hex) as bus:
        yield bus


def geared(bus: can.BusABC, sign: int) -> EmulatedDrive:
    facts = load_emulation("dextar_emulated").pair[0].model_copy(
        update={
            "counts_per_revolution": COUNTS, "gear_ratio": GEAR, "home_offset_rad": OFFSET, "sign": sign,
            "velocity_units_per_rev_s": UNITS,
        }
    )  # fmt: skip
    return EmulatedDrive(facts, bus, lambda: 0.0)


def read(drive: EmulatedDrive, index: int) -> int:
    """Return an object of 32 bits as an SDO upload would."""
    return int.from_bytes(drive._node.get_data(index, 0), "little", signed=True)


def write(drive: EmulatedDrive, index: int, value: int) -> None:
    """Write an object of 16 bits by an expedited SDO download."""
    size = 0x2F if index == 0x6060 else 0x2B
    drive.take(0x601, bytes((size, index & 0xFF, index >> 8, 0)) + value.to_bytes(4, "little"))


@pytest.mark.parametrize("sign", [1, -1])
def test_the_encoder_counts_what_the_motor_turns_and_rounds_down(bus: can.BusABC, sign: int) -> None:
    """Five turns of the motor per turn of the joint, from the home offset on, in the motor's direction."""
    drive = geared(bus, sign)
    for joint in (OFFSET, 0.31, -0.4, 2.0):
        drive.sense(joint, 0.7)
        turned = sign * (joint - OFFSET) * GEAR / (2.0 * math.pi) * COUNTS
        assert read(drive, 0x6064) == math.floor(turned + 1e-9)
        # what the joint is known to be from that: up to a count short in the motor's direction
        assert 0.0 <= sign * (joint - drive.angle) + 1e-12 < 2.0 * math.pi / (GEAR * COUNTS)
        assert read(drive, 0x606C) == pytest.approx(sign * 0.7 * GEAR / (2.0 * math.pi) * UNITS, abs=0.5)


def test_torque_is_given_where_the_drive_is_enabled_in_torque_mode_only(bus: can.BusABC) -> None:
    drive = geared(bus, 1)
    drive.take(0x000, bytes((1, 1)))
    assert drive.operational
    write(drive, 0x6071, 100)
    states = []
    for controlword in (0x06, 0x07, 0x0F):
        write(drive, 0x6040, controlword)
        drive.answer_sync()
        states.append(drive.state)
        assert drive.torque == 0.0
    assert states == [PowerState.READY, PowerState.SWITCHED_ON, PowerState.ENABLED]
    write(drive, 0x6060, 10)
    drive.answer_sync()
    # 10 % of 2 Nm over the gear
    assert drive.torque == pytest.approx(0.1 * 2.0 * GEAR)
    write(drive, 0x6040, 0x07)
    drive.answer_sync()
    assert drive.state is PowerState.SWITCHED_ON
    assert drive.torque == 0.0
