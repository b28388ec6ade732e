# SPDX-License-Identifier: Apache-2.0
"""Base class of the controller nodes: joins state and reference of a sample and publishes the law's torque."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fivebar_control.laws.law import TunedLaw
from fivebar_control.loop.node_parts import NO_DISTURBANCE, LawPart
from fivebar_control.loop.part_choice import law_part
from fivebar_control.loop.plain_law import PlainLaw
from fivebar_control.loop.shared_results import one_robot
from fivebar_control.model.state import Platform
from fivebar_control.ros.machine_code import loading
from fivebar_control.ros.node_settings import ChainSettings, runs_compiled
from fivebar_control.ros.run_file import declared_motion
from fivebar_control.scenario.keys import LAWS, MOTION
from fivebar_control.scenario.law_settings import section_law, tuned_controller
from fivebar_control.scenario.scenario import ControlScenario
from fivebar_description.interface import (
    ACTIVE_JOINTS,
    ESTIMATE_DISTURBANCE,
    JOINT_STATES,
    JOINTS,
    MOTION_FIELDS,
    REFERENCE,
    REFERENCE_AHEAD,
    REFERENCE_MOTION,
    REFERENCE_NAMES,
    ahead_names,
)
from fivebar_description.joint_sample import LARGEST, JointSample, MessageError, fields_of
from fivebar_description.parameters import laden
from fivebar_description.ros.file_parameters import FileParameters
from fivebar_description.ros.sampling_node import Input, SamplingNode
from fivebar_description.scenario_file import DEFAULT_SCENARIO
from fivebar_description.strict_yaml import InputError

FloatArray = NDArray[np.float64]

PLANNED = fields_of(REFERENCE_NAMES, "position", "velocity")
"""Reads a reference."""


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

    def __init__(self, name: str, default: str = DEFAULT_SCENARIO) -> None:
        """Make the node of that name, of the law of the run's controller that such a node publishes.

        `default` is the scenario where it is told of none.

        Raises:
            InputError: the run's file cannot be used, or its controller has no such law.
        """
        super().__init__(name)
        settings = self.declare_settings(ChainSettings)
        self._file = FileParameters(self, ControlScenario, (*MOTION, *LAWS), section_law, True, default)
        scenario = self._file.file
        self._tuned = self._own_law()
        self._law_entry = self._tuned.law
        self._motion = declared_motion(self, scenario)
        self._robot = self._motion.robot
        self._compiled = runs_compiled(settings.mode, self._motion.rate_hz, settings.compiled)
        with loading(self._compiled, self.get_logger().info):
            self._law = self._make_law()
        if self._compiled and isinstance(self._law, PlainLaw):
            self.get_logger().info(f"the law {self._law_entry.name} is not compiled, and runs in the interpreter")
        self._law_entry.warm_up()
        self.on_tuned(self._tune)
        self._reply: JointSample | None = None
        self._torque = self.advertise(self._law_entry.topic)
        inputs = [
            Input(JOINT_STATES, fields_of(JOINTS, "position", "velocity")),
            Input(REFERENCE, self._read_reference),
        ]
        self._samples_ahead = self._tuned.samples_ahead
        if self._samples_ahead:
            inputs.append(Input(REFERENCE_AHEAD, fields_of(ahead_names(self._samples_ahead), "position", "velocity")))
        self._announced: tuple[int, FloatArray] | None = None
        """The sample with which a motion begins, and its references, until that sample is answered."""
        self._follows = self._law_entry.follow is not None
        if self._follows:
            inputs.append(Input(REFERENCE_MOTION, self._read_motion))
        if scenario.compensates_disturbance:
            inputs.append(Input(ESTIMATE_DISTURBANCE, fields_of(ACTIVE_JOINTS, "effort")))
        self.join(self._motion.rate_hz, inputs)
        self.listen_to_payload(self._carry)

    def _own_law(self) -> TunedLaw:
        name, controller = self.get_name(), tuned_controller(self._file.file)
        own = controller.law_of_node(name)
        if own is None:
            needed = " and ".join(tuned.law.executable for tuned in controller.laws)
            raise InputError(
                f"{name}: controller: {self._file.file.controller}: its laws run in {needed}: expected one of {name}"
            )
        return own

    def _read_reference(self, message: JointSample) -> Any:
        """Return the values of a reference, which the law expects: it comes before its sample."""
        planned: Any = PLANNED(message)
        sample = self._run.sample(message.stamp_ns)
        if sample is not None:
            self._law.expect(sample, planned)
        return planned

    def _read_motion(self, message: JointSample) -> None:
        """Keep the motion that begins with the stamp, if one does, also where that sample gets no answer.

        Raises:
            MessageError: it is none.
        """
        values = tuple(message.position)
        if len(values) % MOTION_FIELDS or not all(-LARGEST <= value <= LARGEST for value in values):
            raise MessageError(f"{len(values)} values, expected {MOTION_FIELDS} finite numbers for each sample")
        sample = self._run.sample(message.stamp_ns)
        if values and sample is not None:
            self._announced = sample, np.array(values).reshape(-1, MOTION_FIELDS)

    def _make_law(self) -> LawPart:
        _, plan, rate_hz, lead_samples, _ = self._motion
        return law_part(self._tuned, self._compiled, self._robot, plan, rate_hz, lead_samples)

    def _tune(self, changes: dict[str, Any]) -> None:
        self._file.change(changes)
        self._tuned = self._own_law()
        self._law = self._make_law()

    def _carry(self, payload: float) -> None:
        self._robot = one_robot(laden(self._motion.robot, payload))
        self._law.carry(self._robot)

    def restart(self) -> None:
        """Reset the law's memory for a new run."""
        self._announced = None
        self._law = self._make_law()

    def answer(self, sample: int, *values: Any) -> None:
        """Publish the law's torque."""
        joints, planned, *rest = values
        ahead = _platforms(*rest.pop(0)) if self._samples_ahead else None
        if self._follows:
            rest.pop(0)
            if self._announced is not None and self._announced[0] <= sample:
                self._law.follow(self._announced[1])
                self._announced = None
        ((disturbance,),) = rest or ((NO_DISTURBANCE,),)
        torque = self._law.answer(sample, joints, planned, disturbance, ahead)
        self._reply = JointSample(self._run.stamp(sample), ACTIVE_JOINTS, effort=torque)
        self._torque.publish(self._reply)

    def repeat(self) -> None:
        """Publish the same torque again."""
        if self._reply is not None:
            self._torque.publish(self._reply)
