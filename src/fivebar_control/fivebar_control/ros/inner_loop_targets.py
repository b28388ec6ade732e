# SPDX-License-Identifier: Apache-2.0
"""The targets that a bridge follows besides the torque where its drives close an inner loop."""

from __future__ import annotations

from fivebar_control.hardware.drive_connection import InnerLoop
from fivebar_control.hardware.drive_interface import JointTarget
from fivebar_description.interface import JOINT_STATES, JOINTS, REFERENCE, REFERENCE_NAMES, Topic
from fivebar_description.joint_sample import JointSample, MessageError
from fivebar_description.ros.node import GraphNode

KEPT = 4
"""Samples whose reference and state are kept: the reference comes ahead, the torque after both."""

Values = tuple[tuple[float, ...], ...]


class InnerLoopTargets:
    """Targets of the inner loop by the stamps of the samples, from `reference` and `joint_states`."""

    def __init__(self, node: GraphNode, inner_loop: InnerLoop) -> None:
        """Have a node listen to both topics."""
        self._node = node
        self._inner_loop = inner_loop
        self._references: dict[int, Values] = {}
        self._states: dict[int, Values] = {}
        node.listen(REFERENCE, self._on_reference)
        node.listen(JOINT_STATES, self._on_state)
        self.counts = {"led_samples": 0, "samples_without_reference": 0}
        """Samples with an inner loop, and those that had none because reference or state was missing."""

    def of(self, stamp_ns: int) -> JointTarget | None:
        """Return the target of a sample; None where its own reference or state is missing, or on the locus."""
        reference, state = self._references.get(stamp_ns), self._states.get(stamp_ns)
        if reference is None or state is None:
            self.counts["samples_without_reference"] += 1
            return None
        target = self._inner_loop(*reference, *state)
        self.counts["led_samples"] += target is not None
        return target

    def _on_reference(self, message: JointSample) -> None:
        self._keep(self._references, REFERENCE, message, REFERENCE_NAMES, ("position",))

    def _on_state(self, message: JointSample) -> None:
        self._keep(self._states, JOINT_STATES, message, JOINTS, ("position", "velocity"))

    def _keep(
        self,
        kept: dict[int, Values],
        topic: Topic,
        message: JointSample,
        names: tuple[str, ...],
        fields: tuple[str, ...],
    ) -> None:
        try:
            values = message.read(names, fields)
        except MessageError as error:
            self._node.drop(topic, str(error))
            return
        if kept.setdefault(message.stamp_ns, values) != values:
            self._node.contradicted(topic, f"the stamp {message.stamp_ns} ns")
        while len(kept) > KEPT:
            kept.pop(next(iter(kept)))
