# SPDX-License-Identifier: Apache-2.0
"""Two joints under a controller manager of ros2_control as the drives of a bridge.

The broadcaster's states set the pace. A torque is published when it comes, and acts from the controller's next update
on; the controller holds it until another one comes.
"""

from __future__ import annotations

import math

from fivebar_control.hardware.configuration import USUAL_MISSING
from fivebar_control.hardware.controlled_joints import JointsLink, load_joints
from fivebar_control.hardware.drive_connection import Bell, DriveConnection
from fivebar_control.hardware.drive_interface import ZERO, set_up_or_closed
from fivebar_control.hardware.fault import DriveError
from fivebar_control.hardware.motors_file import MotorsFile
from fivebar_control.hardware.two_motors import (
    NO_POWER,
    TEND_PERIOD,
    PairAnswer,
    PairCommand,
    PromptMotors,
    ShaftReading,
)
from fivebar_control.ros.joints_port import JointsPort


class ControlledJoints:
    """The `PromptDriver` of both joints. They have power while the controller is told torques."""

    def __init__(self, file: MotorsFile, link: JointsLink, bell: Bell | None) -> None:
        """Join the graph, and find states, controller and watchdog.

        Raises:
            DriveError: something is missing, or differs from the file.
        """
        self._file = file
        self._sent = NO_POWER
        self._applied = ZERO
        self._silent = 0
        self._port = JointsPort(file, link, bell)
        try:
            self._port.begin(file.set_up_timeout_ms / 1e3)
        except DriveError:
            self._port.close()
            raise

    @property
    def unused(self) -> tuple[tuple[str, int], ...]:
        """States and samples that were lost, late or not used so far."""
        return self._port.unused

    def exchange(self, command: PairCommand, timeout: float) -> PairAnswer:
        """Publish torques, and return what has been measured; where the robot waits for them, what they lead to."""
        if self._file.paced_by_commands:
            self._port.take(0.0)
        self.send(command)
        return self.receive(timeout)

    def send(self, command: PairCommand) -> None:
        """Publish torques, zero at once; without power zero a single time: others may command the controller then."""
        if command.power or self._sent != NO_POWER:
            self._port.publish(command.torques if command.power else ZERO, at_once=not any(command.torques))
        self._sent = command if command.power else NO_POWER

    def receive(self, timeout: float) -> PairAnswer:
        """Return the newest sample, and wait for it for a time (s)."""
        sample = self._port.take(timeout)
        fault = self._port.fault
        if sample is None:
            self._silent += self._file.patience
            if fault is None and self._silent > self._file.most_missing:
                fault = self._port.silence()
            return PairAnswer((None, None), self._sent.power, fault, 0)
        self._silent = 0
        first, second = (
            ShaftReading(position, velocity, commanded if math.isnan(effort) else effort)
            for position, velocity, effort, commanded in zip(*sample.states, self._applied, strict=True)
        )
        # what has been published by now is applied until the next sample
        self._applied = self._sent.torques
        return PairAnswer((first, second), self._sent.power, fault, sample.periods)

    def clear(self) -> None:
        """Begin to count missing states anew."""
        self._silent = 0

    def close(self) -> None:
        """Publish zero torque, unless that was the last, and leave the graph."""
        self.send(NO_POWER)
        self._port.close()


def connect(configuration: str) -> DriveConnection:
    """Return the joints of a configuration, given by name or path.

    Raises:
        InputError: the file is missing or not a configuration.
    """
    file, link = load_joints(configuration)
    # emulated joints wait for the commands, and the bridge's clock sets the pace
    bell = None if file.paced_by_commands else Bell()

    def opened(missing: int = USUAL_MISSING) -> PromptMotors:
        bearing = file.bearing(missing)
        return set_up_or_closed(PromptMotors(bearing, ControlledJoints(bearing, link, bell)))

    return DriveConnection(file.period_us, "period_us", TEND_PERIOD, opened, file.paced_by_commands, bell=bell)
