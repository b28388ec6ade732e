# SPDX-License-Identifier: Apache-2.0
"""The CAN interface: opening it, sending, and a receiving thread that no frame can end."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

import can

from fivebar_control.fault import Fault
from fivebar_control.hardware.configuration import Bus
from fivebar_control.hardware.fault import DriveError
from fivebar_description.network import can_problem

WAKE_PERIOD = 0.1
"""Longest time (s) until the receiving thread notices that it should end."""

LARGEST_11_BIT_ID = 0x7FF

BUS_OFF_CLASS = 0x40
"""Bit of a socketcan error frame's id that says that the controller has gone off the bus."""


def open_bus(bus: Bus, fd: bool = False) -> can.BusABC:
    """Open the CAN interface that a configuration names, for CAN FD or for classical CAN.

    Raises:
        DriveError: it cannot be opened.
    """
    options: dict[str, Any] = {"interface": bus.interface, "channel": bus.channel}
    if bus.interface == "udp_multicast":
        # hop limit 0 keeps the frames on this machine
        options |= {"port": bus.port, "hop_limit": 0, "fd": fd}
    elif bus.interface == "socketcan":
        options |= {"bitrate": bus.bitrate, "fd": fd}
    return opened(bus, lambda: can.Bus(**options))


def opened(bus: Bus, opening: Callable[[], can.BusABC]) -> can.BusABC:
    """Return the bus that a function opens.

    Raises:
        DriveError: it cannot be opened.
    """
    try:
        return opening()
    except (can.CanError, OSError, ValueError) as error:
        raise DriveError(Fault("bus_missing", can_problem(bus.interface, bus.channel, error))) from error


class CanPort:
    """An open CAN interface. A thread of its own passes received frames on; others are counted."""

    def __init__(self, bus: can.BusABC, handle: Callable[[int, bytes], None], fd: bool = False) -> None:
        """Start to receive; `handle` gets id and data of every data frame.

        Of classical CAN these are the frames with an 11-bit id; with CAN FD all of them.
        """
        self.bus = bus
        self._handle = handle
        self._fd = fd
        self._ending = threading.Event()
        self.unreadable = 0
        """Frames of another kind than `handle` gets, that could not be decoded, or that broke their handler."""
        self.off = False
        """Whether the controller has reported bus off."""
        self._thread = threading.Thread(target=self._receive, name="can", daemon=True)
        self._thread.start()

    def send(self, can_id: int, data: bytes) -> None:
        """Send a data frame, whose length is one that CAN or CAN FD has.

        Raises:
            can.CanError, OSError: it cannot be sent.
        """
        extended = can_id > LARGEST_11_BIT_ID
        self.bus.send(
            can.Message(
                arbitration_id=can_id, data=data, is_extended_id=extended, is_fd=self._fd, bitrate_switch=self._fd
            )
        )

    def request(self, can_id: int) -> None:
        """Send a remote frame, which asks for a data frame of this id.

        Raises:
            can.CanError, OSError: it cannot be sent.
        """
        self.bus.send(can.Message(arbitration_id=can_id, is_remote_frame=True, dlc=8, is_extended_id=False))

    def close(self) -> None:
        """Stop receiving and close the interface."""
        self._ending.set()
        self._thread.join()
        self.bus.shutdown()

    def _receive(self) -> None:
        while not self._ending.is_set():
            try:
                message = self.bus.recv(WAKE_PERIOD)
                if message is not None:
                    self._take(message)
            except (can.CanOperationError, OSError):
                self.unreadable += 1
                # a lost interface fails at once, again and again
                self._ending.wait(0.001)
            except Exception:
                # whatever a frame breaks, the next one must still be received
                self.unreadable += 1

    def _take(self, message: can.Message) -> None:
        if message.is_error_frame:
            self.off = self.off or bool(message.arbitration_id & BUS_OFF_CLASS)
            self.unreadable += 1
        elif message.is_remote_frame or (not self._fd and (message.is_extended_id or message.is_fd)):
            self.unreadable += 1
        else:
            self._handle(message.arbitration_id, bytes(message.data))
