# SPDX-License-Identifier: Apache-2.0
"""Drive configurations: the shipped ones are read, and every mistake is named by file and key."""

from __future__ import annotations

import copy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml

from fivebar_control.hardware.configuration import (
    USUAL_MISSING,
    CycledFile,
    DriveFile,
    drives_path,
    frame_bits,
    load_drives,
)
from fivebar_control.hardware.motors_file import load_motors
from fivebar_description.strict_yaml import InputError

SHIPPED = sorted(path.stem for path in drives_path("dextar_emulated").parent.glob("*.yaml"))


@pytest.fixture
def content() -> dict[str, Any]:
    loaded = yaml.safe_load(drives_path("dextar_emulated").read_text(encoding="utf-8"))
    return copy.deepcopy(loaded)


def written(folder: Path, content: dict[str, Any]) -> str:
    path = folder / "mine.yaml"
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return str(path)


def test_there_are_shipped_configurations() -> None:
    assert SHIPPED == ["dextar_emulated", "dextar_socketcan"]


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_configurations_are_read(name: str) -> None:
    drives = load_drives(name)
    assert drives.rate_hz == 500
    assert [drive.node_id for drive in drives.pair] == [1, 2]


def test_what_may_be_left_out(tmp_path: Path) -> None:
    drive = {"counts_per_revolution": 10000, "rated_torque_nm": 1.0, "velocity_units_per_rev_s": 60,
             "torque_limit_nm": 2}  # fmt: skip
    content = {
        "name": "small",
        "bus": {"interface": "virtual", "channel": "here"},
        "drives": {"q11": {"node_id": 3, **drive}, "q21": {"node_id": 4, **drive}},
    }
    drives = load_drives(written(tmp_path, content))
    assert drives == DriveFile.model_validate(content)
    assert (drives.sync_period_us, drives.master.node_id, drives.bus.bitrate) == (2000, 127, 1_000_000)
    assert drives.drives.q11.identity is None
    assert drives.drives.q11.stall is None


MISTAKES: list[tuple[tuple[str, ...], Any, str]] = [
    (("bus", "interface"), "pcan", r"bus.interface: 'pcan': expected 'socketcan'"),
    (("bus", "channel"), "", r"bus.channel: ''"),
    (("bus", "channel"), "127.0.0.1", r"expected an IPv4 multicast address"),
    (("bus", "bitrate"), 9600, r"bus.bitrate: 9600"),
    (("bus", "baud"), 1, r"bus.baud: unknown key"),
    (("sync_period_us",), 2000.0, r"sync_period_us: 2000.0"),
    (("sync_period_us",), 3000, r"sync_period_us 3000: expected a divisor of 1000000"),
    (("gather_deadline_us",), 2000, r"gather_deadline_us 2000: expected less than sync_period_us 2000"),
    (("master", "timeout_ms"), 60, r"master: .*timeout_ms 60: expected at least twice heartbeat_ms 50"),
    (("drives", "q21", "node_id"), 1, r"node ids \[127, 1, 1\] of master, q11 and q21"),
    (("drives", "q21", "node_id"), 128, r"drives.q21.node_id: 128"),
    (("drives", "q11", "sign"), 0, r"drives.q11.sign: 0"),
    (("drives", "q11", "counts_per_revolution"), 0, r"drives.q11.counts_per_revolution: 0"),
    (("drives", "q11", "rated_torque_nm"), -1.0, r"drives.q11.rated_torque_nm: -1.0"),
    (("drives", "q11", "rated_torque_nm"), float("nan"), r"drives.q11.rated_torque_nm: nan"),
    (("drives", "q11", "home_offset_rad"), float("inf"), r"drives.q11.home_offset_rad: inf"),
    (("drives", "q11", "torque_limit_nm"), 1000.0, r"drives.q11: .*torque_limit_nm 1000.0: is 5e\+05 units of 0x6071"),
    (("drives", "q11", "torque_limit_nm"), 1e-9, r"drives.q11: .*torque_limit_nm 1e-09: is 5e-07 units of 0x6071"),
    (
        ("drives", "q11", "heartbeat_timeout_ms"),
        99,
        r"heartbeat_timeout_ms 99: expected at least twice heartbeat_ms 50",
    ),
    (("drives", "q11", "identity"), {"vendor": -1, "product": 0}, r"drives.q11.identity.vendor: -1"),
    (("drives", "q11", "stall"), {"torque_nm": 0.5}, r"drives.q11.stall.time_ms: is missing"),
    (("drives", "q31"), {}, r"drives.q31: unknown key"),
]


@pytest.mark.parametrize(("keys", "value", "text"), MISTAKES)
def test_a_mistake_is_named(
    keys: tuple[str, ...], value: Any, text: str, content: dict[str, Any], tmp_path: Path
) -> None:
    section = content
    for key in keys[:-1]:
        section = section[key]
    section[keys[-1]] = value
    with pytest.raises(InputError, match=text) as caught:
        load_drives(written(tmp_path, content))
    assert str(caught.value).startswith(str(tmp_path / "mine.yaml: "))
    assert "\n" not in str(caught.value)


def test_an_unknown_name_lists_the_known_ones() -> None:
    with pytest.raises(InputError, match="drives 'nowhere': expected one of dextar_emulated, dextar_socketcan, or"):
        load_drives("nowhere")


def test_a_bus_that_cannot_carry_the_cycles_is_refused(content: dict[str, Any], tmp_path: Path) -> None:
    """At 125 kbit/s 705 bits every 2 ms are 2.8 times as much as there is, and three heartbeats every 20 ms 8 %."""
    content["bus"] = {"interface": "socketcan", "channel": "can0", "bitrate": 125_000}
    with pytest.raises(InputError, match=r"sync_period_us 2000: .* take \d+% of a bus with bitrate 125000:"):
        load_drives(written(tmp_path, content))
    # an emulated bus has no bit rate
    content["bus"] = {"interface": "udp_multicast", "channel": "239.74.163.2", "bitrate": 125_000}
    assert load_drives(written(tmp_path, content)).bus_load > 2.8


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
    assert drives.cycle_bits == 55 + 2 * 95 + 4 * 115 == 705
    assert drives.bus_load == pytest.approx(load, abs=1e-5)


def test_heartbeats_add_little() -> None:
    # three heartbeats of 65 bits every 20 ms
    assert frame_bits(1) == 65
    assert load_drives("dextar_socketcan").bus_load == pytest.approx(0.3525 + 3 * 65 * 50 / 1e6, abs=1e-9)


def test_a_velocity_less_cycle_is_shorter() -> None:
    drives = load_drives("dextar_socketcan")
    short = drives.pair[0].model_copy(update={"velocity_in_pdo": False})
    drives = drives.model_copy(update={"drives": drives.drives.model_copy(update={"q11": short, "q21": short})})
    assert drives.cycle_bits == 55 + 2 * 95 + 2 * 115 + 2 * 75


@pytest.mark.parametrize("load", [lambda: load_motors("moteus"), lambda: load_drives("dextar_socketcan")])
def test_a_file_that_does_not_say_how_many_answers_may_be_missing_has_what_the_motion_bears(
    load: Callable[[], CycledFile],
) -> None:
    file = load()
    assert file.missing_limit is None
    assert file.most_missing == USUAL_MISSING
    assert file.bearing(7).most_missing == 7
    assert file.model_copy(update={"missing_limit": 2}).bearing(7).most_missing == 2
