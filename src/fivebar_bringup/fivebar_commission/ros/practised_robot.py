# SPDX-License-Identifier: Apache-2.0
"""The simulated robot of a practice by the clock: its drives on a bus, its gyroscope on a topic, and a hand.

It is a process of its own, which nobody else shares anything with but frames, messages and the hand's tasks, a line
each on standard input. It ends with its input.
"""

from __future__ import annotations

import argparse
import queue
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

from rclpy.publisher import Publisher
from sensor_msgs.msg import Imu

from fivebar_bringup.simulation.guided import pulled
from fivebar_commission.person import PutAt, Turn
from fivebar_commission.practice import PracticeFile, PracticeRobot, read_practice
from fivebar_commission.practice_tasks import DONE, READY, Led, task_of
from fivebar_control.model.state import Platform
from fivebar_description.imu import ImuSettings
from fivebar_description.interface import DEFAULT_PRIORITY, IMU_DATA, IMU_FRAME, NANOSECONDS
from fivebar_description.ros.domain_member import DomainMember
from fivebar_description.ros.messages import imu_message
from fivebar_description.ros.scheduling import Scheduling, apply_scheduling, spare_what_exists
from fivebar_odrive_emulation.odrive_bus import ODriveBus
from fivebar_sim.effects.gyroscope import GyroscopeFaults, ImuClock
from fivebar_sim.motors.emulation import POLL_PERIOD
from fivebar_sim.sensors import ImuReading, ReadingQueue, imu_queue


class ImuOnTopic:
    """Publishes an IMU's readings when they are due, stamped by its own clock."""

    def __init__(
        self, settings: ImuSettings, rate_hz: int, seed: int, faults: GyroscopeFaults, publisher: Publisher[Imu]
    ) -> None:
        """Have an IMU that is read with every sample of a robot."""
        self._publisher = publisher
        self._clock = ImuClock(settings, faults, rate_hz, seed)
        self._queue: ReadingQueue[tuple[ImuReading, float]] = imu_queue(settings, faults, rate_hz, seed)
        self._number = 0

    def read(self, reading: ImuReading, moment: float) -> None:
        """Take the reading of the next sample, at a moment of the clock (s since the epoch)."""
        for made, (arrived, then) in self._queue.arrived(self._number, (reading, moment)):
            stamp = round((then + self._clock.offset(made)) * NANOSECONDS)
            self._publisher.publish(imu_message(stamp, IMU_FRAME, arrived.angular_velocity, arrived.acceleration))
        self._number += 1


class ClockedRobot(PracticeRobot):
    """The simulated robot as the clock and the frames on its bus move it."""

    def __init__(self, file: PracticeFile, imu: ImuOnTopic | None) -> None:
        """Open the drives' side of the bus, and put the robot home."""
        super().__init__(file, machine_code=True, now=time.monotonic())
        # at rest, so that machine code is there before anybody waits for an answer
        self.motors.plant.advance((0.0, 0.0))
        self._link, self._imu = ODriveBus(file), imu
        self._since_epoch = time.time() - time.monotonic()
        self._pull: Callable[[float], tuple[float, float]] | None = None
        self.left = threading.Event()
        """Set once nobody is there any more for whom a hand would do anything."""
        self.motors.before_step = self._before_step

    def serve(self) -> None:
        """Answer a frame, and move the robot on to the present."""
        self._link.serve(self.motors, POLL_PERIOD)
        self.motors.tend(time.monotonic())

    def by_hand(self, wanted: Callable[[float], Platform], seconds: float, grip: float = 1.0) -> None:
        """Let a hand move the platform to where it is wanted at each time (s), while the drives are served."""
        began = time.monotonic()

        def pull(now: float) -> tuple[float, float]:
            x, y = pulled(self.actual, self.state, wanted(max(0.0, now - began)))
            return grip * x, grip * y

        self._pull = pull
        while time.monotonic() - began < seconds and not self.left.is_set():
            self.serve()
        self._pull = None
        self.motors.pull(0.0, 0.0)

    def obeys(self, task: Turn | PutAt | Led) -> None:
        """Let a hand do a task, and return when it is done."""
        if isinstance(task, Led):
            self.by_hand(task.at, task.duration)
        else:
            self.does(task)

    def close(self) -> None:
        """Leave the bus."""
        self._link.close()

    def _before_step(self, now: float) -> None:
        self.samples += 1
        if self._imu is not None:
            self._imu.read(self.motors.plant.measure_imu(), now + self._since_epoch)
        if self._pull is not None:
            self.motors.pull(*self._pull(now))


def main() -> None:
    """Serve the robot of a file in a DDS domain until standard input ends."""
    parser = argparse.ArgumentParser(prog="practised_robot", description=__doc__)
    parser.add_argument("file", type=Path)
    parser.add_argument("domain", type=int)
    arguments = parser.parse_args()
    file, lines = read_practice(arguments.file), queue.SimpleQueue[str]()

    with DomainMember("practised_robot", arguments.domain) as member:
        imu = None
        if file.imu is not None:
            publisher, rate_hz = member.advertise(IMU_DATA), round(1e6 / file.period_us)
            imu = ImuOnTopic(file.imu, rate_hz, file.effects.seed, file.effects.gyroscope, publisher)
        robot = ClockedRobot(file, imu)

        def read_lines() -> None:
            for line in sys.stdin:
                lines.put(line)
            robot.left.set()

        threading.Thread(target=read_lines, daemon=True).start()
        # a robot does not stand still while its computer collects garbage
        spare_what_exists()
        apply_scheduling(Scheduling(DEFAULT_PRIORITY), lambda words: print(words, file=sys.stderr))
        print(READY, flush=True)
        try:
            while not robot.left.is_set():
                if lines.empty():
                    robot.serve()
                    continue
                robot.obeys(task_of(lines.get()))
                print(DONE, flush=True)
        finally:
            robot.close()


if __name__ == "__main__":
    main()
