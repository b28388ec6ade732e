# SPDX-License-Identifier: Apache-2.0
"""The simulated robot as a node: publishes a sample, applies the torque that answers it, and advances."""

from __future__ import annotations

import math
import time

from diagnostic_msgs.msg import DiagnosticStatus
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu
from std_msgs.msg import String
from std_srvs.srv import Trigger

from fivebar_description.interface import (
    ACTIVE_JOINTS,
    ALL_WELL,
    CAMERA_FRAME,
    CELL_CLOCK,
    CLOCK,
    DRIVES_STATE,
    GROUND_TRUTH,
    IMU_FRAME,
    JOINT_STATES,
    JOINTS,
    MOTOR_STATES,
    NANOSECONDS,
    READINGS_RELEASED,
    RELEASE_BEGINS,
    RELEASE_PRESSES,
    RELEASE_RESTS,
    RELEASE_STATUS,
    RUN_READY,
    SAFETY_STATE,
    START_STAMP_NS,
    TORQUE_COMMAND,
    VISION_PLATFORM,
    unexpected_sample,
)
from fivebar_description.joint_sample import JointSample, MessageError, OneAnswer
from fivebar_description.optional import CAMERA_ON, CAMERA_SIGHTS, optional_part
from fivebar_description.parameters import laden
from fivebar_description.robot_file import load_robot
from fivebar_description.ros.file_parameters import FileParameters
from fivebar_description.ros.messages import stamp_of, to_stamp
from fivebar_description.ros.node import GraphNode
from fivebar_description.ros.process_topics import Sender
from fivebar_description.ros.run import run_node
from fivebar_description.ros.run_agreement import TimeKeeper
from fivebar_description.run_plan import MotionStart, next_epoch
from fivebar_description.shared_settings import LOCKSTEP
from fivebar_sim.effects.mechanism import actual_robot
from fivebar_sim.plant import Plant, PlantDiverged
from fivebar_sim.ros.late_sensors import Arrived, LateSensors
from fivebar_sim.ros.node_settings import LAST_SAMPLE, START_JOINTS, PlantNodeSettings
from fivebar_sim.ros.run_progress import RunProgress
from fivebar_sim.scalar_sensors import ScalarSensor, scalar_sensors
from fivebar_sim.scenario import SimulatedRobot

REPEAT_PERIOD = 0.1
STATUS_PERIOD = 0.2

PERIODS_OF_A_LOSS = 5
"""Periods of repetition without an answer in lockstep after which a sample is published again, in case a message was
lost: the nodes then answer it again. Periods are counted instead of seconds, since after a pause of the whole machine
the answer may already wait here."""

FIRST_ANSWER_TIME = 1.0
"""Longest time (s) for which the clock of real time waits for the answer to sample 0."""

GENERATOR = "trajectory_generator"
"""The node that publishes the plan."""

PATIENCE = 20
"""Periods of repetition after which a plant that awaits no node takes it that nobody publishes a plan."""

FILE_KEYS = ("robot", "rate_hz", "estimator", "plant", "imu", "sensors", "camera")
"""Keys that the plant takes from the run's file."""

ZERO = (0.0, 0.0)

Messages = tuple[JointSample, JointSample | None]
"""Joint states of a sample, and the ground truth where it is published."""


class PlantNode(GraphNode):
    """The simulated five-bar, in lockstep with the controllers or in real time.

    In lockstep, sample k is followed by sample k + 1 as soon as the command that carries stamp k has come. In real
    time, samples follow the steady clock, and the command computed from sample k acts from sample k + 1 on; with drives
    that delay, one sample later still. The motion between two samples is integrated as soon as its torque is known,
    not when the next sample is due: that one is then published at once, and the controllers have the whole period.

    While a fault is latched, here or at the blender, no torque acts, but for the time in which the blender may brake.
    """

    in_chain = True
    commands_robot = True

    def __init__(self) -> None:
        """Make the node."""
        super().__init__("plant")
        settings = self.declare_settings(PlantNodeSettings)
        self._file = file = FileParameters(self, SimulatedRobot, FILE_KEYS).file
        camera = file.camera
        self._rate_hz = file.rate_hz
        # in lockstep time is simulated, and every run has the same stamps
        epoch_ns = START_STAMP_NS if settings.mode == LOCKSTEP else None
        self._run = TimeKeeper(self, self._rate_hz, epoch_ns)
        self._settings = settings
        self._lockstep = settings.mode == LOCKSTEP
        self._command_timeout = settings.command_timeout_s
        self._freshness = settings.freshness_samples
        self._alone = not settings.wait_for_nodes
        self._ready_timeout = settings.ready_timeout_s
        # in real time, drives that delay have the torque for the time ahead when the time begins
        self._known_ahead = not self._lockstep and file.plant.delay_samples > 0
        self._robot, self._payload = load_robot(file.robot), 0.0
        self._made: Plant | None = None
        self._samples = self._without_plan = self._sample = 0
        self._next: Messages | None = None
        self._fault = ""
        self._brake_samples = round(settings.brake_limit_s * self._rate_hz)
        self._torque_until: int | None = None
        self._is_released = False
        self._answer = OneAnswer()
        self._latest: tuple[int, tuple[float, float]] = (-1, ZERO)
        self._published = 0.0
        self._unanswered = 0
        self._to_publish = -1
        self._arrived: Arrived | None = None
        self._sights = None
        if camera.on and self._lockstep:
            self._sights = optional_part(CAMERA_SIGHTS, CAMERA_ON)(camera, self._rate_hz, file.plant.seed)
        self._began = self._heard = time.monotonic()
        self._motors_only = file.estimated
        self._time = self.advertise(CLOCK) if self._lockstep else None
        self._cell_ns = math.inf
        """The time (ns) of the cell up to which samples may be measured."""
        if self._lockstep and settings.follows_clock:
            self._cell_ns = -math.inf
            self.listen(CELL_CLOCK, self._on_cell_clock, awaited=False)
        self._held = False
        self._joint_states = self.advertise(MOTOR_STATES if self._motors_only else JOINT_STATES)
        self._ground_truth = self.advertise(GROUND_TRUTH) if file.has_ground_truth else None
        self._late = LateSensors(
            self, self._run, self._rate_hz, file.imu, file.plant.seed, file.plant.gyroscope, self._scalar_sensors
        )
        self._released: Sender | None = None
        self._state = self.advertise(DRIVES_STATE)
        self._progress = RunProgress(self, settings.samples or 0, settings.wait_for_nodes)
        self.create_service(Trigger, "~/reset", self._on_reset)
        self.listen(TORQUE_COMMAND, self._on_command)
        self.listen(SAFETY_STATE, self._on_safety_state, awaited=False)
        self.listen(RELEASE_STATUS, self._on_release_status, awaited=False)
        self.listen(RUN_READY, self._progress.on_ready)
        self.listen_to_payload(self._carry)
        if self._sights is not None:
            self.listen(VISION_PLATFORM, self._on_sight)
        self.every(STATUS_PERIOD, lambda: self._publish_status("running"))
        self._start_timer = self.every(REPEAT_PERIOD, self._start)
        self._running = False
        self._state.publish(String(data=ALL_WELL))

    def stop(self) -> None:
        """Announce that no more samples will come, so that their absence does not count as a fault."""
        self._state.publish(String(data="drives_off: the plant has ended"))

    def refuse(self, fault: str) -> None:
        """Publish why the run ends before the first sample."""
        self._set_fault(fault)
        self._publish_status("failed")

    def stop_robot(self, fault: str) -> None:
        """Latch a fault: no torque acts from now on."""
        self._latch(fault)

    def health(self) -> tuple[bytes, str]:
        """Return an error while a fault is latched."""
        return (DiagnosticStatus.ERROR, self._fault) if self._fault else super().health()

    def _start(self) -> None:
        """Publish sample 0 once every awaited node is ready, and again until it is answered.

        In lockstep this goes on: a later sample is published again where its answer is long in coming.
        In real time the clock starts with that answer, since the first one takes several periods, or without it.
        """
        if self._made is None:
            self._make_plant()
        lacking = self._progress.missing
        if not lacking and (self._made is None or not self._run.agrees):
            lacking = self._run.problem or f"the plan of {GENERATOR}"
        if lacking:
            if not self._alone:
                self._progress.tell(lacking)
            if not self._alone and time.monotonic() - self._began > self._ready_timeout:
                self._fail(f"nodes_missing: not ready within {self._ready_timeout:g} s: {lacking}")
            return
        if self._alone and not self.count_publishers(TORQUE_COMMAND.name):
            return
        if not self._run.begun:
            # when the clock of real time begins, if sample 0 is answered at once; it is sent with the next call
            begins = self.get_clock().now().nanoseconds + int(2 * REPEAT_PERIOD * NANOSECONDS)
            self._run.begin(next_epoch(begins, self._rate_hz))
            return
        if not self._running:
            self._running = True
            self._heard = time.monotonic()
            self._measured = self._measure(0)
        if self._held:
            # another robot of the cell has not come so far
            self._heard = time.monotonic()
        waited = time.monotonic() - self._heard
        if not self._lockstep and (self._latest[0] >= 0 or waited > FIRST_ANSWER_TIME):
            self._start_timer.cancel()
            self.every(1.0 / self._rate_hz, self._tick)
            return
        if self._sample == 0:
            self._publish_sample()
        elif self._held and self._time is not None:
            # in case the message was lost
            self._time.publish(Clock(clock=to_stamp(self._run.stamp(self._sample))))
        elif self._lockstep:
            self._unanswered += 1
            if self._unanswered % PERIODS_OF_A_LOSS == 0:
                self._repeat()
        if self._known_ahead:
            self._move()
        # started by hand, it waits for whoever is to answer it
        if waited > self._command_timeout and not (self._alone and self._sample == 0):
            missing = f"no torque for sample {self._sample} within {self._command_timeout:g} s"
            # what has stopped the others is the cause
            cause = self.second_publisher or self._fault
            self._fail(f"{cause}; {missing}" if cause else f"command_timeout: {missing}")

    def _make_plant(self) -> None:
        """Put the robot where the motion starts, once that is known.

        Where the plan is to come, or may not have been discovered yet, it is waited for.
        """
        start, settings = self._run.start, self._settings
        if start is None and not (settings.samples and settings.initial_joints):
            if self._progress.missing or GENERATOR in settings.wait_for_nodes or not self._run.agrees:
                return
            self._without_plan += self._alone and self.count_publishers(TORQUE_COMMAND.name) > 0
            if self._alone and self._without_plan < PATIENCE:
                return
        start = start or MotionStart(LAST_SAMPLE, START_JOINTS, announces=False)
        plant = self._file.plant
        plant = plant._replace(delay_samples=plant.delay_samples - self._known_ahead)
        joints = settings.initial_joints or start.joints
        self._made = Plant(self._robot, joints, self._rate_hz, plant, self._file.imu)
        self._made.carry(laden(self._robot, self._payload))
        self._samples = self._progress.samples = settings.samples or start.samples
        if self._lockstep and start.announces:
            self._released = self.advertise(READINGS_RELEASED)

    @property
    def _plant(self) -> Plant:
        assert self._made is not None, "the plant is made before the first sample"
        return self._made

    def _carry(self, payload: float) -> None:
        self._payload = payload
        if self._made is not None:
            self._made.carry(laden(self._robot, payload))

    def _measure(self, sample: int) -> Messages:
        """Return the messages of a sample."""
        stamp = self._run.stamp(sample)
        measured = self._plant.measure()
        angles, torques = measured.of_motors()
        if self._motors_only:
            joints = JointSample(stamp, ACTIVE_JOINTS, angles, effort=torques)
        else:
            joints = JointSample(stamp, JOINTS, measured.position, measured.velocity, measured.effort)
        if self._ground_truth is None:
            return joints, None
        truth = self._plant.truth()
        return joints, JointSample(stamp, JOINTS, truth.position, truth.velocity, truth.effort)

    def _publish_sample(self) -> None:
        if self._time is not None:
            self._time.publish(Clock(clock=to_stamp(self._run.stamp(self._sample))))
        self._held = self._run.stamp(self._sample) > self._cell_ns
        if not self._held:
            self._publish_measured()

    def _on_cell_clock(self, message: Clock) -> None:
        self._cell_ns = message.clock.sec * NANOSECONDS + message.clock.nanosec
        if self._held and self._run.stamp(self._sample) <= self._cell_ns:
            self._held = False
            self._heard = time.monotonic()
            self._publish_measured()

    def _publish_measured(self) -> None:
        joints, truth = self._measured
        if self._sights is not None:
            # the camera's answer to the exact state comes before the rest of the sample
            self._to_publish = self._sample
            if self._ground_truth is not None:
                self._ground_truth.publish(truth)
            self._sights.expect(self._sample)
            self._publish_when_seen()
            return
        self._publish_readings(joints)
        if self._ground_truth is not None:
            self._ground_truth.publish(truth)

    def _repeat(self) -> None:
        """Publish the present sample again, that for the camera too, which then repeats what it saw."""
        joints, truth = self._measured
        if self._sights is not None and self._ground_truth is not None:
            self._ground_truth.publish(truth)
        if self._to_publish < 0:
            self._publish_readings(joints)

    def _publish_when_seen(self) -> None:
        assert self._sights is not None
        if self._to_publish == self._sample and self._sights.complete:
            self._to_publish = -1
            self._publish_readings(self._measured[0])

    def _publish_readings(self, joints: JointSample) -> None:
        # the joint states first, because the controllers wait for them
        self._joint_states.publish(joints)
        self._published = time.monotonic()
        if self._arrived is None:
            position = self._plant.truth().position if self._late.scalars else ()
            self._arrived = self._late.arrived(self._sample, self._read_imu(), position)
        if self._released is not None:
            self._released.publish(self._announcement(self._arrived))
        self._late.publish(self._arrived)

    def _announcement(self, arrived: Arrived) -> JointSample:
        """Return which late readings come with the sample."""
        scalars = [message for _, message in arrived.scalars]
        names = [IMU_FRAME] * len(arrived.imu) + [message.name[0] for message in scalars]
        moments = [self._run.moment(stamp_of(message)) for message in (*arrived.imu, *scalars)]
        if self._sights is not None:
            seen = self._sights.taken(self._sample)
            names += [CAMERA_FRAME] * len(seen)
            moments += [self._run.moment(stamp_ns) for stamp_ns in seen]
        return JointSample(self._run.stamp(self._sample), names, moments)

    def _scalar_sensors(self) -> list[ScalarSensor]:
        file = self._file
        robot = actual_robot(self._robot, file.plant)
        return scalar_sensors(file.passive, file.extra(), robot, self._rate_hz, file.plant.seed)

    def _read_imu(self) -> Imu:
        reading = self._plant.measure_imu()
        return self._late.imu_message(self._sample, reading.angular_velocity, reading.acceleration)

    def _on_safety_state(self, message: String) -> None:
        """Follow the blender's fault: its brake may act for some time, and then nothing until the fault is cleared."""
        if message.data == ALL_WELL:
            self._torque_until = None
        elif self._torque_until is None:
            self._torque_until = self._sample + self._brake_samples

    def _on_release_status(self, message: String) -> None:
        """Let the torques of a release act, although a fault has stopped the robot."""
        self._is_released = message.data in (RELEASE_BEGINS, RELEASE_RESTS, RELEASE_PRESSES)

    @property
    def _torque(self) -> tuple[float, float]:
        """The torque (Nm) that acts on the motion from the present sample to the next."""
        over = self._torque_until is not None and self._sample > self._torque_until
        stopped = over and not self._is_released
        return ZERO if self._fault or stopped or self._watch.pending else self._latest[1]

    def _on_command(self, message: JointSample) -> None:
        if self.refuses(TORQUE_COMMAND):
            return
        sample = self._run.sample(message.stamp_ns)
        try:
            ((tau1, tau2),) = message.read(ACTIVE_JOINTS, ("effort",))
        except MessageError as error:
            self.drop(TORQUE_COMMAND, str(error))
            return
        if sample is None or sample > self._sample or sample < self._latest[0]:
            self.drop(TORQUE_COMMAND, unexpected_sample(sample, self._sample))
            return
        if not self._lockstep and self._answer.contradicts(message.stamp_ns, (tau1, tau2)):
            self.contradicted(TORQUE_COMMAND, f"sample {sample}")
            return
        if sample == self._sample > self._latest[0]:
            self._progress.latency.note(time.monotonic() - self._published)
        awaited = self._running and sample == self._sample and self._next is None
        if awaited or not self._lockstep:
            self._latest = (sample, (tau1, tau2))
        if awaited:
            self._heard = time.monotonic()
            self._move()
            if self._lockstep:
                self._advance()

    def _on_sight(self, message: JointSample) -> None:
        assert self._sights is not None
        self._sights.note(message.stamp_ns)
        self._publish_when_seen()

    def _tick(self) -> None:
        """Real time: advance to the next sample unconditionally; without a new command the last one stays in effect."""
        answered, _ = self._latest
        if answered < self._sample:
            self._progress.overruns += 1
        if self._sample - answered > self._freshness and not self._fault:
            self._latch(
                f"command_stale: sample {self._sample} still waits for the torque of sample {answered + 1},"
                f" limit {self._freshness} samples"
            )
        self._move()
        self._advance()
        if self._known_ahead:
            self._move()

    def _move(self) -> None:
        """Integrate to the next sample under the latest command, once."""
        if self._next is not None or self._sample == self._samples or self.exit_status is not None:
            return
        try:
            self._plant.advance(self._torque)
        except PlantDiverged as error:
            self._fail(f"plant_diverged: after sample {self._sample}: {error}")
            return
        self._next = self._measure(self._sample + 1)

    def _advance(self) -> None:
        if self.exit_status is not None:
            return
        self.note_answer()
        if self._next is None:
            self._end()
            return
        self._sample += 1
        self._measured, self._next = self._next, None
        self._arrived = None
        self._unanswered = 0
        self._publish_sample()

    def _end(self) -> None:
        self._publish_status("failed" if self._fault else "completed")
        self.exit_status = 0

    def _latch(self, fault: str) -> None:
        self._set_fault(fault)
        self.get_logger().error(fault)

    def _set_fault(self, fault: str) -> None:
        self._fault = fault
        self._faults.publish(String(data=fault))
        self._state.publish(String(data=fault))

    def _fail(self, fault: str) -> None:
        self._latch(fault)
        self._publish_status("failed")
        self.exit_status = 1

    def _publish_status(self, state: str) -> None:
        if self.exit_status is None:
            self._progress.publish(state, self._sample)

    def _on_reset(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success = not self.second_publisher
        if self.second_publisher:
            response.message = f"not cleared, {self.second_publisher}"
            return response
        response.message = f"cleared {self._fault}" if self._fault else "no fault was latched"
        self._fault = ""
        self._state.publish(String(data=ALL_WELL))
        return response


def main() -> None:
    """Run the node."""
    run_node(PlantNode)


if __name__ == "__main__":
    main()
