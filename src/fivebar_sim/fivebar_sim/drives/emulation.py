# SPDX-License-Identifier: Apache-2.0
"""Two emulated drives and the robot that they move, driven by the frames on a bus."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Any

import can

from fivebar_description.drive_file import CanChannel
from fivebar_sim.drives.configuration import EmulationFile
from fivebar_sim.drives.drive import OVERSPEED_EMERGENCY, EmulatedDrive
from fivebar_sim.emulated_hardware import HISTORY, MeasuredRecord
from fivebar_sim.moved_robot import MovedRobot
from fivebar_sim.plant import PlantDiverged

SYNC_ID = 0x080
POLL_PERIOD = 0.002
"""Longest time (s) between two checks of heartbeats and delayed frames."""

FRAMES_AT_ONCE = 64
"""Frames that are processed before the next such check."""


def open_bus(bus: CanChannel, fd: bool = False) -> can.BusABC:
    """Open the bus of a configuration, of CAN FD or of classical CAN; frames over UDP never leave this machine."""
    options: dict[str, Any] = {"interface": bus.interface, "channel": bus.channel}
    if bus.interface == "udp_multicast":
        options |= {"port": bus.port, "hop_limit": 0, "fd": fd}
    elif bus.interface == "socketcan":
        options |= {"fd": fd}
    return can.Bus(**options)


def is_plain(message: can.Message) -> bool:
    """Return whether a frame is a data frame with an 11-bit id, the only kind that CANopen uses here."""
    return not (message.is_error_frame or message.is_extended_id or message.is_remote_frame or message.is_fd)


class Emulation(MovedRobot):
    """Both drives; the robot moves on by one period with every SYNC."""

    def __init__(self, emulation: EmulationFile, bus: can.BusABC, clock: Callable[[], float] = time.monotonic) -> None:
        """Boot the drives on an open bus.

        Raises:
            InputError: the robot or its posture cannot be.
        """
        self._bus = bus
        self._clock = clock
        super().__init__(emulation, round(1e6 / emulation.sync_period_us))
        first, second = emulation.pair
        self.drives = EmulatedDrive(first, bus, clock), EmulatedDrive(second, bus, clock)
        self.syncs = 0
        """SYNCs received so far."""
        self.sync_delay = 0.0
        """Delay (s) of SYNCs."""
        self.history: deque[MeasuredRecord] = deque(maxlen=HISTORY)
        """The last SYNCs, the newest at the end."""
        self._late_syncs: deque[float] = deque()
        self._sense()

    def take(self, can_id: int, data: bytes) -> None:
        """Process a frame from the bus."""
        if can_id == SYNC_ID and not data:
            if self.sync_delay > 0.0:
                self._late_syncs.append(self._clock() + self.sync_delay)
            else:
                self._sync()
            return
        for drive in self.drives:
            drive.take(can_id, data)

    def tend(self) -> None:
        """Do what is due at this time."""
        now = self._clock()
        while self._late_syncs and self._late_syncs[0] <= now:
            self._late_syncs.popleft()
            self._sync()
        for drive in self.drives:
            drive.tend(now)

    def run(self, ending: threading.Event, between: Callable[[], None] = lambda: None) -> None:
        """Serve the bus until `ending` is set; `between` is called between frames."""
        while not ending.is_set():
            # process queued frames before checking timeouts: a delay of this process must not count as one of others
            timeout = POLL_PERIOD
            for _ in range(FRAMES_AT_ONCE):
                if not self._hear(timeout):
                    break
                timeout = 0.0
            between()
            self.tend()

    def _hear(self, timeout: float) -> bool:
        """Take one frame, if there is any within a time (s)."""
        try:
            message = self._bus.recv(timeout)
        except can.CanOperationError:
            # a datagram in the multicast group that is no CAN frame
            return True
        if message is not None and is_plain(message):
            self.take(message.arbitration_id, bytes(message.data))
        return message is not None

    def _sync(self) -> None:
        """Read the encoders and answer, then integrate to the next SYNC, whose torque is known by now."""
        self.syncs += 1
        self._sense()
        first, second = self.drives
        self.history.append(MeasuredRecord(self.syncs, (first.angle, second.angle), self.plant.truth()))
        for drive in self.drives:
            drive.answer_sync()
        try:
            self.move((first.torque, second.torque))
        except PlantDiverged:
            for drive in self.drives:
                drive.trip(OVERSPEED_EMERGENCY)

    def _sense(self) -> None:
        (q11, _, q21, _), (v11, _, v21, _) = self.plant.seen()
        self.drives[0].sense(q11, v11)
        self.drives[1].sense(q21, v21)
