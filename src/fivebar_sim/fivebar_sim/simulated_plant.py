# SPDX-License-Identifier: Apache-2.0
"""The simulated robot with all its sensors, as a robot that takes a torque and returns readings, sample by sample."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

from fivebar_description.extra_sensor import MountedSensor
from fivebar_description.imu import ImuSettings
from fivebar_description.interface import EXTRA_READINGS, PASSIVE_STATES, sample_stamp_ns
from fivebar_description.parameters import FiveBar
from fivebar_description.readings import (
    Pair,
    Quadruple,
    SensorReadings,
    TimedAngle,
    TimedPosition,
    TimedTurn,
    TimedValue,
    time_of_stamp,
)
from fivebar_description.sensors import PassiveEncoder
from fivebar_sim.effects.gyroscope import ImuClock
from fivebar_sim.effects.settings import PlantSettings
from fivebar_sim.plant import Measurement
from fivebar_sim.scalar_sensors import ScalarReading, scalar_sensors
from fivebar_sim.sensors import ImuReading, ReadingQueue, imu_queue


class SampledRobot(Protocol):
    """A robot that is measured, and moved on by a sample with each command; `Plant` is one."""

    def measure(self) -> Measurement:
        """Return the joint readings of the current sample; called first, and once per sample."""
        ...

    def measure_imu(self) -> ImuReading:
        """Return the IMU's reading of the current sample."""
        ...

    def truth(self) -> Measurement:
        """Return the exact joint states of the current sample, as far as they are known."""
        ...

    def advance(self, command: Pair) -> None:
        """Answer the current sample by torques (Nm), and go on to the next one.

        Raises:
            PlantDiverged: the motion is too fast for an accurate integration.
        """
        ...


class SeenPlatform(Protocol):
    """A position by the camera, with the stamp (ns) of its exposure."""

    @property
    def stamp(self) -> int:
        """Stamp of the exposure (ns)."""

    @property
    def reading(self) -> tuple[float, float, float, float, float]:
        """x, y, their standard deviations (m), and the correlation of the errors."""


class SimulatedCamera(Protocol):
    """A camera, and who reads its pictures."""

    def arrived(self, sample: int, truth: Measurement) -> Sequence[SeenPlatform]:
        """Return what comes with a sample, given the exact joint states at it."""


class SensedRobot(Protocol):
    """The sections of a scenario that describe a simulated robot and its sensors."""

    @property
    def rate_hz(self) -> int:
        """Samples per second."""

    @property
    def estimated(self) -> bool:
        """Whether only the motors' angles are measured."""

    @property
    def plant(self) -> PlantSettings:
        """The robot."""

    @property
    def imu(self) -> ImuSettings:
        """Its IMU."""

    @property
    def passive(self) -> PassiveEncoder:
        """Its encoder on a passive joint."""

    def extra(self) -> MountedSensor | None:
        """Return its sensor from another package, None without one."""

    def actual_robot(self) -> FiveBar:
        """Return the robot with its actual parameters."""


class SimulatedPlant:
    """A robot with encoders, IMU, encoder on a passive joint and camera, to be stepped once a period."""

    def __init__(
        self,
        scenario: SensedRobot,
        robot: Callable[[], SampledRobot],
        camera: Callable[[], SimulatedCamera | None] = lambda: None,
    ) -> None:
        """Make a robot with sensors; call `reset` before the first step.

        Args:
            scenario: of its sensors.
            robot: makes the robot at rest where the motion starts.
            camera: makes the camera, None for none.
        """
        self._scenario, self._robot_of, self._camera_of = scenario, robot, camera
        self._number = -1

    def reset(self) -> SensorReadings:
        """Put the robot where the motion starts, at rest, and return the readings of sample 0."""
        scenario, rate_hz = self._scenario, self._scenario.rate_hz
        seed, faults = scenario.plant.seed, scenario.plant.gyroscope
        self._robot = self._robot_of()
        self._imu: ReadingQueue[ImuReading] = imu_queue(scenario.imu, faults, rate_hz, seed)
        self._imu_clock = ImuClock(scenario.imu, faults, rate_hz, seed)
        self._scalars = scalar_sensors(scenario.passive, scenario.extra(), scenario.actual_robot(), rate_hz, seed)
        self.camera = self._camera_of()
        """The camera, None where there is none."""
        self._number = 0
        return self._readings()

    def step(self, torque: Sequence[float]) -> SensorReadings:
        """Apply a torque (Nm) that answers the present sample, and return the readings of the next one.

        Raises:
            PlantDiverged: the motion is too fast for an accurate integration.
            ValueError: a torque is not a number, or `reset` was not called before.
        """
        if self._number < 0:
            raise ValueError("step: expected reset before")
        tau1, tau2 = torque
        self._robot.advance((tau1, tau2))
        self._number += 1
        return self._readings()

    @property
    def truth(self) -> Measurement:
        """The exact joint states of the present sample: rad, rad/s, and the torques applied before it (Nm)."""
        return self._robot.truth()

    def _readings(self) -> SensorReadings:
        number, rate_hz = self._number, self._scenario.rate_hz
        measured = self._robot.measure()
        angles, torques = measured.of_motors()
        position: Quadruple | None = None
        velocity: Quadruple | None = None
        if not self._scenario.estimated:
            (q11, q12, q21, q22), (dq11, dq12, dq21, dq22) = measured.position, measured.velocity
            position, velocity = (q11, q12, q21, q22), (dq11, dq12, dq21, dq22)
        readings = SensorReadings(number / rate_hz, angles, torques, position, velocity)
        return self._with_late(readings, number)

    def _with_late(self, readings: SensorReadings, number: int) -> SensorReadings:
        """Read the other sensors at a sample, and return its readings with what comes with it."""
        rate_hz = self._scenario.rate_hz
        imu = tuple(
            TimedTurn(
                time_of_stamp(self._imu_clock.stamp_ns(made_at)),
                turn.angular_velocity,
                turn.acceleration,
            )
            for made_at, turn in self._imu.arrived(number, self._robot.measure_imu())
        )
        scalars: list[ScalarReading] = []
        if self._scalars:
            exact = self._robot.truth().position
            scalars = [scalar for sensor in self._scalars for scalar in sensor.arrived(number, exact)]
        timed = [
            (scalar.topic, time_of_stamp(sample_stamp_ns(scalar.made, rate_hz)), scalar.value) for scalar in scalars
        ]
        seen: tuple[TimedPosition, ...] = ()
        if self.camera is not None:
            seen = tuple(
                TimedPosition(time_of_stamp(sight.stamp), *sight.reading)
                for sight in self.camera.arrived(number, self._robot.truth())
            )
        return readings._replace(
            imu=imu,
            passive_angles=tuple(TimedAngle(*fields) for topic, *fields in timed if topic == PASSIVE_STATES),
            camera=seen,
            extra=tuple(TimedValue(*fields) for topic, *fields in timed if topic == EXTRA_READINGS),
        )
