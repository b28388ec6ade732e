# SPDX-License-Identifier: Apache-2.0
"""Base of the side of two emulated drives on a CAN bus."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Generic, TypeVar

import can

from fivebar_description.drive_file import CanChannel
from fivebar_description.network import can_problem
from fivebar_description.strict_yaml import InputError, validate
from fivebar_sim.drives.emulation import open_bus
from fivebar_sim.motors.configuration import MotorsEmulationFile
from fivebar_sim.motors.motors import EmulatedMotors

L = TypeVar("L", bound=CanChannel)


class CanLink(ABC, Generic[L]):
    """The `MotorLink` of two drives on a CAN bus."""

    def __init__(self, file: MotorsEmulationFile, model: type[L], fd: bool = False) -> None:
        """Open the bus, of CAN FD or of classical CAN, that the section `link` of a file names.

        Raises:
            InputError: it cannot be opened, or the section does not fit its model.
        """
        self.link = validate(dict(file.link), model, f"{file.name}: link")
        self._fd = fd
        try:
            self._bus = open_bus(self.link, fd)
        except (can.CanError, OSError) as error:
            raise InputError(can_problem(self.link.interface, self.link.channel, error)) from error
        self.place = f"{self.link.interface} {self.link.channel}"

    def serve(self, motors: EmulatedMotors, timeout: float) -> None:
        """Wait for a frame for a time (s), and answer it; do what is due."""
        try:
            message = self._bus.recv(timeout)
        except can.CanOperationError:
            # a datagram in the multicast group that is no CAN frame
            message = None
        self.watch(motors)
        if message is not None and not message.is_error_frame and (self._fd or not self._unknown(message)):
            self.answer(motors, message)
        self.tend(motors)

    def close(self) -> None:
        """Leave the bus."""
        self._bus.shutdown()

    def send(self, can_id: int, data: bytes) -> None:
        """Send a data frame, of a length that CAN or CAN FD has."""
        self._bus.send(
            can.Message(
                arbitration_id=can_id,
                data=data,
                is_extended_id=can_id >= 1 << 11,
                is_fd=self._fd,
                bitrate_switch=self._fd,
            )
        )

    @abstractmethod
    def watch(self, motors: EmulatedMotors) -> None:
        """Note injected faults, and power that a watchdog has taken."""

    @abstractmethod
    def answer(self, motors: EmulatedMotors, message: can.Message) -> None:
        """Answer a frame."""

    def tend(self, motors: EmulatedMotors) -> None:
        """Send what is due by itself; nothing by default."""
        return

    def _unknown(self, message: can.Message) -> bool:
        return message.is_extended_id or message.is_fd
