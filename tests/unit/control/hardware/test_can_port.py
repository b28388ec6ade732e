# SPDX-License-Identifier: Apache-2.0
"""The CAN interface in bad company: whatever is received or cannot be sent, nothing is raised into the loop."""

from __future__ import annotations

import queue
import time
from collections.abc import Callable
from typing import Any, cast

import can
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fivebar_control.hardware.can_port import CanPort, open_bus
from fivebar_control.hardware.configuration import Bus, load_drives
from fivebar_control.hardware.drive_bus import DriveBus
from fivebar_control.hardware.drive_link import DriveLink
from fivebar_control.hardware.fault import DriveError
from fivebar_control.hardware.frames import FrameReader, Malformed, MastersOwn, SdoAnswer

DEADLINE = 10.0


class ScriptedBus:
    """Gives out frames and raises errors as it is told to."""

    def __init__(self, *script: can.Message | Exception) -> None:
        self.script: queue.Queue[can.Message | Exception] = queue.Queue()
        for step in script:
            self.script.put(step)
        self.broken = False
        self.closed = False

    def recv(self, timeout: float) -> can.Message | None:
        try:
            step = self.script.get(timeout=timeout)
        except queue.Empty:
            return None
        if isinstance(step, Exception):
            raise step
        return step

    def send(self, message: can.Message) -> None:
        if self.broken:
            raise can.CanOperationError("Transmit buffer full")

    def shutdown(self) -> None:
        self.closed = True

    @property
    def bus(self) -> can.BusABC:
        return cast(can.BusABC, self)


def wait_for(condition: Callable[[], bool]) -> None:
    end = time.monotonic() + DEADLINE
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.001)


def frame(can_id: int = 0x701, data: bytes = b"\x05", **options: Any) -> can.Message:
    return can.Message(arbitration_id=can_id, data=data, is_extended_id=options.pop("is_extended_id", False), **options)


def test_reception_survives_everything_and_counts_it() -> None:
    heard: list[tuple[int, bytes]] = []

    def handle(can_id: int, data: bytes) -> None:
        if can_id == 0x123:
            raise RuntimeError("a broken handler")
        heard.append((can_id, data))

    scripted = ScriptedBus(
        can.CanOperationError("could not unpack received message"),
        OSError("network is down"),
        KeyError("whatever"),
        frame(is_extended_id=True),
        can.Message(arbitration_id=0x701, is_remote_frame=True, dlc=1, is_extended_id=False),
        frame(is_fd=True),
        frame(0x123),
        frame(0x702, b"\x7f"),
    )
    port = CanPort(scripted.bus, handle)
    wait_for(lambda: bool(heard))
    port.close()
    assert heard == [(0x702, b"\x7f")]
    assert port.unreadable == 7
    assert not port.off
    assert scripted.closed


def test_an_error_frame_of_the_class_bus_off_is_seen() -> None:
    scripted = ScriptedBus(can.Message(is_error_frame=True, arbitration_id=0x004, dlc=8, data=bytes(8)))
    port = CanPort(scripted.bus, lambda can_id, data: None)
    wait_for(lambda: port.unreadable == 1)
    assert not port.off
    scripted.script.put(can.Message(is_error_frame=True, arbitration_id=0x040, dlc=8, data=bytes(8)))
    wait_for(lambda: port.off)
    port.close()


def test_a_bus_that_cannot_send_is_a_fault_and_no_exception() -> None:
    scripted = ScriptedBus()
    with DriveBus(load_drives("dextar_emulated"), scripted.bus) as bus:
        scripted.broken = True
        bus.write((0.0, 0.0))
        fault = bus.exchange().fault
        assert str(fault) == "bus_error: cannot send: Transmit buffer full"
        with pytest.raises(DriveError, match="bus_error: Transmit buffer full"):
            bus.set_up()
    assert scripted.closed


def test_a_bus_that_cannot_be_opened_is_a_named_fault() -> None:
    with pytest.raises(DriveError, match=r"bus_missing: socketcan nocan7: "):
        open_bus(Bus(interface="socketcan", channel="nocan7"))


FRAMES = st.tuples(
    st.sampled_from((0x181, 0x182, 0x281, 0x282, 0x701, 0x702, 0x081, 0x082, 0x581)) | st.integers(0, 0x7FF),
    st.binary(max_size=8) | st.binary(min_size=6, max_size=6) | st.sampled_from((b"\x05", b"\x00", b"\x7f", bytes(8))),
)


@given(cycles=st.lists(st.lists(FRAMES, max_size=8), max_size=6))
def test_no_frames_in_any_order_raise_or_make_a_figure_that_is_none(cycles: list[list[tuple[int, bytes]]]) -> None:
    drives = load_drives("dextar_emulated")
    reader = FrameReader(drives.pair, drives.master.node_id)
    links = [DriveLink(name, drive, 2000, 3) for name, drive in zip(("q11", "q21"), drives.pair, strict=True)]
    for frames in cycles:
        for link in links:
            link.expect()
        for can_id, data in frames:
            read = reader.read(can_id, data)
            if not isinstance(read, Malformed | MastersOwn | SdoAnswer):
                links[read.drive].take(read, 1.0)
        for link in links:
            reading = link.close_cycle()
            assert reading is None or all(abs(figure) < 1e6 for figure in reading)
            fault = link.fault(1.0)
            assert fault is None or (fault.name and fault.detail)
