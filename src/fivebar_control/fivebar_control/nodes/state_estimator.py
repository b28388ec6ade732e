# SPDX-License-Identifier: Apache-2.0
"""Estimates all four joints from the two motors: answers `motor_states` with `joint_states` of the same stamp.

With a camera, `~/reset` begins again where the robot rests, whatever has been lost.

Readings of a gyroscope (`imu/data`) and of an encoder on a passive joint (`passive_states`) are put in at the time of
their stamps, however late they come.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from sensor_msgs.msg import Imu
from std_msgs.msg import String
from std_srvs.srv import Trigger

from fivebar_control.estimation.constants import CAMERA_LATENCY, history_samples
from fivebar_control.estimation.encoder import count_angle
from fivebar_control.estimation.homing import HomingContradicted
from fivebar_control.estimation.late_reading import CAMERA, EXTRA, GYROSCOPE, PASSIVE, LateReading
from fivebar_control.estimation.platform_reading import PlatformReading, used
from fivebar_control.estimation.resting import MotorReading, Resting
from fivebar_control.loop.part_choice import estimator_part
from fivebar_control.ros.machine_code import loading
from fivebar_control.ros.node_settings import ChainSettings, runs_compiled
from fivebar_control.ros.run_file import start_values
from fivebar_control.scenario.keys import ROBOT, SENSORS
from fivebar_control.scenario.scenario import ControlScenario
from fivebar_control.scenario.sensors import homing_of, sensing_of
from fivebar_description.interface import (
    ACTIVE_JOINTS,
    ALL_WELL,
    CAMERA_FRAME,
    ESTIMATE_COVARIANCE,
    ESTIMATE_DISTURBANCE,
    ESTIMATE_NAMES,
    ESTIMATE_STATE,
    EXTRA_NAME,
    EXTRA_READINGS,
    IMU_DATA,
    IMU_FRAME,
    JOINT_STATES,
    JOINTS,
    MOTOR_STATES,
    PASSIVE_STATES,
    READINGS_RELEASED,
    TORQUE_COMMAND,
    VISION_NAMES,
    VISION_PLATFORM,
    Topic,
)
from fivebar_description.joint_sample import LARGEST, JointSample, MessageError, fields_of, part_of
from fivebar_description.parameters import laden
from fivebar_description.publishers import same
from fivebar_description.ros.file_parameters import FileParameters
from fivebar_description.ros.messages import stamp_of
from fivebar_description.ros.run import run_node
from fivebar_description.ros.run_agreement import RunAgreement
from fivebar_description.ros.sampling_node import Input, SamplingNode
from fivebar_description.run_plan import HOMING, LEAD_SAMPLES
from fivebar_description.sensors import LARGEST_OFFSET
from fivebar_description.shared_settings import LOCKSTEP

FAILED = 1

COMMANDED = fields_of(ACTIVE_JOINTS, "effort")
"""Reads a torque command (Nm)."""

SENSOR_OF = {IMU_FRAME: GYROSCOPE, CAMERA_FRAME: CAMERA, EXTRA_NAME: EXTRA}
"""Sensors by the names that samples announce; the others are passive joints."""

Reading = tuple[str, float]
"""The sensor of a reading, and the moment of its stamp in samples."""


def read_released(message: JointSample) -> tuple[Reading, ...]:
    """Return the readings that come with a sample.

    Raises:
        MessageError: a moment is not finite, or has no sensor.
    """
    moments = message.position
    if len(message.name) != len(moments) or not all(map(math.isfinite, moments)):
        raise MessageError(f"names {list(message.name)}, position {list(moments)}, expected a moment for each name")
    return tuple(zip(message.name, moments, strict=True))


def turns_text(turns: tuple[int, int]) -> str:
    """Return which motor's first reading was offset by how many whole turns, for a warning."""
    both = zip(ACTIVE_JOINTS, turns, strict=True)
    offset = " and ".join(
        f"{name} by {count:+d} whole turn{'s' if abs(count) > 1 else ''}" for name, count in both if count
    )
    return (
        f"{MOTOR_STATES.name}: offset from where the robot stands is {offset}: taken off, as is every wrap from here on"
    )


class StateEstimatorNode(SamplingNode):
    """Extended Kalman filter on the motor encoders and, where there are, gyroscope and encoder on a passive joint.

    With a drive delay of d samples, the answer to sample k needs the commands of samples k-d to k-1, the last of which
    may arrive after the sample itself; the answer then waits for it. In real time a command may be lost; the next
    sample ends the wait, and the previous command is used instead, as the drives do.

    In lockstep each sample announces which of the late readings come with it, and the answer waits for these too; in
    real time it takes those that have come.
    """

    in_chain = True

    def __init__(self) -> None:
        """Make the node."""
        super().__init__("state_estimator")
        settings = self.declare_settings(ChainSettings)
        lockstep = settings.mode == LOCKSTEP
        scenario = FileParameters(self, ControlScenario, (*ROBOT, "estimator", "waypoints", *SENSORS)).file
        self._homing, self._sensing = homing_of(scenario), sensing_of(scenario)
        rate_hz, drives, ekf, _, passive, known, extra, *_ = self._sensing
        agreed = {
            **start_values(scenario),
            HOMING: [self._homing.x, self._homing.y],
            LEAD_SAMPLES: drives.delay_samples,
        }
        RunAgreement(self, rate_hz, agreed)
        self._imu = scenario.imu
        self._empty = scenario.five_bar()
        compiled = runs_compiled(settings.mode, rate_hz, settings.compiled)
        self._kind, self._robot = estimator_part(compiled), self._empty
        self._clock_offset = known.imu_clock * rate_hz
        self._joint = passive.joint if passive.leg else ""
        self._estimator = self._kind(self._robot, self._homing, self._sensing)
        with loading(compiled, self.get_logger().info):
            self._estimator.warm_up()
        self._waiting: tuple[int, tuple[float, float, float, float], tuple[Reading, ...] | None] | None = None
        self._late: dict[Reading, tuple[float, ...]] = {}
        self._sees, self._sees_start = ekf.camera or ekf.seen_start, ekf.seen_start
        # one that is too old for the history is taken all the same, so that the estimator can tell it from none
        self._longest_delay = max(history_samples(rate_hz), math.ceil(LARGEST_OFFSET * rate_hz))
        if self._sees:
            self._longest_delay = max(self._longest_delay, history_samples(rate_hz, CAMERA_LATENCY))
        self._reply: tuple[JointSample, JointSample, JointSample] | None = None
        self._joint_states = self.advertise(JOINT_STATES)
        self._covariance = self.advertise(ESTIMATE_COVARIANCE)
        self._disturbance = self.advertise(ESTIMATE_DISTURBANCE)
        if drives.delay_samples > 0:
            self.listen(TORQUE_COMMAND, self._on_command)
        announced = lockstep and bool(ekf.gyro or passive.leg or self._sees or extra)
        inputs = [Input(MOTOR_STATES, fields_of(ACTIVE_JOINTS, "position", "effort"))]
        self._sensors: set[str] = set()
        if ekf.gyro:
            self._sensors.add(IMU_FRAME)
            self.listen(IMU_DATA, self._on_imu, only_reliable=announced)
        if passive.leg:
            self._sensors.add(self._joint)
            self.listen(PASSIVE_STATES, partial(self._on_scalar, PASSIVE_STATES, self._joint), only_reliable=announced)
        if extra is not None:
            self._sensors.add(EXTRA_NAME)
            self.listen(EXTRA_READINGS, partial(self._on_scalar, EXTRA_READINGS, EXTRA_NAME), only_reliable=announced)
        self._mode, self._count = scenario.working_mode, count_angle(drives.encoder_counts or 0)
        self._resting = self._no_rest()
        self._state = self.advertise(ESTIMATE_STATE) if self._sees else None
        self._publish_state(ALL_WELL)
        if self._sees:
            self.create_service(Trigger, "~/reset", self._on_reset)
            self._sensors.add(CAMERA_FRAME)
            self.listen(VISION_PLATFORM, self._on_seen, only_reliable=announced)
        if announced:
            inputs.append(Input(READINGS_RELEASED, read_released))
        self.join(rate_hz, inputs)
        self.listen_to_payload(self._carry)

    def _carry(self, payload: float) -> None:
        self._robot = laden(self._empty, payload)
        self._estimator.carry(self._robot)

    def health(self) -> tuple[bytes, str]:
        """Return an error while a fault is latched."""
        if self._estimator.fault is not None:
            return DiagnosticStatus.ERROR, str(self._estimator.fault)
        return super().health()

    def metrics(self) -> Mapping[str, object]:
        """Return the whole turns that are taken off the readings of each motor."""
        turns = zip(ACTIVE_JOINTS, self._estimator.turns, strict=True)
        return {f"whole_turns_{name}": count for name, count in turns}

    def restart(self) -> None:
        """Start again from the homing posture; a latched fault is cleared."""
        self._estimator = self._kind(self._robot, self._homing, self._sensing)
        self._resting = self._no_rest()
        self._publish_state(ALL_WELL)
        self._waiting = None
        self._late.clear()
        self._reply = None

    def forget(self) -> None:
        """Forget the inputs of samples that are not complete, and the readings that no sample has taken."""
        super().forget()
        self._late.clear()

    def admit(self, sample: int, driving: bool, values: Any) -> bool:
        """Answer nothing where the node has come after the beginning of the run: no sample is complete without it."""
        if not driving:
            return True
        known = self._estimator.fault
        if not self._estimator.joined_late(sample):
            if known is not None and self.last_sample < 0:
                # the beginning that was missed has come again
                self.restart()
            return True
        if known is None:
            self._announce(str(self._estimator.fault))
        self._rest_by(sample, values[0])
        return False

    def answer(self, sample: int, *values: Any) -> None:
        """Publish the joint states, now or once all that the estimate needs has arrived."""
        (q11, q21), (tau1, tau2) = values[0]
        self._end_wait()
        # the IMU's readings come with every run, also where the estimator does not use them
        released = tuple(value for value in values[1] if value[0] in self._sensors) if len(values) > 1 else None
        self._waiting = (sample, (q11, q21, tau1, tau2), released)
        self._end_wait_if_complete()

    def _end_wait_if_complete(self) -> None:
        if self._waiting is None:
            return
        sample, _, released = self._waiting
        if sample == 0 and self._sees_start and not any(sensor == CAMERA_FRAME for sensor, _ in self._late):
            return
        if not self._estimator.awaits(sample) and all(reading in self._late for reading in released or ()):
            self._end_wait()

    def _on_imu(self, message: Imu) -> None:
        if not self._run.holds or self.refuses(IMU_DATA):
            return
        vector = message.angular_velocity
        turning = (vector.x, vector.y, vector.z)
        if not all(-LARGEST <= rate <= LARGEST for rate in turning):
            self.drop(IMU_DATA, f"angular velocity is {turning}, expected finite numbers of at most {LARGEST:g}")
            return
        self._keep(IMU_DATA, IMU_FRAME, message, (self._imu.usable_rate(turning),))

    def _on_scalar(self, topic: Topic, name: str, message: JointSample) -> None:
        if not self._run.holds or self.refuses(topic):
            return
        try:
            ((value,),) = (part_of(message, (name,)) or message).read((name,), ("position",))
        except MessageError as error:
            self.drop(topic, str(error))
            return
        self._keep(topic, name, message, (value,))

    def _on_seen(self, message: JointSample) -> None:
        if not self._run.holds or self.refuses(VISION_PLATFORM):
            return
        try:
            (values,) = message.read(VISION_NAMES, ("position",), allow_nan=True)
        except MessageError as error:
            self.drop(VISION_PLATFORM, str(error))
            return
        reading = used(PlatformReading(*values))
        self._resting.see(LateReading(CAMERA, self._run.moment(stamp_of(message)), *reading))
        self._keep(VISION_PLATFORM, CAMERA_FRAME, message, reading)

    def _keep(self, topic: Topic, sensor: str, message: Imu | JointSample, value: tuple[float, ...]) -> None:
        """Keep a late sensor's reading until a sample takes it."""
        moment = self._run.moment(stamp_of(message))
        ahead = self._made((sensor, moment)) - self.last_sample
        if not -self._longest_delay <= ahead <= LARGEST_OFFSET * self.rate_hz:
            # of another run, or far ahead after a pause
            self.drop(topic, f"stamp of sample {moment:g}, expected one close to sample {self.last_sample}")
            return
        if not same(self._late.setdefault((sensor, moment), value), value):
            self.contradicted(topic, f"the time of sample {moment:g}")
            return
        self._end_wait_if_complete()

    def _made(self, reading: Reading) -> float:
        """Return the moment at which a reading was made (samples), as far as its clock is known."""
        sensor, moment = reading
        return moment - self._clock_offset if sensor == IMU_FRAME else moment

    def repeat(self) -> None:
        """Publish the last joint states again: this sample's, or those before it, whose command may have been lost."""
        if self._reply is not None:
            self._publish(*self._reply)

    def _on_command(self, message: JointSample) -> None:
        if not self._run.holds or self.refuses(TORQUE_COMMAND):
            return
        sample = self._run.sample(stamp_of(message))
        try:
            ((tau1, tau2),) = COMMANDED(message)
        except MessageError as error:
            self.drop(TORQUE_COMMAND, str(error))
            return
        if sample is None or sample > self.last_sample:
            self.drop(
                TORQUE_COMMAND, f"stamp {stamp_of(message)} ns, expected one of a sample up to {self.last_sample}"
            )
            return
        self._estimator.commanded(sample, tau1, tau2)
        self._end_wait_if_complete()

    def _end_wait(self) -> None:
        if self._waiting is None:
            return
        (sample, motors, released), self._waiting = self._waiting, None
        # in real time what has come and was made by now
        taken = (
            sorted(reading for reading in self._late if self._made(reading) <= sample) if released is None else released
        )
        readings = [
            LateReading(SENSOR_OF.get(sensor, PASSIVE), moment, *self._late.pop((sensor, moment)))
            for sensor, moment in taken
            if (sensor, moment) in self._late
        ]
        # readings that no sample announces, as repeated ones, must not accumulate
        oldest = sample - self._longest_delay
        self._late = {reading: value for reading, value in self._late.items() if self._made(reading) >= oldest}
        self._rest_by(sample, motors)
        known = self._estimator.fault
        try:
            estimate = self._estimator.take(sample, *motors, readings)
        except HomingContradicted as error:
            self._announce(str(error))
            self.exit_status = FAILED
            return
        if self._reply is None and any(self._estimator.turns):
            self.get_logger().warning(turns_text(self._estimator.turns))
        if self._estimator.fault is not None and known is None:
            self._announce(str(self._estimator.fault))
            # deliver the fault to the blender before this sample, so that every run stops at the same sample
            self.deliver()
        stamp = self._run.stamp(sample)
        self._reply = (
            JointSample(stamp, JOINTS, estimate.position, estimate.velocity, estimate.effort),
            JointSample(stamp, ESTIMATE_NAMES, estimate.deviations),
            JointSample(stamp, ACTIVE_JOINTS, effort=estimate.disturbance),
        )
        self._publish(*self._reply)

    def _publish(self, joints: JointSample, deviations: JointSample, disturbance: JointSample) -> None:
        self._covariance.publish(deviations)
        self._disturbance.publish(disturbance)
        self._joint_states.publish(joints)

    def _announce(self, fault: str) -> None:
        self._faults.publish(String(data=fault))
        self._publish_state(fault)
        self.get_logger().error(fault)

    def _publish_state(self, state: str) -> None:
        if self._state is not None:
            self._state.publish(String(data=state))

    def _rest_by(self, sample: int, motors: Sequence[float]) -> None:
        """Take the motors' angles of a sample, by which a camera may find a resting robot again."""
        if self._sees:
            q11, q21, *_ = motors
            self._resting.read(MotorReading(sample, q11, q21))

    def _no_rest(self) -> Resting:
        return Resting(self._robot, self._mode, self._sensing.rate_hz, self._count)

    def _on_reset(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Begin again where the robot rests, with the next sample."""
        try:
            posture = self._resting.posture()
            self._estimator.begin_at(posture)
        except HomingContradicted as error:
            response.success, response.message = False, f"not begun again: {error}"
        else:
            response.success = True
            response.message = (
                f"begins again at ({posture.x:.4f}, {posture.y:.4f}) m in assembly mode {posture.assembly:+d}"
            )
            self._publish_state(ALL_WELL)
        self.get_logger().info(response.message)
        return response


def main() -> None:
    """Run the node."""
    run_node(StateEstimatorNode)


if __name__ == "__main__":
    main()
