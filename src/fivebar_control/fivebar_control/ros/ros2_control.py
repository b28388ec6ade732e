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
from fivebar_control.hardware.drive_interface import JointTarget, set_up_or_closed
from fivebar_control.hardware.fault import DriveError
from fivebar_control.hardware.inner_loop import OPEN, LoopTargets, MotorSetPoint, set_point
from fivebar_control.hardware.motors_file import MotorsFile
from fivebar_control.hardware.two_motors import (
    NO_POWER,
    TEND_PERIOD,
    PairAnswer,
    PairCommand,
    PromptMotors,
    ShaftReading,
    joint_reading,
)
from fivebar_control.ros.joints_port import JointsPort


class ControlledJoints:
    """The `PromptDriver` of both joints. They have power while the controller is told torques."""

    def __init__(self, file: MotorsFile, link: JointsLink, bell: Bell | None) -> None:
        """Join the graph, and find states, controller and watchdog.

        Raises:
            DriveError: something is missing, or differs from the file.
        """
        self._file, self._link = file, link
        self._sent = NO_POWER
        self._readings: tuple[ShaftReading | None, ShaftReading | None] = (None, None)
        self._told = [(0.0, OPEN), (0.0, OPEN)]
        """Efforts and set points of both motors, as they were told last."""
        self._applied = self._told
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
            values = self._values(command if command.power else NO_POWER)
            self._port.publish(values, at_once=not any(self._link.acting(values) or ()))
        self._sent = command if command.power else NO_POWER

    def _values(self, command: PairCommand) -> list[float]:
        """Return what the controller is told: efforts, and gains with their targets where the command has one."""
        pair = self._file.pair
        efforts = [self._link.effort(motor, torque) for motor, torque in zip(pair, command.torques, strict=True)]
        points = [self._point(number, command.target, effort) for number, effort in enumerate(efforts)]
        self._told = list(zip(efforts, points, strict=True))
        return self._link.command(self._file, efforts, points)

    def _point(self, number: int, target: JointTarget | None, effort: float) -> MotorSetPoint:
        """Return the set point of a motor beside an effort; without a target where it has been read, without gains."""
        motor, reading = self._file.pair[number], self._readings[number]
        if reading is None:
            return OPEN
        if target is None:
            return OPEN._replace(angle=reading.position)
        missing = target.positions[number] - joint_reading(motor, reading).position
        angle = reading.position, reading.position + motor.sign * motor.gear_ratio * missing
        speed = reading.velocity, motor.sign * motor.gear_ratio * target.velocities[number]
        limit = self._link.effort(motor, motor.shaft_torque_limit)
        return set_point(self._link.inner_loop, limit, effort, target.weight, angle, speed)

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
            self._reading(number, *measured) for number, measured in enumerate(zip(*sample.states, strict=True))
        )
        self._readings = first, second
        # what has been published by now is applied until the next sample
        self._applied = self._told
        return PairAnswer((first, second), self._sent.power, fault, sample.periods)

    def _reading(self, number: int, position: float, velocity: float, effort: float) -> ShaftReading:
        """Return what a motor has measured; an effort that it does not measure is what it was told.

        The part of its own control is that of the mean of its last two readings.
        """
        if math.isnan(effort):
            (effort, point), before = self._applied[number], self._readings[number]
            if before is not None:
                effort += point.kp * (point.angle - 0.5 * (before.position + position))
                effort += point.kd * (point.speed - 0.5 * (before.velocity + velocity)) if point.kd else 0.0
        return ShaftReading(position, velocity, self._link.torque(self._file.pair[number], effort))

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

    loop = LoopTargets(link.inner_loop, file.period_us).target if link.inner_loop.on else None
    waits = file.paced_by_commands
    return DriveConnection(file.period_us, "period_us", TEND_PERIOD, opened, waits, inner_loop=loop, bell=bell)
