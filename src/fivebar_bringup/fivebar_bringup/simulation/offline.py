# SPDX-License-Identifier: Apache-2.0
"""A run without ROS: the same plant and control laws in one process, leaving the same bag as the node graph."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, Protocol

from fivebar_bringup.bag import serialize
from fivebar_bringup.bag.writer import BagWriter
from fivebar_bringup.scenario import Scenario, scalar_topics
from fivebar_bringup.simulation.outcome import FAULT_NAMES, FAULT_NUMBERS
from fivebar_bringup.simulation.settings import cycle_settings
from fivebar_control.compiling import bound
from fivebar_control.estimation.imu_check import ImuCheck
from fivebar_control.laws.torque import ZERO, Torque
from fivebar_control.loop.closed_loop import (
    PLANT_DIVERGED,
    Advanced,
    Known,
    LoopSettings,
    first_memory,
    law_functions,
    run_loop,
)
from fivebar_control.loop.cycle import Cycle, CycleSettings
from fivebar_control.loop.plan_sample import PlanSample, plan_sample, planned_references, reference_ahead
from fivebar_control.loop.supervisor import SupervisorState
from fivebar_control.model.kinematics import state_from_joints
from fivebar_control.model.state import Platform, State
from fivebar_control.safety.stages import NO_FAULT, fault_of
from fivebar_description.interface import (
    ACTIVE_JOINTS,
    ALL_WELL,
    DRIVES_STATE,
    ESTIMATION_TOPICS,
    EXTRA_NAME,
    FAULTS,
    GROUND_TRUTH,
    IMU_DATA,
    IMU_ERROR,
    IMU_FRAME,
    JOINT_STATES,
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
    late_stamp_ns,
    moment_of_stamp,
    sample_of_stamp,
    sample_stamp_ns,
)
from fivebar_description.optional import CAMERA_ON, CAMERA_SIMULATION, optional_part
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
from fivebar_sim.effects.gyroscope import ImuClock
from fivebar_sim.plant import Measurement, Plant, PlantDiverged
from fivebar_sim.scalar_sensors import ScalarReading, scalar_sensors
from fivebar_sim.sensors import ImuReading, ReadingQueue, imu_queue

if TYPE_CHECKING:
    from fivebar_control.estimation.estimator import StateEstimator, Vector6
    from fivebar_control.estimation.late_reading import LateReading
    from fivebar_control.estimation.platform_reading import StampedPosition

NOTHING_MEASURED = Measurement((), (), ())


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
        found: dict[str, Sequence[float] | None] = {
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
            found |= {
                MOTOR_ANGLE.name: angles,
                MOTOR_EFFORT.name: torques,
                ESTIMATE_DEVIATION.name: deviations,
                DISTURBANCE.name: disturbance,
            }
        if self.truth is not None:
            found |= {
                TRUE_POSITION.name: self.truth.position,
                TRUE_VELOCITY.name: self.truth.velocity,
                TRUE_EFFORT.name: self.truth.effort,
            }
        return {name: values for name, values in found.items() if values is not None}


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

    def advance(self, command: Torque) -> None:
        """Answer the current sample by torques (Nm), and go on to the next one.

        Raises:
            PlantDiverged: the motion is too fast for an accurate integration.
        """
        ...


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
    plan, rate_hz = scenario.plan(), scenario.rate_hz
    if plant is None:
        plant = Plant(scenario.five_bar(), scenario.initial_joints(), rate_hz, scenario.plant, scenario.imu)
    control = cycle_settings(scenario)
    first = first_memory(scenario.scheme(), control, lambda: planned_references(plan, rate_hz))
    last, feed_forward = plan.path.samples(rate_hz), scenario.compensates_disturbance
    settings = LoopSettings(control, 0, last, scenario.lead_samples, feed_forward)
    loop = bound(run_loop, **law_functions(scenario.scheme()))
    finished: OfflineRun = loop(_Run(scenario, plant, settings, progress, stopped), settings, first)
    return finished


class _Run:
    """A run of a scenario, as the closed loop runs it: the plant and its sensors, the estimator, and the samples."""

    def __init__(
        self,
        scenario: Scenario,
        plant: SampledRobot,
        settings: LoopSettings,
        progress: Callable[[int], None],
        stopped: Callable[[], bool],
    ) -> None:
        self._scenario, self._settings, self._progress, self._stopped = scenario, settings, progress, stopped
        self._robot, self._plan, self._rate_hz = scenario.five_bar(), scenario.plan(), scenario.rate_hz
        self._ahead = scenario.tuned().samples_ahead
        self._plant = plant
        self._sensors = _Sensors(scenario, plant)
        self._estimator: StateEstimator | None = None
        if scenario.estimated:
            # here, because most runs measure all joints
            from fivebar_bringup.simulation.estimator import estimator_of

            self._estimator = estimator_of(scenario)
        self._imu_check = ImuCheck(self._robot, self._plan.mode1, self._plan.mode2, self._rate_hz, scenario.imu)
        self._measured = NOTHING_MEASURED
        self._estimated: Estimated | None = None
        self._samples: list[Sample] = []
        self._faults: list[str] = []

    def estimate(self, number: int) -> Known:
        sensors, d1, d2, trip = self._sensors, 0.0, 0.0, NO_FAULT
        self._measured = self._plant.measure()
        sensors.read(number)
        if self._estimator is not None:
            angles, torques = motors = self._measured.of_motors()
            found = self._estimator.take(number, *angles, *torques, sensors.readings())
            self._measured = Measurement(found.position, found.velocity, found.effort)
            self._estimated = Estimated(motors, found.deviations, found.disturbance)
            d1, d2 = found.disturbance
            if self._estimator.fault is not None:
                trip = FAULT_NUMBERS[self._estimator.fault.name]
        state = state_from_joints(self._robot, *self._measured.position, *self._measured.velocity)
        return Known(True, state, d1, d2, trip)

    def plan_at(self, moment: int) -> PlanSample:
        ahead = reference_ahead(self._plan, moment, self._rate_hz, self._ahead)
        return plan_sample(self._robot, self._plan, moment / self._rate_hz, ahead)

    def record(self, number: int, known: Known, planned: PlanSample, cycle: Cycle, latched: bool) -> None:
        control, sensors, scenario = self._settings.control, self._sensors, self._scenario
        if latched and not self._faults and self._estimator is not None:
            self._faults.append(str(self._estimator.fault))
        if cycle.fault != NO_FAULT:
            self._faults.append(_fault_text(number, control, known.state, planned, cycle))
        sample = Sample(
            number,
            self._measured,
            [
                ImuSample(stamp, moment_of_stamp(stamp, self._rate_hz), one, self._imu_error(stamp, one))
                for stamp, one in sensors.imu
            ],
            sensors.scalars,
            planned.platform,
            SupervisorState(cycle.sigma, cycle.kappa),
            cycle.nominal,
            cycle.constraint if control.blended else None,
            None if latched else cycle.requested,
            cycle.command,
            self._estimated,
            self._plant.truth() if scenario.has_ground_truth else None,
            sensors.vision,
            sensors.compared(number, known.state),
        )
        self._samples.append(sample)
        self._progress(number)

    def _imu_error(self, stamp: int, reading: ImuReading) -> float | None:
        """Return measured minus desired magnitude of the acceleration (m/s^2), None where there is none to compare."""
        made = sample_of_stamp(stamp, self._rate_hz)
        # the reference of the first `lead` moments is never published
        if made is None or not self._settings.lead <= made <= self._settings.last:
            return None
        return self._imu_check.error(reading.acceleration, self._plan.path.at(made / self._rate_hz))

    def ended(self, fault: int) -> bool:
        return self._stopped()

    def advance(self, number: int, command: Torque) -> Advanced:
        if self._estimator is not None:
            self._estimator.commanded(number, *command)
        try:
            self._plant.advance(command)
        except PlantDiverged as failure:
            self._faults.append(f"{FAULT_NAMES[PLANT_DIVERGED]}: after sample {number}: {failure}")
            return Advanced(True)
        return Advanced(False)

    def conclude(self) -> OfflineRun:
        return OfflineRun(self._samples, self._faults)


class _Sensors:
    """The late sensors of a run: IMU, those of one value, and camera."""

    def __init__(self, scenario: Scenario, plant: SampledRobot) -> None:
        self._scenario, self._plant, self._rate_hz = scenario, plant, scenario.rate_hz
        seed, faults = scenario.plant.seed, scenario.plant.gyroscope
        self._imu: ReadingQueue[ImuReading] = imu_queue(scenario.imu, faults, self._rate_hz, seed)
        self._imu_clock = ImuClock(scenario.imu, faults, self._rate_hz, seed)
        self._scalars = scalar_sensors(scenario.passive, scenario.extra(), scenario.actual_robot(), self._rate_hz, seed)
        self._camera = optional_part(CAMERA_SIMULATION, CAMERA_ON)(scenario) if scenario.camera.on else None
        self.imu: list[tuple[int, ImuReading]] = []
        self.scalars: list[ScalarReading] = []
        self.vision: tuple[StampedPosition, ...] = ()
        """Readings that came with the sample: of the IMU by their stamps (ns), of one value, positions."""

    def read(self, number: int) -> None:
        """Read all at a sample, and take what comes with it."""
        plant = self._plant
        self.imu = [
            (late_stamp_ns(made, self._rate_hz, self._imu_clock.offset(made)), one)
            for made, one in self._imu.arrived(number, plant.measure_imu())
        ]
        if self._scalars:
            angles = plant.truth().position
            self.scalars = [one for sensor in self._scalars for one in sensor.arrived(number, angles)]
        if self._camera is not None:
            self.vision = self._camera.arrived(number, plant.truth())

    def readings(self) -> list[LateReading]:
        """Return the readings for the estimator."""
        from fivebar_control.estimation.late_reading import CAMERA, EXTRA, GYROSCOPE, PASSIVE, LateReading
        from fivebar_control.estimation.platform_reading import used

        scenario = self._scenario
        found = [LateReading(EXTRA if one.name == EXTRA_NAME else PASSIVE, one.made, one.value) for one in self.scalars]
        if scenario.gyro:
            usable_rate = scenario.imu.usable_rate
            found += [
                LateReading(GYROSCOPE, moment_of_stamp(stamp, self._rate_hz), usable_rate(one.angular_velocity))
                for stamp, one in self.imu
            ]
        if scenario.sees:
            found += [LateReading(CAMERA, one.moment, *used(one.reading)) for one in self.vision]
        return found

    def compared(self, number: int, state: State) -> VisionErrors:
        """Return the stamps (ns) of exposures that can be compared with a sample's state, and the differences (m)."""
        if self._camera is None:
            return ()
        compared: VisionErrors = self._camera.compared(number, self.vision, state.x, state.y)
        return compared


def _fault_text(number: int, settings: CycleSettings, state: State, planned: PlanSample, cycle: Cycle) -> str:
    sigma = cycle.sigma if settings.blended else 0.0
    fault = fault_of(
        cycle.fault,
        settings.limits,
        settings.robot,
        settings.mode1,
        settings.mode2,
        state,
        planned.platform.x,
        planned.platform.y,
        cycle.requested,
        sigma,
    )
    return f"{fault.name}: at sample {number}: {fault.detail}"


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
        if (fields := {one.field: values[one.name] for one in carried if one.name in values})
    ]
    messages.append((SUPERVISOR_SIGMA, serialize.float64(sample.supervisor.sigma)))
    messages += [
        (IMU_DATA, serialize.imu(one.stamp, IMU_FRAME, one.reading.angular_velocity, one.reading.acceleration))
        for one in sample.imu
    ]
    messages += [(IMU_ERROR, serialize.float64(one.error)) for one in sample.imu if one.error is not None]
    messages += [
        (one.topic, serialize.joint_state(sample_stamp_ns(one.made, scenario.rate_hz), (one.name,), (one.value,)))
        for one in sample.scalars
    ]
    messages += [
        (VISION_PLATFORM, serialize.joint_state(one.stamp, VISION_NAMES, one.reading)) for one in sample.vision
    ]
    messages += [
        (VISION_ERROR, serialize.joint_state(made, PLATFORM_NAMES, difference))
        for made, difference in sample.vision_errors
    ]
    return messages


def _reference(platform: Platform, stamp: int) -> bytes:
    x, y, vx, vy, ax, ay = platform
    return serialize.joint_state(stamp, REFERENCE_NAMES, (x, y, vx, vy), (vx, vy, ax, ay))
