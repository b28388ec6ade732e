"""Base class of the controller nodes: joins state and reference of a sample and publishes the law's torque."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from fivebar_control.laws.law import Law, TunedLaw
from fivebar_control.laws.reference import against_disturbance
from fivebar_control.laws.registry import find_law
from fivebar_control.laws.robot_sizes import sizes_of_law
from fivebar_control.loop.law_runner import LawRunner
from fivebar_control.loop.shared_results import one_robot, shared_desired, shared_state
from fivebar_control.model.state import Platform
from fivebar_control.ros.motion_parameters import declare_motion
from fivebar_description.interface import (
    ACTIVE_JOINTS,
    ESTIMATE_DISTURBANCE,
    JOINT_STATES,
    JOINTS,
    REFERENCE,
    REFERENCE_AHEAD,
    REFERENCE_NAMES,
    ahead_names,
)
from fivebar_description.joint_sample import JointSample, joint_sample
from fivebar_description.parameters import laden
from fivebar_description.robot_file import read_robot
from fivebar_description.ros.parameters import Spec, specs_of
from fivebar_description.ros.payload import listen_to_payload
from fivebar_description.ros.sampling_node import Input, SamplingNode, fields_of
from fivebar_description.settings import from_parameters
from fivebar_description.strict_yaml import InputError

NO_DISTURBANCE, ESTIMATED = "none", "estimated"

DISTURBANCE = Spec(
    "disturbance",
    NO_DISTURBANCE,
    "Whether to compensate the disturbance torques from estimate/disturbance, then required for every sample.",
    choices=(NO_DISTURBANCE, ESTIMATED),
)


def _platforms(position: Sequence[float], velocity: Sequence[float]) -> tuple[Platform, ...]:
    """Return the references in a message of `reference/ahead`."""
    fields = len(REFERENCE_NAMES)
    return tuple(
        Platform(*position[first : first + fields], *velocity[first + 2 : first + fields])
        for first in range(0, len(position), fields)
    )


class ControllerNode(SamplingNode):
    """Answers every sample with a candidate torque, NaN where its law is undefined."""

    in_chain = True

    def __init__(self, name: str, law: str, choices: tuple[str, ...] = ()) -> None:
        """Make the node of a law.

        Args:
            name: name of the node.
            law: name of its law, or with `choices` the default of its parameter `law`.
            choices: values that the parameter `law` accepts; empty for a node without it, ("",) for any law.

        Raises:
            InputError: there is no such law, or the motion may meet a Type 1 singularity, where it is undefined.
        """
        super().__init__(name)
        self._motion = declare_motion(self)
        self._robot = self._motion.robot
        if choices:
            accepted = () if choices == ("",) else choices
            spec = Spec("law", law, "Name of the law; MODULE:NAME for one from another package.", choices=accepted)
            law = self.parameters((spec,))["law"]
        self._law_entry = find_law(law)
        if self._motion.plan.modes and not self._law_entry.meets_type_1:
            raise InputError(f"{name}: working_mode: expected two signs, since this law is undefined at Type 1")
        sizes = sizes_of_law(self._law_entry.name, read_robot(self.get_parameter("robot").value))
        self._settings = self.parameters(specs_of(self._law_entry.settings, **sizes))
        disturbance = self.parameters((DISTURBANCE,))["disturbance"]
        self._law = self._make_law()
        self._law_entry.warm_up()
        self.on_tuned(self._tune)
        self._reply: JointSample | None = None
        self._torque = self.advertise(self._law_entry.topic)
        inputs = [
            Input(JOINT_STATES, fields_of(JOINTS, "position", "velocity")),
            Input(REFERENCE, fields_of(REFERENCE_NAMES, "position", "velocity")),
        ]
        self._samples_ahead = self._tuned().samples_ahead
        if self._samples_ahead:
            inputs.append(Input(REFERENCE_AHEAD, fields_of(ahead_names(self._samples_ahead), "position", "velocity")))
        if disturbance == ESTIMATED:
            inputs.append(Input(ESTIMATE_DISTURBANCE, fields_of(ACTIVE_JOINTS, "effort")))
        self.join(self._motion.rate_hz, inputs)
        listen_to_payload(self, self._carry)

    def _tuned(self) -> TunedLaw:
        law: Law = self._law_entry
        return TunedLaw(law, from_parameters(law.settings, self._settings))

    def _make_law(self) -> LawRunner:
        return LawRunner(self._tuned(), self._robot, self._motion.plan, self._motion.rate_hz)

    def _tune(self, changes: dict[str, Any]) -> None:
        self._settings.update(changes)
        self._law = self._make_law()

    def _carry(self, payload: float) -> None:
        self._robot = one_robot(laden(self._motion.robot, payload))
        self._law.carry(self._robot)

    def restart(self) -> None:
        """Reset the law's memory for a new run."""
        self._law = self._make_law()

    def answer(self, sample: int, *values: Any) -> None:
        """Publish the law's torque."""
        (position, velocity), planned, *rest = values
        robot, plan = self._robot, self._motion.plan
        state = shared_state(sample, robot, position, velocity)
        target = sample + self._motion.lead_samples
        reference = shared_desired(target / self.rate_hz, robot, plan, *planned)
        ahead = _platforms(*rest.pop(0)) if self._samples_ahead else None
        if rest:
            ((disturbance,),) = rest
            reference = against_disturbance(reference, *disturbance)
        torque = self._law(target, state, reference, ahead)
        self._reply = joint_sample(self._run.stamp(sample), ACTIVE_JOINTS, effort=torque)
        self._torque.publish(self._reply)

    def repeat(self) -> None:
        """Publish the same torque again."""
        if self._reply is not None:
            self._torque.publish(self._reply)
