# SPDX-License-Identifier: Apache-2.0
"""What the bus object puts on the bus for drives in given states; no drive is on it to answer."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from uuid import uuid4

import can
import pytest

from fivebar_control.hardware.configuration import load_drives
from fivebar_control.hardware.drive_bus import DriveBus
from fivebar_control.hardware.fault import DriveError
from fivebar_control.hardware.frames import Effort, Status

ENABLED, FAULT, DISABLED = 0x0237, 0x0218, 0x0250


class Listener:
    """A bus object, the states that its drives told last, and a third party that reads the commands."""

    def __init__(self) -> None:
        channel = uuid4().hex
        drives = load_drives("dextar_emulated").model_copy(
            update={"sync_period_us": 2000, "gather_deadline_us": 1000, "missing_limit": 1000}
        )
        self.bus = DriveBus(drives, can.Bus(interface="virtual", channel=channel))
        self._other = can.Bus(interface="virtual", channel=channel)

    def tell(self, word1: int, word2: int) -> None:
        for number, (link, word) in enumerate(zip(self.bus.links, (word1, word2), strict=True)):
            link.expect()
            link.take(Status(number, word, 0), 0.0)
            link.take(Effort(number, 0, 0), 0.0)
            assert link.close_cycle() is not None

    def commands(self, node_id: int) -> list[tuple[int, int]]:
        """Return controlword and raw torque of all commands to a drive so far."""
        found = []
        while (message := self._other.recv(0.0)) is not None:
            if message.arbitration_id == 0x200 + node_id:
                found.append(struct.unpack("<Hh", message.data))
        return found

    def close(self) -> None:
        self.bus.close()
        self._other.shutdown()


@pytest.fixture
def listener() -> Iterator[Listener]:
    listener = Listener()
    yield listener
    listener.close()


@pytest.mark.parametrize("node_id", [1, 2])
@pytest.mark.parametrize("words", [(ENABLED, ENABLED), (ENABLED, DISABLED), (DISABLED, DISABLED)])
def test_before_the_drives_are_enabled_from_here_no_torque_is_asked(
    listener: Listener, words: tuple[int, int], node_id: int
) -> None:
    """Even of drives that are enabled already, as a bridge finds them that was started again."""
    listener.tell(*words)
    listener.bus.write((0.8, -0.8))
    ((_, torque),) = listener.commands(node_id)
    assert torque == 0


@pytest.mark.parametrize(("words", "broken", "sound"), [((FAULT, DISABLED), 1, 2), ((DISABLED, FAULT), 2, 1)])
def test_only_the_drive_in_its_fault_state_is_told_to_reset(
    listener: Listener, words: tuple[int, int], broken: int, sound: int
) -> None:
    """Bit 7 of the controlword; to a drive without a fault it would be an edge that it has not asked for."""
    for node_id, told in ((broken, True), (sound, False)):
        listener.tell(*words)
        with pytest.raises(DriveError):
            listener.bus.reset(0.1)
        controlwords = [word for word, _ in listener.commands(node_id)]
        assert len(controlwords) > 5
        assert any(word & 0x80 for word in controlwords) == told
