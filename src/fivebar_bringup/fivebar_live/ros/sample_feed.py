# SPDX-License-Identifier: Apache-2.0
"""The samples of the control cycle for the live page: taken as they come, read only where they are drawn."""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping

from sensor_msgs.msg import JointState
from std_msgs.msg import String

from fivebar_description.interface import (
    ACTIVE_JOINTS,
    JOINT_STATES,
    JOINTS,
    NANOSECONDS,
    REFERENCE,
    REFERENCE_NAMES,
    RUN_EPOCH,
    START_STAMP_NS,
    SUPERVISOR_NAMES,
    SUPERVISOR_STATE,
    Topic,
)
from fivebar_description.joint_sample import MessageError
from fivebar_description.parameters import FiveBar
from fivebar_description.ros.messages import best_effort, own_fields, qos_profile, received_joint_state
from fivebar_description.ros.node import GraphNode
from fivebar_description.run_plan import read_epoch
from fivebar_live.samples import JointStateSample, Messages, row, thinned

QUEUE_DEPTH = 50

PATIENCE = NANOSECONDS // 4
"""Time (ns) after which a sample is shown even if its torque or its blending state is missing."""

STAMP = struct.Struct("<iI")
STAMP_PLACE = 4
"""Where a stamped message in little-endian CDR has its stamp: after the encapsulation."""


class SampleFeed:
    """Joins measurement, reference and supervisor of a sample to a row."""

    def __init__(self, node: GraphNode, begin_again: Callable[[], None]) -> None:
        """Subscribe on behalf of a node; `begin_again` is called when the samples of another run come."""
        self._node = node
        self._begin_again = begin_again
        self._joints, self._references, self._supervisor = Messages(), Messages(), Messages()
        self._epoch_ns = START_STAMP_NS
        self._shown = -1
        for topic, messages in (
            (JOINT_STATES, self._joints),
            (REFERENCE, self._references),
            (SUPERVISOR_STATE, self._supervisor),
        ):
            keep = self._keeper(topic, messages)
            node.create_subscription(JointState, topic.name, keep, best_effort(QUEUE_DEPTH), raw=True)
        on_epoch = node.reading(RUN_EPOCH, read_epoch, self._on_epoch)
        node.create_subscription(String, RUN_EPOCH.name, on_epoch, qos_profile(RUN_EPOCH.qos))

    def reference(self) -> tuple[float, float] | None:
        """Return the newest reference (m), None where there is none."""
        newest = _read(self._references.get(self._references.newest), REFERENCE_NAMES, "position")
        return None if newest is None else (newest[0], newest[1])

    def rows(self, robot: FiveBar) -> list[Mapping[str, float | None]]:
        """Return rows of the samples since the last time that the supervisor has answered, if it answers at all."""
        # what is older than sample 0 belongs to no run
        stamps = self._joints.after(max(self._shown, self._epoch_ns - 1))
        if not stamps:
            return []
        if self._supervisor.newest > stamps[-1] - PATIENCE:
            stamps = [stamp for stamp in stamps if stamp <= self._supervisor.newest]
        rows = []
        for stamp in thinned(stamps):
            values = _read(self._joints.get(stamp), JOINTS, "position", "effort")
            if values is None:
                continue
            torque = (values[4 + JOINTS.index(ACTIVE_JOINTS[0])], values[4 + JOINTS.index(ACTIVE_JOINTS[1])])
            sample = JointStateSample((values[0], values[1], values[2], values[3]), torque)
            reference = _read(self._references.get(stamp), REFERENCE_NAMES, "position")
            answer = _read(self._supervisor.get(stamp), SUPERVISOR_NAMES, "position")
            place = None if reference is None else (reference[0], reference[1])
            weights = None if answer is None else (answer[0], answer[1])
            rows.append(row(robot, stamp - self._epoch_ns, sample, place, weights))
        if stamps:
            self._shown = stamps[-1]
        return rows

    def _keeper(self, topic: Topic, messages: Messages) -> Callable[[bytes], None]:
        def keep(data: bytes) -> None:
            if len(data) < STAMP_PLACE + STAMP.size:
                self._node.drop(topic, f"{len(data)} bytes that are no JointState")
                return
            seconds, nanoseconds = STAMP.unpack_from(data, STAMP_PLACE)
            stamp = seconds * NANOSECONDS + nanoseconds
            if stamp < self._shown - NANOSECONDS:
                self._forget()
            messages.put(stamp, data)

        return keep

    def _on_epoch(self, epoch_ns: int | None) -> None:
        # while no run is on, the samples of the last one are still shown
        if epoch_ns is not None and epoch_ns != self._epoch_ns:
            self._epoch_ns = epoch_ns
            self._forget()

    def _forget(self) -> None:
        """Forget the samples of the run before."""
        self._shown = -1
        for messages in (self._joints, self._references, self._supervisor):
            messages.clear()
        self._begin_again()


def _read(data: bytes | None, names: tuple[str, ...], *fields: str) -> tuple[float, ...] | None:
    """Return the fields of a message one after the other, None where there is none or it is malformed."""
    if data is None:
        return None
    try:
        return sum(own_fields(received_joint_state(data), names, fields, allow_nan=True), ())
    except MessageError:
        return None
