# SPDX-License-Identifier: Apache-2.0
"""The emulated drives' access to the bus, which can be interrupted or delayed; periodic frames need no thread."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import can
import canopen


class LoopTask:
    """A periodic frame that `DriveNetwork.tend` sends; replaces canopen's periodic task."""

    def __init__(self, network: DriveNetwork, can_id: int, data: bytes, period: float) -> None:
        """Send for the first time at the next call of `tend`."""
        self._network = network
        self._can_id = can_id
        self._data = bytes(data)
        self._period = period
        self._due = 0.0

    def update(self, data: bytes) -> None:
        """Change the data."""
        self._data = bytes(data)

    def stop(self) -> None:
        """Stop sending."""
        self._network.tasks.discard(self)

    def tend(self, now: float) -> None:
        """Send the frame if it is due."""
        if now >= self._due:
            self._due = now + self._period
            self._network.send_message(self._can_id, self._data)


class DriveNetwork(canopen.Network):
    """The network of one drive."""

    def __init__(self, bus: can.BusABC, clock: Callable[[], float] = time.monotonic) -> None:
        """Use an open bus."""
        super().__init__(bus)
        self._clock = clock
        self._waiting: list[tuple[float, int, bytes]] = []
        self.tasks: set[LoopTask] = set()
        self.cut = False
        """Whether the drive is off the bus: it neither sends nor receives."""
        self.delay = 0.0
        """Delay (s) of PDOs."""
        self.mute = False
        """Whether the drive stops sending its heartbeat, and nothing else."""

    def send_message(self, can_id: int, data: Any, remote: bool = False) -> None:
        """Send a frame, unless the drive is cut off; PDOs are delayed."""
        if self.cut:
            return
        if self.delay > 0.0 and 0x180 <= can_id < 0x580:
            self._waiting.append((self._clock() + self.delay, can_id, bytes(data)))
            return
        self._send(can_id, bytes(data))

    def send_periodic(self, can_id: int, data: Any, period: float, remote: bool = False) -> Any:
        """Return a task that sends a frame periodically."""
        task = LoopTask(self, can_id, data, period)
        self.tasks.add(task)
        return task

    def tend(self, now: float) -> None:
        """Send all frames that are due."""
        for task in () if self.mute else tuple(self.tasks):
            task.tend(now)
        due = [frame for frame in self._waiting if frame[0] <= now]
        self._waiting = [frame for frame in self._waiting if frame[0] > now]
        for _, can_id, data in due:
            if not self.cut:
                self._send(can_id, data)

    def _send(self, can_id: int, data: bytes) -> None:
        bus = self.bus
        assert bus is not None
        bus.send(can.Message(arbitration_id=can_id, data=data, is_extended_id=False))
