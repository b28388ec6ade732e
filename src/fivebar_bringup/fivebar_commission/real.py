# SPDX-License-Identifier: Apache-2.0
"""The robot on real drives: its drives in real time, a hand that leads it, and runs by the graph of nodes."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from fivebar_bringup.bag import serialize
from fivebar_bringup.bag.writer import BagWriter
from fivebar_bringup.drives.choice import RealDrives
from fivebar_bringup.graph.node_spec import Mode
from fivebar_bringup.recorded.run_directory import RunDirectory, new_run_directory
from fivebar_bringup.recorded.summary import Summary
from fivebar_bringup.runs.launcher import RunOptions
from fivebar_bringup.runs.run import run_with_ros
from fivebar_bringup.scenario import Scenario
from fivebar_commission.bench import opened_drives
from fivebar_commission.limits import Allowed, AllowedDrives
from fivebar_commission.person import Lead, Person
from fivebar_commission.step import GateClosed
from fivebar_control.hardware.connection import connect
from fivebar_control.hardware.cycle_pace import CyclePace
from fivebar_control.scenario.guard_settings import motor_torque_limit
from fivebar_description.imu import ImuSettings
from fivebar_description.interface import ACTIVE_JOINTS, DEFAULT_PRIORITY, IMU_DATA, IMU_FRAME, MOTOR_STATES
from fivebar_description.ros.scheduling import Scheduling, punctual
from fivebar_description.ros_environment import domain_of_environment

if TYPE_CHECKING:
    from fivebar_bringup.ros.imu_collector import StampedReading

LATENCY = 0.004
"""Time (s) by which the readings of an IMU are taken to come late."""


class StampedAngles(NamedTuple):
    """Both motors' readings (rad) in a cycle, with its stamp (ns)."""

    stamp: int
    angles: tuple[float, float]


class RealBench:
    """The `RobotBench` of a robot on real drives."""

    def __init__(self, rate_hz: int, imu_rate_hz: int = 0, domain: int | None = None) -> None:
        """Have drives with cycles at a rate (Hz), and maybe an IMU with so many readings a second.

        The IMU is in a DDS domain, by default that of the environment.
        """
        self._domain = domain
        self._began = time.monotonic()
        self._pace = CyclePace(1.0 / rate_hz)
        self._imu = ImuSettings(rate_hz=imu_rate_hz, latency=LATENCY) if imu_rate_hz else None

    @property
    def imu(self) -> ImuSettings | None:
        """Prior knowledge of the gyroscope."""
        return self._imu

    @property
    def time(self) -> float:
        """Time since the beginning (s)."""
        return time.monotonic() - self._began

    @contextmanager
    def opened(self, drives: Path, allowed: Allowed) -> Iterator[AllowedDrives]:
        """Open the drives for a block, which must not pause: their watchdogs would act."""
        with opened_drives(connect(str(drives)).open, allowed) as allowed_drives, punctual(DEFAULT_PRIORITY):
            yield allowed_drives

    def wait(self) -> None:
        """Wait for the next cycle."""
        self._pace.wait()

    def record_by_hand(
        self, person: Person, key: str, request: str, scenario: Scenario, drives: Path, out: Path
    ) -> RunDirectory:
        """Record the motors' readings, and those of the IMU, until the person says that the motion is done."""
        samples, readings = list[StampedAngles](), list["StampedReading"]()
        answering = _Answering(person, key, request, scenario)
        with ExitStack() as stack:
            allowed = Allowed(motor_torque_limit(scenario) or 0.0, math.inf)
            allowed_drives = stack.enter_context(self.opened(drives, allowed))
            collector = None
            if self._imu is not None:
                # with ROS, which nothing else here needs
                from fivebar_bringup.ros.imu_collector import ImuCollector

                collector = stack.enter_context(ImuCollector(self._domain_of_imu()))
                readings = collector.readings
            answering.start()
            while answering.is_alive():
                self.wait()
                first, second = allowed_drives.exchange().readings
                if first is not None and second is not None:
                    samples.append(StampedAngles(time.time_ns(), (first.position, second.position)))
                if collector is not None:
                    collector.take_those_there()
        answering.conclude()
        if self._imu is not None and not readings:
            raise GateClosed("imu_silent", f"no readings on {IMU_DATA.name}: start the IMU's driver in this DDS domain")
        run = new_run_directory(out, scenario)
        write_motion_by_hand(samples, readings, run.bag)
        return run

    def run(self, scenario: Scenario, drives: Path, out: Path, page: bool) -> tuple[RunDirectory, Summary]:
        """Run a scenario with the graph of nodes, whose bridge enables the drives as soon as all nodes are ready."""
        real = RealDrives(str(drives), None, activate=True)
        domain = self._domain if self._imu is None else self._domain_of_imu()
        options = RunOptions(Mode.REALTIME, out, domain, with_page=page)
        return run_with_ros(scenario, options, real, Scheduling(DEFAULT_PRIORITY))

    def close(self) -> None:
        """Do nothing: drives are open during a step only."""

    def _domain_of_imu(self) -> int:
        return domain_of_environment() if self._domain is None else self._domain


class _Answering(threading.Thread):
    """A person who is asked to do something, and answers once it is done, while the robot is recorded."""

    def __init__(self, person: Person, key: str, request: str, scenario: Scenario) -> None:
        # what waits for a line cannot be interrupted, and must not keep the program from ending
        super().__init__(daemon=True)
        self._person, self._key, self._request, self._task = person, key, request, Lead(scenario)
        self._error: Exception | None = None

    def run(self) -> None:
        try:
            self._person.does(self._key, self._request, self._task)
        except Exception as error:
            self._error = error

    def conclude(self) -> None:
        """Raise what the person has ended with, if it is no answer."""
        if self._error is not None:
            raise self._error


def write_motion_by_hand(samples: list[StampedAngles], readings: list[StampedReading], directory: Path) -> None:
    """Write what was recorded of a motion by hand."""
    with BagWriter(directory, [MOTOR_STATES, IMU_DATA]) as bag:
        for sample in samples:
            message = serialize.joint_state(sample.stamp, ACTIVE_JOINTS, sample.angles, effort=(0.0, 0.0))
            bag.write(MOTOR_STATES, sample.stamp, message)
        for reading in readings:
            message = serialize.imu(reading.stamp, IMU_FRAME, reading.angular_velocity, reading.acceleration)
            bag.write(IMU_DATA, reading.stamp, message)
        bag.close({})
