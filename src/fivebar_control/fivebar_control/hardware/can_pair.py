# SPDX-License-Identifier: Apache-2.0
"""Base of drivers of two drives on a CAN bus: what is known of each, sending, and waiting for both."""

from __future__ import annotations

import math
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Generic, TypeVar

import can

from fivebar_control.fault import Fault
from fivebar_control.hardware.can_port import CanPort
from fivebar_control.hardware.fault import DriveError


class DriveOnBus:
    """One of both drives."""

    def __init__(self, number: int, joint: str, word: str) -> None:
        """Know a drive by its number on the bus, which the vendor calls by a word."""
        self.id = number
        self.place = f"{joint} ({word} {number})"
        self.awaited = False
        """Whether an answer to the last command is still to come."""


D = TypeVar("D", bound=DriveOnBus)

ANSWER_TIMEOUT = 1.0
"""Longest wait (s) for the first answer of a drive."""

ASKED = 5
"""Number of times that it is asked for meanwhile."""


class CanPair(ABC, Generic[D]):
    """Two drives on a CAN bus. Frames that come are taken in a thread, which holds `received` meanwhile."""

    def __init__(self, bus: can.BusABC, drives: tuple[D, D], fd: bool = False) -> None:
        """Take frames from an open bus, of CAN FD or of classical CAN."""
        self.drives = drives
        self.by_id = {drive.id: drive for drive in drives}
        self.received = threading.Condition()
        self._late = 0
        self._port = CanPort(bus, self._take, fd)

    def send(self, can_id: int, data: bytes) -> None:
        """Send a data frame. One that cannot be sent has no answer, and that is noticed."""
        try:
            self._port.send(can_id, data)
        except (can.CanError, OSError):
            return

    def request(self, can_id: int) -> None:
        """Ask for a frame by a remote frame, as `send`."""
        try:
            self._port.request(can_id)
        except (can.CanError, OSError):
            return

    def wait_for_both(self, reached: Callable[[D], bool], timeout: float) -> bool:
        """Wait for a time (s) until both drives have reached something; return whether they have."""
        with self.received:
            return self.received.wait_for(lambda: all(map(reached, self.drives)), timeout)

    def wait_for_answers(self, timeout: float) -> bool:
        """Wait for a time (s) until the awaited answers have come; return whether they have."""
        return self.wait_for_both(lambda drive: not drive.awaited, timeout)

    def note_answer(self, drive: D) -> None:
        """Note the answer of a drive, which is late where none is awaited; called from `take`."""
        if not drive.awaited:
            self.note_late()
        drive.awaited = False

    def note_late(self) -> None:
        """Note an answer to an earlier command; called from `take`."""
        self._late += 1

    def take_late(self) -> int:
        """Return how many answers have come late since the last call, in which the drives answered earlier commands."""
        with self.received:
            late, self._late = self._late, 0
        return late

    def expect_both(
        self, answered: Callable[[D], bool], ask: Callable[[D], None], hint: Callable[[], str] = lambda: ""
    ) -> None:
        """Ask again and again until both drives have answered.

        Raises:
            DriveError: one has not within `ANSWER_TIMEOUT`; the text ends with a hint.
        """
        for _ in range(ASKED):
            for drive in self.drives:
                if not answered(drive):
                    ask(drive)
            if self.wait_for_both(answered, ANSWER_TIMEOUT / ASKED):
                return
        silent = next(drive for drive in self.drives if not answered(drive))
        raise DriveError(Fault("drive_missing", f"{silent.place}: no answer in {ANSWER_TIMEOUT:g} s{hint()}"))

    def leave(self) -> None:
        """Leave the bus."""
        self._port.close()

    @abstractmethod
    def take(self, can_id: int, data: bytes) -> None:
        """Take a frame, which may be that of another drive; called in the receiving thread."""

    def _take(self, can_id: int, data: bytes) -> None:
        with self.received:
            self.take(can_id, data)
            self.received.notify_all()


def finite(*values: float) -> bool:
    """Return whether all values are finite."""
    return all(map(math.isfinite, values))
