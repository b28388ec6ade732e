"""A run without ROS: the same plant and control laws in one process, leaving the same bag as the node graph."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from fivebar_bringup.recorded.bag import serialize
from fivebar_bringup.recorded.bag.writer import BagWriter
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.estimator import estimator_of
from fivebar_bringup.simulation.settings import cycle_settings
from fivebar_bringup.simulation.vision import SimulatedVision, VisionSample
from fivebar_control.estimation.estimator import PositionFix, Vector6
from fivebar_control.estimation.imu_check import ImuCheck
from fivebar_control.laws.reference import against_disturbance
from fivebar_control.laws.torque import ZERO, Torque
from fivebar_control.loop.cycle import Cycle, CycleSettings, control_cycle
from fivebar_control.loop.plan_sample import PlanSample, plan_sample, planned_references, reference_ahead
from fivebar_control.loop.setup import first_memory, steps_of
from fivebar_control.loop.supervisor import SupervisorState
from fivebar_control.model.kinematics import state_from_joints
from fivebar_control.model.state import Platform, State
from fivebar_control.safety.stages import NO_FAULT, fault_of
from fivebar_control.vision.reading import used
from fivebar_description.interface import (
    ACTIVE_JOINTS,
    ALL_WELL,
    DRIVES_STATE,
    ESTIMATION_TOPICS,
    FAULTS,
    GROUND_TRUTH,
    IMU_DATA,
    IMU_ERROR,
    IMU_FRAME,
    JOINT_STATES,
    NANOSECONDS,
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
    late_stamp_ns,
    moment_of_stamp,
    sample_of_stamp,
    sample_stamp_ns,
)
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
from fivebar_sim.imu import ImuReading
from fivebar_sim.passive_encoder import passive_numbers, passive_reading
from fivebar_sim.plant import Measurement, Plant, PlantDiverged
from fivebar_sim.readings import PASSIVE_LOSSES, ReadingQueue


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


class PassiveSample(NamedTuple):
    """A reading of the encoder on a passive joint: the sample at which it was made, and the angle (rad)."""

    made: int
    angle: float


class Sample(NamedTuple):
    """Data of one sample of the closed loop.

    Attributes:
        number: of the sample.
        measured: the joint states that the controllers use, measured or estimated.
        imu: readings that came with the sample.
        passive: those of the encoder on a passive joint that came with it.
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
    passive: list[PassiveSample]
    reference: Platform
    supervisor: SupervisorState
    nominal: Torque
    constraint: Torque | None
    requested: Torque | None
    command: Torque
    estimated: Estimated | None = None
    truth: Measurement | None = None
    vision: tuple[VisionSample, ...] = ()
    vision_errors: tuple[tuple[int, tuple[float, float]], ...] = ()

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


class OfflineRun(NamedTuple):
    """A finished run: its samples, and the faults as they would be published."""

    samples: list[Sample]
    faults: list[str]


def simulate(
    scenario: Scenario,
    progress: Callable[[int], None] = lambda sample: None,
    plant: Plant | None = None,
    stopped: Callable[[], bool] = lambda: False,
) -> OfflineRun:
    """Run a scenario in this process.

    Args:
        scenario: what is to be run.
        progress: called with each finished sample's number.
        plant: the robot to be moved, by default the one that the scenario describes.
        stopped: says after each sample whether the run is to end with it.
    """
    robot, plan, rate_hz, lead = scenario.five_bar(), scenario.plan(), scenario.rate_hz, scenario.lead_samples
    if plant is None:
        plant = Plant(robot, scenario.initial_joints(), rate_hz, scenario.plant, scenario.imu)
    imu_check = ImuCheck(robot, plan.mode1, plan.mode2, rate_hz, scenario.imu)
    nominal_step, constraint_step = steps_of(scenario.scheme())
    settings = cycle_settings(scenario)
    memory = first_memory(scenario.scheme(), settings, lambda: planned_references(plan, rate_hz))
    samples_ahead = scenario.tuned().samples_ahead
    estimator = estimator_of(scenario) if scenario.estimated else None
    queue: ReadingQueue[ImuReading] = ReadingQueue(scenario.imu, rate_hz, scenario.plant.seed)
    passive_queue: ReadingQueue[float] = ReadingQueue(scenario.passive, rate_hz, scenario.plant.seed, PASSIVE_LOSSES)
    encoder = passive_numbers(scenario.passive, scenario.plant.seed)
    camera = SimulatedVision(scenario) if scenario.camera.on else None
    samples: list[Sample] = []
    faults: list[str] = []
    last = plan.path.samples(rate_hz)
    for number in range(last + 1):
        measured = plant.measure()
        arrived = [
            (late_stamp_ns(made, rate_hz, scenario.imu.clock_offset), one)
            for made, one in queue.arrived(number, plant.measure_imu())
        ]
        angles: list[tuple[int, float]] = []
        if scenario.passive.leg:
            angle = passive_reading(encoder, plant.truth().position[scenario.passive.place])
            angles = passive_queue.arrived(number, angle)
        vision = camera.arrived(number, plant.truth()) if camera is not None else ()
        estimated = None
        if estimator is not None:
            motors = measured.of_motors()
            rates = [
                (moment_of_stamp(stamp, rate_hz), scenario.imu.turn_rate(one.angular_velocity))
                for stamp, one in arrived
                if scenario.gyro
            ]
            seen = [PositionFix(one.moment, *used(one.reading)) for one in vision] if scenario.sees else []
            estimate = estimator.take(number, *motors[0], *motors[1], rates, angles, seen)
            if estimator.fault is not None and not faults:
                faults.append(str(estimator.fault))
            measured = Measurement(estimate.position, estimate.velocity, estimate.effort)
            estimated = Estimated(motors, estimate.deviations, estimate.disturbance)
        state = state_from_joints(robot, *measured.position, *measured.velocity)
        compared = camera.compared(number, vision, state.x, state.y) if camera is not None else ()
        moment = number + lead
        planned = plan_sample(robot, plan, moment / rate_hz, reference_ahead(plan, moment, rate_hz, samples_ahead))
        reference = planned.reference
        if estimated is not None and scenario.compensates_disturbance:
            reference = against_disturbance(reference, *estimated.disturbance)
        latched, sound = bool(faults), estimator is None or estimator.fault is None
        cycle = control_cycle(
            nominal_step, constraint_step, settings, memory, state, reference, planned, latched, sound
        )
        memory = cycle.memory
        if cycle.fault != NO_FAULT:
            faults.append(_fault_text(number, settings, state, planned, cycle))
        # the reference of the first `lead` moments is never published, so that there is none to compare with
        imu = []
        for stamp, one in arrived:
            made, error = sample_of_stamp(stamp, rate_hz), None
            if made is not None and lead <= made <= last:
                error = imu_check.error(one.acceleration, plan.path.at(made / rate_hz))
            imu.append(ImuSample(stamp, moment_of_stamp(stamp, rate_hz), one, error))
        samples.append(
            Sample(
                number,
                measured,
                imu,
                [PassiveSample(*one) for one in angles],
                planned.platform,
                SupervisorState(cycle.sigma, cycle.kappa),
                cycle.nominal,
                cycle.constraint if settings.blended else None,
                None if latched else cycle.requested,
                cycle.command,
                estimated,
                plant.truth() if scenario.has_ground_truth else None,
                vision,
                compared,
            )
        )
        if estimator is not None:
            estimator.commanded(number, *cycle.command)
        progress(number)
        if stopped():
            break
        if number < last:
            try:
                plant.advance(cycle.command)
            except PlantDiverged as failure:
                faults.append(f"plant_diverged: after sample {number}: {failure}")
                break
    return OfflineRun(samples, faults)


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
    if scenario.passive.leg:
        topics.append(PASSIVE_STATES)
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
        bag.write(REFERENCE, sample_stamp_ns(after, rate_hz) - NANOSECONDS // rate_hz, data)
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
    joint = (scenario.passive.joint,)
    messages += [
        (PASSIVE_STATES, serialize.joint_state(sample_stamp_ns(one.made, scenario.rate_hz), joint, (one.angle,)))
        for one in sample.passive
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
