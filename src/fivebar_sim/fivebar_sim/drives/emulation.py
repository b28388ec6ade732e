"""Two emulated drives and the robot that they move, driven by the frames on a bus."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

import can

from fivebar_description.parameters import load_robot
from fivebar_sim.drives.configuration import EmulatedBus, EmulationFile
from fivebar_sim.drives.drive import OVERSPEED_EMERGENCY, EmulatedDrive
from fivebar_sim.options import PlantOptions
from fivebar_sim.plant import Plant, PlantDiverged

SYNC_ID = 0x080
LOOK_PERIOD = 0.002
"""Longest time (s) between two looks at heartbeats and late frames."""

FRAMES_AT_ONCE = 64
"""Frames that are taken before the next such look."""


def open_bus(bus: EmulatedBus) -> can.BusABC:
    """Open the bus of a configuration; frames over UDP never leave this machine."""
    if bus.interface == "udp_multicast":
        return can.Bus(interface=bus.interface, channel=bus.channel, port=bus.port, hop_limit=0, fd=False)
    return can.Bus(interface=bus.interface, channel=bus.channel)


def is_plain(message: can.Message) -> bool:
    """Return whether a frame is a data frame with an 11-bit id, the only kind that CANopen uses here."""
    return not (message.is_error_frame or message.is_extended_id or message.is_remote_frame or message.is_fd)


class Emulation:
    """Both drives; the robot moves on by one period with every SYNC."""

    def __init__(self, emulation: EmulationFile, bus: can.BusABC, clock: Callable[[], float] = time.monotonic) -> None:
        """Boot the drives on an open bus.

        Raises:
            InputError: the robot or its posture cannot be.
        """
        self._bus = bus
        self._clock = clock
        rate_hz = round(1e6 / emulation.sync_period_us)
        # the drives themselves limit and quantise
        self.plant = Plant(
            load_robot(emulation.robot), emulation.initial_joints, rate_hz, PlantOptions(torque_limit=None)
        )
        first, second = emulation.pair
        self.drives = EmulatedDrive(first, bus, clock), EmulatedDrive(second, bus, clock)
        self.syncs = 0
        """SYNCs heard so far."""
        self._sense()

    def take(self, can_id: int, data: bytes) -> None:
        """Take a frame from the bus."""
        if can_id == SYNC_ID and not data:
            self._sync()
            return
        for drive in self.drives:
            drive.take(can_id, data)

    def tend(self) -> None:
        """Do what is due by the clock."""
        now = self._clock()
        for drive in self.drives:
            drive.tend(now)

    def run(self, ending: threading.Event, between: Callable[[], None] = lambda: None) -> None:
        """Serve the bus until told to end; `between` is called between frames."""
        while not ending.is_set():
            # what is waiting is heard before any age is looked at: a process that was held up judges nobody by that
            timeout = LOOK_PERIOD
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
            # a datagram on the group that is no frame
            return True
        if message is not None and is_plain(message):
            self.take(message.arbitration_id, bytes(message.data))
        return message is not None

    def _sync(self) -> None:
        self.syncs += 1
        try:
            self.plant.advance((self.drives[0].torque, self.drives[1].torque))
        except PlantDiverged:
            for drive in self.drives:
                drive.trip(OVERSPEED_EMERGENCY)
        self._sense()
        for drive in self.drives:
            drive.answer_sync()

    def _sense(self) -> None:
        q11, _, q21, _ = self.plant.joints.tolist()
        v11, _, v21, _ = self.plant.joint_velocities.tolist()
        self.drives[0].sense(q11, v11)
        self.drives[1].sense(q21, v21)
