"""The node that both torque laws share: joins state and reference of a sample and publishes the law's torque."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import Any

from sensor_msgs.msg import JointState

from fivebar_control.laws.laws import Gains, Law
from fivebar_control.laws.reference import against_disturbance
from fivebar_control.model.kinematics import state_from_joints
from fivebar_control.model.state import Platform
from fivebar_control.ros.motion_parameters import declare_motion
from fivebar_control.trajectory.desired import desired_at
from fivebar_description.interface import (
    ACTIVE_JOINTS,
    ESTIMATE_DISTURBANCE,
    JOINT_STATES,
    JOINTS,
    REFERENCE,
    REFERENCE_NAMES,
    Topic,
    sample_stamp_ns,
)
from fivebar_description.ros.messages import joint_state
from fivebar_description.ros.parameters import Spec
from fivebar_description.ros.sampling_node import Input, SamplingNode, fields_of
from fivebar_description.strict_yaml import InputError


def gain_specs(kp_default: float, kd_default: float) -> tuple[Spec, ...]:
    """Return the parameters of a law's gains, which may be tuned while the node runs."""
    return (
        Spec("kp", kp_default, "Proportional gain.", "1/s^2", 0.0, 1e6, tunable=True),
        Spec("kd", kd_default, "Derivative gain.", "1/s", 0.0, 1e5, tunable=True),
    )


NOT_KNOWN, ESTIMATED = "none", "estimated"

DISTURBANCE = Spec(
    "disturbance",
    NOT_KNOWN,
    "Whether to make up for the disturbance torques on estimate/disturbance, which every sample then needs.",
    choices=(NOT_KNOWN, ESTIMATED),
)


class CandidateNode(SamplingNode):
    """A node that answers every sample with a candidate torque, NaN where its law is undefined."""

    meets_type_1 = False
    """Whether the law is defined where a leg is stretched."""

    def __init__(self, name: str, topic: Topic, specs: Sequence[Spec]) -> None:
        """Make the node; `specs` are the parameters of its law.

        Raises:
            InputError: the motion may meet Type 1, where the law is undefined.
        """
        super().__init__(name)
        self._motion = declare_motion(self)
        if self._motion.plan.modes and not self.meets_type_1:
            raise InputError(f"{name}: working_mode: expected two signs, since this law is undefined at Type 1")
        self._settings = self.parameters(specs)
        disturbance = self.parameters((DISTURBANCE,))["disturbance"]
        self._law = self.make_law(self._settings)
        self.on_tuned(self._tune)
        self._reply: JointState | None = None
        self._torque = self.advertise(topic)
        inputs = [
            Input(JOINT_STATES, fields_of(JOINTS, "position", "velocity")),
            Input(REFERENCE, fields_of(REFERENCE_NAMES, "position", "velocity")),
        ]
        if disturbance == ESTIMATED:
            inputs.append(Input(ESTIMATE_DISTURBANCE, fields_of(ACTIVE_JOINTS, "effort")))
        self.join(self._motion.rate_hz, inputs)

    @abstractmethod
    def make_law(self, settings: dict[str, Any]) -> Law:
        """Return the law for the values of its parameters."""

    def _tune(self, changes: dict[str, Any]) -> None:
        self._settings.update(changes)
        self._law = self.make_law(self._settings)

    def restart(self) -> None:
        """Begin with a law that has no memory of the last run."""
        self._law = self.make_law(self._settings)

    def answer(self, sample: int, *values: Any) -> None:
        """Publish the law's torque."""
        (position, velocity), ((x, y, vx, vy), (_, _, ax, ay)), *rest = values
        robot, plan = self._motion.robot, self._motion.plan
        state = state_from_joints(robot, *position, *velocity)
        moment = sample + self._motion.lead_samples
        reference = desired_at(robot, plan, moment / self.rate_hz, Platform(x, y, vx, vy, ax, ay))
        if rest:
            ((disturbance,),) = rest
            reference = against_disturbance(reference, *disturbance)
        torque = self._law(moment, state, reference)
        self._reply = joint_state(sample_stamp_ns(sample, self.rate_hz), ACTIVE_JOINTS, effort=torque)
        self._torque.publish(self._reply)

    def repeat(self) -> None:
        """Publish the same torque again."""
        if self._reply is not None:
            self._torque.publish(self._reply)


def gains_of(settings: dict[str, Any]) -> Gains:
    """Return the gains among a law's parameters."""
    return Gains(settings["kp"], settings["kd"])
