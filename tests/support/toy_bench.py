# SPDX-License-Identifier: Apache-2.0
"""A bench of two independent motors with friction, for the steps of a commissioning that need drives alone."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from fivebar_commission.limits import Allowed, AllowedDrives, without_torque_afterwards
from fivebar_commission.person import PutAt, Task, Turn
from fivebar_control.fault import Fault
from fivebar_control.hardware.drive_interface import ZERO, DriveReading, Exchange, JointTarget, Torques
from fivebar_control.hardware.motors_file import load_motors
from fivebar_control.hardware.two_motors import ShaftReading, joint_reading, shaft_torque
from fivebar_control.model.geometry import inverse_geometry
from fivebar_description.robot_file import load_robot

PERIOD, INERTIA, FRICTION = 0.002, 0.01, 0.3


class ToyMotors:
    """Two motors as they are: signs, counts a turn, angles where they read 0, and which way their torque acts."""

    def __init__(self) -> None:
        self.signs, self.factors, self.zeros, self.torque_signs = [1, 1], [1.0, 1.0], [0.4, -0.7], [1, 1]
        self.angles, self.speeds, self.torques = [1.6, 1.5], [0.0, 0.0], [0.0, 0.0]
        self.exchanged = False
        self.powered = False
        self.largest = 0.0
        self.fault: Fault | None = None

    def shaft(self, motor: int) -> float:
        """What a drive reads (rad)."""
        return self.factors[motor] * self.signs[motor] * (self.angles[motor] - self.zeros[motor])

    def advance(self) -> None:
        """Move on by a period."""
        for motor in range(2):
            torque = self.factors[motor] * self.torques[motor] if self.powered else 0.0
            self.largest = max(self.largest, abs(torque))
            if abs(torque) <= FRICTION:
                self.speeds[motor] = 0.0
            else:
                push = self.torque_signs[motor] * math.copysign(abs(torque) - FRICTION, torque)
                self.speeds[motor] += PERIOD * push / INERTIA
            self.angles[motor] += PERIOD * self.speeds[motor]


class ToyDrives:
    """The drives of a configuration."""

    notes: Sequence[str] = ()
    unused: Sequence[tuple[str, int]] = ()

    def __init__(self, motors: ToyMotors, configuration: Path) -> None:
        self._motors, self._file = motors, load_motors(str(configuration))
        self.closed = False

    @property
    def enabled(self) -> bool:
        return self._motors.powered

    def set_up(self) -> None:
        pass

    def tend(self) -> None:
        pass

    def confirm_start(self, timeout: float) -> None:
        pass

    def enable(self, timeout: float) -> None:
        self._motors.powered = True

    def exchange(self) -> Exchange:
        self._motors.advance()
        first, second = (self._reading(number) for number in range(2))
        return Exchange((first, second), self._motors.fault)

    def _reading(self, number: int) -> DriveReading:
        motors, file = self._motors, self._file.pair[number]
        at = 1 - file.id if motors.exchanged else file.id
        velocity = motors.factors[at] * motors.signs[at] * motors.speeds[at]
        shaft = ShaftReading(motors.shaft(at), velocity, motors.signs[at] * motors.torques[at])
        return joint_reading(file, shaft)

    def write(self, torques: Torques, target: JointTarget | None = None) -> None:
        for number, torque in enumerate(torques):
            file = self._file.pair[number]
            at = 1 - file.id if self._motors.exchanged else file.id
            self._motors.torques[at] = self._motors.signs[at] * shaft_torque(file, torque)

    def quick_stop(self) -> None:
        self.switch_off()

    def switch_off(self) -> None:
        self.write(ZERO)
        self._motors.powered = False

    def disable(self, timeout: float) -> None:
        self.switch_off()

    def reset(self, timeout: float) -> None:
        pass

    def release(self) -> None:
        pass

    def close(self) -> None:
        self.closed = True


class ToyBench:
    """The drives, and a person at them who turns motors and puts the platform on marks exactly."""

    imu = None

    def __init__(self, robot: str) -> None:
        self.motors, self._robot = ToyMotors(), load_robot(robot)
        self.cycles, self.interrupt_at = 0, -1
        self.asked = 0
        self.drives: ToyDrives | None = None

    @property
    def time(self) -> float:
        return self.cycles * PERIOD

    @contextmanager
    def opened(self, drives: Path, allowed: Allowed) -> Iterator[AllowedDrives]:
        self.drives = ToyDrives(self.motors, drives)
        with without_torque_afterwards(self.drives, allowed) as found:
            yield found

    def wait(self) -> None:
        self.cycles += 1
        if self.cycles == self.interrupt_at:
            raise KeyboardInterrupt

    def close(self) -> None:
        """Nothing to leave."""

    def agrees(self, key: str, question: str) -> bool:
        self.asked += 1
        return True

    def does(self, key: str, request: str, task: Task) -> None:
        self.asked += 1
        self.act(task)

    def act(self, task: Task) -> None:
        match task:
            case Turn(motor, angle):
                self.motors.angles[motor] += angle
            case PutAt(x, y):
                joints = inverse_geometry(self._robot, (1, -1), x, y)
                self.motors.angles = [joints.q11, joints.q21]
