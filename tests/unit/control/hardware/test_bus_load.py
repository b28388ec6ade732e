"""The load of the bus, by hand."""

from __future__ import annotations

import pytest

from fivebar_control.hardware.bus_load import bus_load, cycle_bits, frame_bits
from fivebar_control.hardware.configuration import load_drives


def test_frames_by_hand() -> None:
    # SOF 1, id 11, RTR 1, control 6, CRC 15: 34 bits that are stuffed; 13 more that are not
    assert frame_bits(0) == 34 + 13 + 8
    assert frame_bits(8) == 34 + 64 + 13 + 24


@pytest.mark.parametrize(("period_us", "load"), [(1000, 0.705), (2000, 0.3525)])
def test_the_cycle_at_one_megabit(period_us: int, load: float) -> None:
    quiet = {"heartbeat_ms": 0xFFFF}
    drives = load_drives("dextar_socketcan")
    master = drives.master.model_copy(update=quiet)
    pair = drives.drives.model_copy(
        update={"q11": drives.pair[0].model_copy(update=quiet), "q21": drives.pair[1].model_copy(update=quiet)}
    )
    drives = drives.model_copy(update={"sync_period_us": period_us, "master": master, "drives": pair})
    assert cycle_bits(drives) == 55 + 2 * 95 + 4 * 115 == 705
    assert bus_load(drives) == pytest.approx(load, abs=1e-5)


def test_heartbeats_add_little() -> None:
    # three heartbeats of 65 bits every 20 ms
    assert frame_bits(1) == 65
    assert bus_load(load_drives("dextar_socketcan")) == pytest.approx(0.3525 + 3 * 65 * 50 / 1e6, abs=1e-9)


def test_a_velocity_less_cycle_is_shorter() -> None:
    drives = load_drives("dextar_socketcan")
    short = drives.pair[0].model_copy(update={"velocity_in_pdo": False})
    drives = drives.model_copy(update={"drives": drives.drives.model_copy(update={"q11": short, "q21": short})})
    assert cycle_bits(drives) == 55 + 2 * 95 + 2 * 115 + 2 * 75
