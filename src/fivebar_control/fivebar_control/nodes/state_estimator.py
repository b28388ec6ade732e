"""Estimates all four joints from the two motors: answers `motor_states` with `joint_states` of the same stamp."""

from __future__ import annotations

from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from fivebar_control.estimation.ekf import EkfSettings
from fivebar_control.estimation.estimator import Drives, StateEstimator
from fivebar_control.estimation.homing import Homing, HomingContradicted
from fivebar_control.ros.node_settings import NOT_OF_THE_FILTER, EstimatorSettings
from fivebar_description.interface import (
    ACTIVE_JOINTS,
    ESTIMATE_COVARIANCE,
    ESTIMATE_DISTURBANCE,
    ESTIMATE_NAMES,
    FAULTS,
    JOINT_STATES,
    JOINTS,
    MOTOR_STATES,
    TORQUE_COMMAND,
    sample_of_stamp,
    sample_stamp_ns,
)
from fivebar_description.parameters import load_robot
from fivebar_description.ros.messages import MessageError, joint_state, read_fields, stamp_of
from fivebar_description.ros.run import run_node
from fivebar_description.ros.sampling_node import Input, SamplingNode, fields_of
from fivebar_description.shared_settings import DRIVE_TORQUE_LIMIT

FAILED = 1


class StateEstimatorNode(SamplingNode):
    """Extended Kalman filter on the motor encoders.

    With a drive delay of d samples, the answer to sample k needs the commands of samples k-d to k-1, the last of which
    may arrive after the sample itself; the answer then waits for it. In real time a command may be lost; the next
    sample ends the wait, and the previous command is used instead, as the drives do.
    """

    def __init__(self) -> None:
        """Make the node."""
        super().__init__("state_estimator")
        settings = self.declare_settings(EstimatorSettings)
        drives = self.declare_settings(Drives, torque_limit=DRIVE_TORQUE_LIMIT)
        mode1, mode2 = settings.working_mode
        self._arguments = (
            load_robot(settings.robot),
            Homing(*settings.homing, mode1, mode2, settings.assembly_mode),
            settings.rate_hz,
            drives,
            self.declare_settings(EkfSettings, without=NOT_OF_THE_FILTER),
        )
        self._estimator = StateEstimator(*self._arguments)
        self._waiting: tuple[int, tuple[float, ...]] | None = None
        self._replied = -1
        self._reply: tuple[JointState, JointState, JointState] | None = None
        self._joint_states = self.advertise(JOINT_STATES)
        self._covariance = self.advertise(ESTIMATE_COVARIANCE)
        self._disturbance = self.advertise(ESTIMATE_DISTURBANCE)
        self._faults = self.advertise(FAULTS)
        if drives.delay_samples > 0:
            self.listen(TORQUE_COMMAND, self._on_command)
        self.join(settings.rate_hz, (Input(MOTOR_STATES, fields_of(ACTIVE_JOINTS, "position", "effort")),))

    def health(self) -> tuple[bytes, str]:
        """Return an error while a fault is latched."""
        if self._estimator.fault is not None:
            return DiagnosticStatus.ERROR, str(self._estimator.fault)
        return super().health()

    def restart(self) -> None:
        """Start again from the homing posture; a latched fault is cleared."""
        self._estimator = StateEstimator(*self._arguments)
        self._waiting = None
        self._replied = -1

    def answer(self, sample: int, *values: Any) -> None:
        """Publish the joint states, now or once the command of the previous sample has arrived."""
        ((position, effort),) = values
        self._end_wait()
        self._waiting = (sample, (*position, *effort))
        if not self._estimator.awaits(sample):
            self._end_wait()

    def repeat(self) -> None:
        """Publish the same joint states again."""
        if self._reply is not None and self._replied == self.last_sample:
            self._publish(*self._reply)

    def _on_command(self, message: JointState) -> None:
        sample = sample_of_stamp(stamp_of(message), self.rate_hz)
        try:
            ((tau1, tau2),) = read_fields(message, ACTIVE_JOINTS, ("effort",))
        except MessageError as error:
            self.drop(TORQUE_COMMAND, str(error))
            return
        if sample is None or sample > self.last_sample:
            self.drop(
                TORQUE_COMMAND, f"stamp {stamp_of(message)} ns, expected one of a sample up to {self.last_sample}"
            )
            return
        self._estimator.commanded(sample, tau1, tau2)
        if self._waiting is not None and not self._estimator.awaits(self._waiting[0]):
            self._end_wait()

    def _end_wait(self) -> None:
        if self._waiting is None:
            return
        (sample, readings), self._waiting = self._waiting, None
        known = self._estimator.fault
        try:
            estimate = self._estimator.take(sample, *readings)
        except HomingContradicted as error:
            self._announce(str(error))
            self.exit_status = FAILED
            return
        if self._estimator.fault is not None and known is None:
            self._announce(str(self._estimator.fault))
            # deliver the fault to the blender before this sample, so that every run stops at the same sample
            self.deliver()
        stamp = sample_stamp_ns(sample, self.rate_hz)
        self._replied = sample
        self._reply = (
            joint_state(stamp, JOINTS, estimate.position, estimate.velocity, estimate.effort),
            joint_state(stamp, ESTIMATE_NAMES, estimate.deviations),
            joint_state(stamp, ACTIVE_JOINTS, effort=estimate.disturbance),
        )
        self._publish(*self._reply)

    def _publish(self, joints: JointState, deviations: JointState, disturbance: JointState) -> None:
        self._covariance.publish(deviations)
        self._disturbance.publish(disturbance)
        self._joint_states.publish(joints)

    def _announce(self, fault: str) -> None:
        self._faults.publish(String(data=fault))
        self.get_logger().error(fault)


def main() -> None:
    """Run the node."""
    run_node(StateEstimatorNode)


if __name__ == "__main__":
    main()
