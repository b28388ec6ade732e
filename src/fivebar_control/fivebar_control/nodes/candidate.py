"""The node that both torque laws share: joins state and reference of a sample and publishes the law's torque."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import Any

from sensor_msgs.msg import JointState

from fivebar_control.controllers.laws import Gains, Law
from fivebar_control.controllers.reference import reference_from_platform
from fivebar_control.model.kinematics import state_from_joints
from fivebar_control.model.state import Platform
from fivebar_control.nodes.motion_parameters import declare_motion
from fivebar_description.interface import (
    ACTIVE_JOINTS,
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


def gain_specs(kp_default: float, kd_default: float) -> tuple[Spec, ...]:
    """Return the parameters of a law's gains, which may be tuned while the node runs."""
    return (
        Spec("kp", kp_default, "Proportional gain.", "1/s^2", 0.0, 1e6, tunable=True),
        Spec("kd", kd_default, "Derivative gain.", "1/s", 0.0, 1e5, tunable=True),
    )


class CandidateNode(SamplingNode):
    """A node that answers every sample with a candidate torque, NaN where its law is undefined."""

    def __init__(self, name: str, topic: Topic, specs: Sequence[Spec]) -> None:
        """Make the node; `specs` are the parameters of its law."""
        super().__init__(name)
        self._motion = declare_motion(self)
        self._settings = self.parameters(specs)
        self._law = self.make_law(self._settings)
        self.on_tuned(self._tune)
        self._reply: JointState | None = None
        self._torque = self.advertise(topic)
        self.join(
            self._motion.rate_hz,
            (
                Input(JOINT_STATES, fields_of(JOINTS, "position", "velocity")),
                Input(REFERENCE, fields_of(REFERENCE_NAMES, "position", "velocity")),
            ),
        )

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
        (position, velocity), ((x, y, vx, vy), (_, _, ax, ay)) = values
        robot, plan = self._motion.robot, self._motion.plan
        state = state_from_joints(robot, *position, *velocity)
        reference = reference_from_platform(robot, plan.mode1, plan.mode2, Platform(x, y, vx, vy, ax, ay))
        torque = self._law(sample + self._motion.lead_samples, state, reference)
        self._reply = joint_state(sample_stamp_ns(sample, self.rate_hz), ACTIVE_JOINTS, effort=torque)
        self._torque.publish(self._reply)

    def repeat(self) -> None:
        """Publish the same torque again."""
        if self._reply is not None:
            self._torque.publish(self._reply)


def gains_of(settings: dict[str, Any]) -> Gains:
    """Return the gains among a law's parameters."""
    return Gains(settings["kp"], settings["kd"])
