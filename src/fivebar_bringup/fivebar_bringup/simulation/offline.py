# SPDX-License-Identifier: Apache-2.0
"""A run without ROS: the same plant and control laws in one process, leaving the same bag as the node graph."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from fivebar_bringup.bag import serialize
from fivebar_bringup.bag.writer import BagWriter
from fivebar_bringup.scenario import Scenario, scalar_topics
from fivebar_control.controller.motion_controller import ControlOutput, MotionController
from fivebar_control.estimation.imu_check import ImuCheck
from fivebar_control.laws.torque import ZERO, Torque
from fivebar_control.loop.closed_loop import FAULT_NAMES, PLANT_DIVERGED
from fivebar_control.loop.supervisor import SupervisorState
from fivebar_control.model.state import Platform
from fivebar_control.scenario.start import initial_joints
from fivebar_description.interface import (
    ACTIVE_JOINTS,
    ALL_WELL,
    DRIVES_STATE,
    ESTIMATION_TOPICS,
    EXTRA_NAME,
    EXTRA_READINGS,
    FAULTS,
    GROUND_TRUTH,
    IMU_DATA,
    IMU_ERROR,
    IMU_FRAME,
    JOINT_STATES,
    PASSIVE_STATES,
    PLATFORM_NAMES,
    REFERENCE,
    REFERENCE_NAMES,
    SAFETY_STATE,
    SUPERVISOR_SIGMA,
    SUPERVISOR_STATE,
    TORQUE_COMMAND,
    TORQUE_REQUESTED,
    VHC_TORQUE,
    VISION_ERROR,
    VISION_NAMES,
    VISION_PLATFORM,
    VISION_TOPICS,
    Topic,
    moment_of_stamp,
    sample_of_stamp,
    sample_stamp_ns,
)
from fivebar_description.optional import CAMERA_ON, CAMERA_SIMULATION, optional_part
from fivebar_description.readings import SensorReadings, TimedPosition, TimedTurn, stamp_of_time
from fivebar_description.run_quantities import (
    COMMANDED_TORQUE,
    DISTURBANCE,
    ESTIMATE_DEVIATION,
    FEEDBACK_EFFORT,
    FEEDBACK_POSITION,
    FEEDBACK_VELOCITY,
    MOTOR_ANGLE,
    MOTOR_EFFORT,
    REFERENCE_RATE,
    REFERENCE_STATE,
    REQUESTED_TORQUE,
    SUPERVISION,
    TORQUE_OF_CONSTRAINT,
    TORQUE_OF_NOMINAL,
    TRUE_EFFORT,
    TRUE_POSITION,
    TRUE_VELOCITY,
    sampled_topics,
)
from fivebar_sim.plant import Measurement, Plant, PlantDiverged
from fivebar_sim.scalar_sensors import ScalarReading
from fivebar_sim.sensors import ImuReading
from fivebar_sim.simulated_plant import SampledRobot, SimulatedPlant

if TYPE_CHECKING:
    from fivebar_control.estimation.estimator import Vector6
    from fivebar_control.estimation.platform_reading import StampedPosition


class Estimated(NamedTuple):
    """Additional data of a sample where the joint states are estimated.

    Attributes:
        motors: motor angles (rad) and applied torques (Nm), the inputs of the estimator.
        deviations: standard deviations of the estimate.
        disturbance: estimated disturbance torques of both motors (Nm).
    """

    motors: tuple[tuple[float, float], tuple[float, float]]
    deviations: Vector6
    disturbance: tuple[float, float]


VisionErrors = tuple[tuple[int, tuple[float, float]], ...]
"""Stamps (ns) of exposures, and the differences of the camera's positions to those by the joints (m)."""


class ImuSample(NamedTuple):
    """A reading of the IMU.

    Attributes:
        stamp: of its clock (ns).
        made: the moment of that stamp, in samples.
        reading: what was measured.
        error: measured minus desired magnitude of the acceleration (m/s^2), None where they are not compared.
    """

    stamp: int
    made: float
    reading: ImuReading
    error: float | None


class Sample(NamedTuple):
    """Data of one sample of the closed loop.

    Attributes:
        number: of the sample.
        measured: the joint states that the controllers use, measured or estimated.
        imu: readings that came with the sample.
        scalars: those of sensors of one value that came with it.
        reference: at the time for which the joint states hold.
        nominal: torque of the nominal law (Nm).
        constraint: that of the constraint law, None where the controller has no such law.
        requested: torque before limits (Nm), None once a fault is latched.
        estimated: None without an estimator.
        truth: the exact joint states, None where they are not recorded besides.
        vision: what came from the camera with the sample.
        vision_errors: stamp (ns) of each exposure that could be compared now, and the difference to the joints (m).
    """

    number: int
    measured: Measurement
    imu: list[ImuSample]
    scalars: list[ScalarReading]
    reference: Platform
    supervisor: SupervisorState
    nominal: Torque
    constraint: Torque | None
    requested: Torque | None
    command: Torque
    estimated: Estimated | None = None
    truth: Measurement | None = None
    vision: tuple[StampedPosition, ...] = ()
    vision_errors: VisionErrors = ()

    @property
    def exact(self) -> Measurement:
        """The exact joint states, as far as they are recorded."""
        return self.measured if self.truth is None else self.truth

    def values(self) -> dict[str, Sequence[float]]:
        """Return what the sample adds to the table of the run: values by the name of their quantity."""
        x, y, vx, vy, ax, ay = self.reference
        values: dict[str, Sequence[float] | None] = {
            FEEDBACK_POSITION.name: self.measured.position,
            FEEDBACK_VELOCITY.name: self.measured.velocity,
            FEEDBACK_EFFORT.name: self.measured.effort,
            REFERENCE_STATE.name: (x, y, vx, vy),
            REFERENCE_RATE.name: (vx, vy, ax, ay),
            SUPERVISION.name: self.supervisor,
            TORQUE_OF_NOMINAL.name: self.nominal,
            TORQUE_OF_CONSTRAINT.name: self.constraint,
            REQUESTED_TORQUE.name: self.requested,
            COMMANDED_TORQUE.name: self.command,
        }
        if self.estimated is not None:
            (angles, torques), deviations, disturbance = self.estimated
            values |= {
                MOTOR_ANGLE.name: angles,
                MOTOR_EFFORT.name: torques,
                ESTIMATE_DEVIATION.name: deviations,
                DISTURBANCE.name: disturbance,
            }
        if self.truth is not None:
            values |= {
                TRUE_POSITION.name: self.truth.position,
                TRUE_VELOCITY.name: self.truth.velocity,
                TRUE_EFFORT.name: self.truth.effort,
            }
        return {name: numbers for name, numbers in values.items() if numbers is not None}


class OfflineRun(NamedTuple):
    """A finished run: its samples, and the faults as they would be published."""

    samples: list[Sample]
    faults: list[str]


def simulate(
    scenario: Scenario,
    progress: Callable[[int], None] = lambda sample: None,
    plant: SampledRobot | None = None,
    stopped: Callable[[], bool] = lambda: False,
) -> OfflineRun:
    """Run a scenario in this process.

    Args:
        scenario: what is to be run.
        progress: called with each finished sample's number.
        plant: the robot to be moved, by default the one that the scenario describes.
        stopped: says after each sample whether the run is to end with it.
    """
    control, robot = MotionController(scenario), SimulatedPlant(*plant_parts(scenario, plant))
    recorder, samples, faults = _Recorder(scenario, robot), [], []
    readings = robot.reset()
    while True:
        output = control.step(readings)
        samples.append(recorder.sample(readings, output))
        progress(output.sample)
        if control.finished or stopped():
            break
        try:
            readings = robot.step(output.torque)
        except PlantDiverged as failure:
            faults.append(f"{FAULT_NAMES[PLANT_DIVERGED]}: after sample {output.sample}: {failure}")
            break
    return OfflineRun(samples, [*([] if control.fault is None else [str(control.fault)]), *faults])


class PlantParts(NamedTuple):
    """The arguments of a `SimulatedPlant`."""

    scenario: Scenario
    robot: Callable[[], SampledRobot]
    camera: Callable[[], Any]


def plant_parts(scenario: Scenario, robot: SampledRobot | None = None) -> PlantParts:
    """Return the parts of a scenario's simulated robot with its sensors, or of another robot with these."""

    def made() -> SampledRobot:
        return Plant(scenario.five_bar(), initial_joints(scenario), scenario.rate_hz, scenario.plant, scenario.imu)

    def camera() -> Any:
        return optional_part(CAMERA_SIMULATION, CAMERA_ON)(scenario) if scenario.camera.on else None

    return PlantParts(scenario, made if robot is None else lambda: robot, camera)


class _Recorder:
    """Makes the samples of a run from what its robot reads and its controller answers."""

    def __init__(self, scenario: Scenario, robot: SimulatedPlant) -> None:
        self._scenario, self._robot, self._rate_hz = scenario, robot, scenario.rate_hz
        self._plan = plan = scenario.plan()
        self._last, self._lead = plan.path.samples(self._rate_hz), scenario.lead_samples
        self._check = ImuCheck(scenario.five_bar(), plan.mode, self._rate_hz, scenario.imu)

    def sample(self, readings: SensorReadings, output: ControlOutput) -> Sample:
        scenario, known = self._scenario, output.estimate
        assert known is not None and readings.motor_angles is not None and readings.motor_torques is not None
        estimated: Estimated | None = None
        if known.deviations is not None:
            motors = readings.motor_angles, readings.motor_torques
            estimated = Estimated(motors, known.deviations, known.disturbance)
        vision = tuple(self._seen(position) for position in readings.camera)
        return Sample(
            output.sample,
            Measurement(known.position, known.velocity, known.effort),
            [self._imu(turn) for turn in readings.imu],
            self._scalars(readings),
            output.reference,
            SupervisorState(output.sigma, output.kappa),
            output.nominal,
            output.constraint,
            output.requested,
            output.torque,
            estimated,
            self._robot.truth if scenario.has_ground_truth else None,
            vision,
            self._compared(output.sample, vision, known.x, known.y),
        )

    def _scalars(self, readings: SensorReadings) -> list[ScalarReading]:
        joint = self._scenario.passive.joint
        angles = [(joint, PASSIVE_STATES, self._made(angle.time), angle.angle) for angle in readings.passive_angles]
        values = [(EXTRA_NAME, EXTRA_READINGS, self._made(reading.time), reading.value) for reading in readings.extra]
        return [ScalarReading(*reading) for reading in (*angles, *values)]

    def _made(self, time: float) -> int:
        """Return the sample at which a reading was made that is stamped by the clock of the run."""
        return round(time * self._rate_hz)

    def _seen(self, position: TimedPosition) -> StampedPosition:
        # here, because most runs have no camera
        from fivebar_control.estimation.platform_reading import PlatformReading, StampedPosition

        stamp = stamp_of_time(position.time)
        return StampedPosition(stamp, moment_of_stamp(stamp, self._rate_hz), PlatformReading(*position[1:]))

    def _imu(self, turn: TimedTurn) -> ImuSample:
        assert turn.acceleration is not None
        stamp, reading = stamp_of_time(turn.time), ImuReading(turn.acceleration, turn.angular_velocity)
        return ImuSample(stamp, moment_of_stamp(stamp, self._rate_hz), reading, self._imu_error(stamp, reading))

    def _imu_error(self, stamp: int, reading: ImuReading) -> float | None:
        """Return measured minus desired magnitude of the acceleration (m/s^2), None where there is none to compare."""
        sample = sample_of_stamp(stamp, self._rate_hz)
        # the reference of the first `lead` moments is never published
        if sample is None or not self._lead <= sample <= self._last:
            return None
        return self._check.error(reading.acceleration, self._plan.path.at(sample / self._rate_hz))

    def _compared(self, number: int, vision: tuple[StampedPosition, ...], x: float, y: float) -> VisionErrors:
        """Return the stamps (ns) of exposures that can be compared with a sample's state, and the differences (m)."""
        camera: Any = self._robot.camera
        if camera is None:
            return ()
        compared: VisionErrors = camera.compared(number, vision, x, y)
        return compared


def write_bag(run: OfflineRun, scenario: Scenario, directory: Path) -> None:
    """Write a run as the bag that the node graph would have left; log times are the stamps."""
    nominal = scenario.scheme().nominal.topic
    topics = [JOINT_STATES, IMU_DATA, REFERENCE, nominal, SUPERVISOR_STATE, SUPERVISOR_SIGMA, TORQUE_COMMAND]
    topics += [TORQUE_REQUESTED, IMU_ERROR, FAULTS, SAFETY_STATE, DRIVES_STATE]
    if run.samples[0].constraint is not None:
        topics.append(VHC_TORQUE)
    if scenario.estimated:
        topics += ESTIMATION_TOPICS
    topics += scalar_topics(scenario)
    if scenario.has_ground_truth:
        topics.append(GROUND_TRUTH)
    if scenario.camera.on:
        topics += VISION_TOPICS if scenario.camera.pictures else (VISION_PLATFORM,)
    rate_hz = scenario.rate_hz
    path = scenario.plan().path
    with BagWriter(directory, topics) as bag:
        for sample in run.samples:
            stamp = sample_stamp_ns(sample.number, rate_hz)
            for topic, data in _messages(sample, stamp, nominal, scenario):
                bag.write(topic, stamp, data)
        # the trajectory generator is one sample ahead
        after = run.samples[-1].number + 1
        data = _reference(path.at((after + scenario.lead_samples) / rate_hz), sample_stamp_ns(after, rate_hz))
        bag.write(REFERENCE, sample_stamp_ns(after, rate_hz), data)
        # a blender that is stopped commands zero torque last
        stamp = sample_stamp_ns(run.samples[-1].number, rate_hz)
        bag.write(TORQUE_COMMAND, stamp, serialize.joint_state(stamp, ACTIVE_JOINTS, effort=ZERO))
        for fault in run.faults:
            bag.write(FAULTS, stamp, serialize.string(fault))
        first = sample_stamp_ns(0, rate_hz)
        for topic in (SAFETY_STATE, DRIVES_STATE):
            bag.write(topic, first, serialize.string(ALL_WELL))
        for fault in run.faults[:1]:
            bag.write(SAFETY_STATE, stamp, serialize.string(fault))
        bag.close({"dropped": "0"})


def _messages(sample: Sample, stamp: int, nominal: Topic, scenario: Scenario) -> list[tuple[Topic, bytes]]:
    """Return the messages of a sample: those of its quantities, and those that have stamps of their own."""
    values = sample.values()
    messages = [
        (topic, serialize.joint_state(stamp, carried[0].names, **fields))
        for topic, carried in sampled_topics(nominal).items()
        if (fields := {quantity.field: values[quantity.name] for quantity in carried if quantity.name in values})
    ]
    messages.append((SUPERVISOR_SIGMA, serialize.float64(sample.supervisor.sigma)))
    messages += [
        (IMU_DATA, serialize.imu(turn.stamp, IMU_FRAME, turn.reading.angular_velocity, turn.reading.acceleration))
        for turn in sample.imu
    ]
    messages += [(IMU_ERROR, serialize.float64(turn.error)) for turn in sample.imu if turn.error is not None]
    messages += [
        (
            scalar.topic,
            serialize.joint_state(sample_stamp_ns(scalar.made, scenario.rate_hz), (scalar.name,), (scalar.value,)),
        )
        for scalar in sample.scalars
    ]
    messages += [
        (VISION_PLATFORM, serialize.joint_state(seen.stamp, VISION_NAMES, seen.reading)) for seen in sample.vision
    ]
    messages += [
        (VISION_ERROR, serialize.joint_state(exposed, PLATFORM_NAMES, difference))
        for exposed, difference in sample.vision_errors
    ]
    return messages


def _reference(platform: Platform, stamp: int) -> bytes:
    x, y, vx, vy, ax, ay = platform
    return serialize.joint_state(stamp, REFERENCE_NAMES, (x, y, vx, vy), (vx, vy, ax, ay))
