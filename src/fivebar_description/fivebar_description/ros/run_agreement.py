# SPDX-License-Identifier: Apache-2.0
"""The agreement of the nodes of a run: each compares its parameters with the plan, and numbers samples from stamps.

The trajectory generator publishes the plan once, latched: what the nodes of the run were started with. Whoever keeps
the time, plant or bridge, publishes the epoch, the stamp of sample 0.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from std_msgs.msg import String

from fivebar_description.interface import (
    NANOSECONDS,
    RUN_EPOCH,
    RUN_PLAN,
    START_STAMP_NS,
    Topic,
    moment_of_stamp,
)
from fivebar_description.joint_sample import JointSample, MessageError
from fivebar_description.process_names import describe_process
from fivebar_description.ros.node import GraphNode
from fivebar_description.run_plan import MotionStart, RunPlan, difference, epoch_text, read_epoch, read_plan

LONGEST_RUN_NS = 86_400 * NANOSECONDS
"""Stamps (ns) so far after the epoch that is assumed without any are those of an epoch that is not known yet."""


class RunAgreement:
    """The part of a node in its run; a node makes one after its parameters are declared.

    The node waits for the plan, and while a value differs it refuses to answer: parameters given to one node only would
    otherwise go unnoticed. A new plan, of a trajectory generator that was started again, is compared anew. Requested
    motions do not change the plan. Where nobody publishes plan or epoch, with a node that is tried by itself, there is
    nothing to compare, and sample 0 has the stamp that it has in lockstep.
    """

    def __init__(self, node: GraphNode, rate_hz: int, values: Mapping[str, Any]) -> None:
        """Subscribe to plan and epoch on behalf of a node.

        Args:
            node: the node.
            rate_hz: its sampling rate.
            values: its other values that the plan may hold, by their names in the plan.
        """
        self._node = node
        self._rate_hz = rate_hz
        self._period_ns = NANOSECONDS // rate_hz
        self._own = {"rate_hz": rate_hz, **values}
        self._plan: RunPlan | None = None
        self.epoch_ns = START_STAMP_NS
        """Stamp of sample 0 of the present run, or of the last one."""
        self.begun = False
        """Whether the epoch is known and the run has not ended."""
        self.problem = ""
        """The difference from the plan, for people; empty without one."""
        self.on_begin: Callable[[], None] = _nothing
        """Called when a run with another epoch begins."""
        self.on_plan: Callable[[], None] = _nothing
        """Called when a plan has come."""
        node.agreement = self
        # made before the inputs, so that what was published first is also known first
        node.listen(RUN_PLAN, node.reading(RUN_PLAN, read_plan, self._take_plan), awaited=False)
        self._follow()

    @property
    def agrees(self) -> bool:
        """Whether the plan has come, where there is one, and agrees."""
        return not self.problem and (self._plan is not None or not self._node.count_publishers(RUN_PLAN.name))

    @property
    def holds(self) -> bool:
        """Whether the node may answer samples: the plan agrees and the epoch is known, where there is one."""
        if self.begun and self._plan is not None:
            return not self.problem
        return self.agrees and (self.begun or not self._node.count_publishers(RUN_EPOCH.name))

    @property
    def simulated(self) -> bool:
        """Whether time is simulated, as in lockstep, so that nothing moves while a sample waits for its answer."""
        return self.epoch_ns == START_STAMP_NS

    @property
    def digest(self) -> str:
        """The digest of the plan, empty before it has come."""
        return self._plan.digest if self._plan is not None else ""

    @property
    def start(self) -> MotionStart | None:
        """The start of the motion according to the plan, None before it has come."""
        return None if self._plan is None else self._plan.start

    def stamp(self, sample: int) -> int:
        """Return the stamp (ns) of a sample."""
        return self.epoch_ns + sample * self._period_ns

    def sample(self, stamp_ns: int) -> int | None:
        """Return the sample that a stamp (ns) names; None where it is not on the grid from the epoch on.

        A sample may be heard before the node that keeps the time is known: then its stamp is that of no sample yet.
        """
        if not self.begun and stamp_ns - self.epoch_ns > LONGEST_RUN_NS:
            return None
        # as `sample_of_stamp`, without a call for each of a cycle's two dozen messages
        sample, rest = divmod(stamp_ns - self.epoch_ns, self._period_ns)
        return sample if rest == 0 and sample >= 0 else None

    def read(
        self, topic: Topic, message: JointSample, names: tuple[str, ...], fields: Sequence[str]
    ) -> tuple[int, tuple[tuple[float, ...], ...]] | None:
        """Return sample and fields of a message, as `JointSample.read`; a malformed or unplaceable one is dropped."""
        stamp = message.stamp_ns
        try:
            values = message.read(names, fields)
        except MessageError as error:
            self._node.drop(topic, str(error))
            return None
        sample = self.sample(stamp)
        if sample is None:
            self._node.drop(topic, f"stamp {stamp} ns is not on the grid of {self._rate_hz} Hz")
            return None
        return sample, values

    def moment(self, stamp_ns: int) -> float:
        """Return the moment that a stamp (ns) names, in samples since the epoch."""
        return moment_of_stamp(stamp_ns, self._rate_hz, self.epoch_ns)

    def _follow(self) -> None:
        on_epoch = self._node.reading(RUN_EPOCH, read_epoch, self._take_epoch)
        self._node.listen(RUN_EPOCH, on_epoch, awaited=False)

    def _take_plan(self, plan: RunPlan) -> None:
        self._plan = plan
        disagreement = difference(self._own, plan)
        self.problem = "" if disagreement is None else f"plan_differs: {disagreement}"
        if disagreement is not None:
            source = "" if plan.pid is None else f"; that plan is of {describe_process(plan.pid)}"
            self._node.get_logger().error(f"refuses to answer: {disagreement}{source}")
        self.on_plan()

    def _take_epoch(self, epoch_ns: int | None) -> None:
        self.begun = epoch_ns is not None
        if epoch_ns is not None and epoch_ns != self.epoch_ns:
            self.epoch_ns = epoch_ns
            self.on_begin()


class TimeKeeper(RunAgreement):
    """The part of the node that produces the samples, plant or bridge: it publishes the epoch."""

    def __init__(self, node: GraphNode, rate_hz: int, epoch_ns: int | None = None) -> None:
        """Subscribe to the plan, and announce the stamp of sample 0 (ns) where it is known, else that no run is on."""
        super().__init__(node, rate_hz, {})
        self._announce(epoch_ns)

    def begin(self, epoch_ns: int) -> None:
        """Announce the stamp of sample 0 (ns).

        Topics have no order among each other: let some time pass before that sample, or repeat it until it is answered.
        """
        self._announce(epoch_ns)

    def end(self) -> None:
        """Announce that the run has ended: what comes before the next one belongs to none."""
        self._announce(None)

    def _announce(self, epoch_ns: int | None) -> None:
        self._take_epoch(epoch_ns)
        self._epoch.publish(String(data=epoch_text(epoch_ns)))

    def _follow(self) -> None:
        self._epoch = self._node.advertise(RUN_EPOCH)


def _nothing() -> None:
    """Do nothing."""
