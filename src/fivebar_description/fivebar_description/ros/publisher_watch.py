# SPDX-License-Identifier: Apache-2.0
"""Watches that every topic of the control chain has one publisher, on behalf of a node that reads or publishes it.

DDS tells when a publisher of a topic that the node reads is found (rclpy's matched event). Topics that the node
publishes itself are counted periodically: within one process they are not read from DDS.

On a topic of the robot's joints others may publish other joints. There a second publisher is one that sends joints of
the robot: who reads the topic sees that in the messages, and who publishes it reads it as long as there are others.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from rclpy.subscription import Subscription
from sensor_msgs.msg import JointState

from fivebar_description.interface import RUN_READY, Topic
from fivebar_description.publishers import (
    UNNAMED,
    Living,
    PublisherOf,
    contradiction,
    second_publisher,
    second_publisher_of,
)
from fivebar_description.ros.base_node import BaseNode
from fivebar_description.ros.endpoints import is_own, publishers_of
from fivebar_description.ros.messages import best_effort
from fivebar_description.ros.subscriptions import OwnJoints, with_information

COUNT_PERIOD = 0.05
"""Period (s) of counting the publishers of the topics that the node publishes."""

NAME_PERIOD = 0.002
"""Period (s) of looking for the name of a publisher that was found, which is announced after it."""

NAME_TIME = 0.01
"""Longest time (s) to wait for that name while the robot may move: a few samples."""

NAME_TIME_WITHOUT_TORQUE = 1.0
"""The same in real time in a node that stops the robot by itself, and commands no torque meanwhile."""

NAME_TIME_AT_REST = 3.5
"""The same before the first sample and in lockstep: DDS repeats an announcement that was lost after 3 s."""

NAME_TIME_AFTER_DEATH = 5.0
"""The same where all others have died: the name will say whether it is their successor."""

LOOK_PERIOD = 0.1
"""Period (s) of looking again where a dead predecessor is still known, or a second publisher."""

REPORT_TIME = 0.1
"""Time (s) that a node leaves to those that stop the robot to find a second publisher themselves, before it reports it.

Discovery is not the same for all: a node may hear a publisher for three seconds that another one does not know yet.
"""

DISCOVERY_TIME = 3.5
"""Time (s) within which this node knows a publisher that another one has found, if it is still there. A publisher of
the robot's joints that has sent none for so long has ended, or goes on with other joints."""

WITNESS_DEPTH = 100
"""Messages that are kept of a topic that the node itself publishes, and others too."""

Matched = Callable[[Any], None]


class PublisherWatch:
    """The topics of a node that have one publisher, and what was found to contradict that."""

    def __init__(self, node: BaseNode, on_conflict: Callable[[str, str], None], relies: Callable[[str], bool]) -> None:
        """Watch on behalf of a node.

        Args:
            node: the node.
            on_conflict: called with a topic and the text of the fault.
            relies: returns whether it is this node that has to stop, or to have others stop, for a topic.
        """
        self._node = node
        self._on_conflict = on_conflict
        self._relies = relies
        self._living = Living(time.monotonic)
        self._machine = b""
        self._counted: dict[str, Topic] = {}
        self._witnesses: dict[str, Subscription[Any]] = {}
        self._joints: dict[str, tuple[str, ...]] = {}
        self._sent_by_two: dict[str, float] = {}
        self._suspected: dict[str, float] = {}
        self._look_again: dict[str, float] = {}
        self._watched: set[str] = set()
        self._reported: dict[str, tuple[float, str]] = {}
        self._unreported: dict[str, float] = {}
        self.conflicts: dict[str, str] = {}
        """The text of the fault of each topic that has a second publisher now."""
        self.pending = False
        """Whether a publisher has been found that may be a second one: there must be no torque meanwhile."""
        self._counting = node.every(COUNT_PERIOD, self.count)
        self._naming = node.every(NAME_PERIOD, self._look)
        self._naming.cancel()

    def matched(self, topic: str) -> Matched:
        """Return what a subscription of a topic, by its full name, calls when a publisher is found or lost."""
        self._watched.add(topic)

        def matched(event: Any) -> None:
            # of a topic with two subscriptions each counts its own
            if event.current_count > 1 or self._node.count_publishers(topic) > 1:
                self._suspect(topic)
            else:
                self._clear(topic)

        return matched

    def contradicted(self, topic: Topic) -> Matched:
        """Return what a subscription of a topic of joints calls when two publishers send the robot's."""
        name = self._node.resolve_topic_name(topic.name)
        self._watched.add(name)
        self._joints[name] = topic.of_joints

        def contradicted(event: Any) -> None:
            if self._node.count_publishers(name) > 1:
                self._sent_by_two[name] = time.monotonic()
                self._suspect(name)

        return contradicted

    def add(self, topic: Topic) -> None:
        """Count the publishers of a topic."""
        name = self._node.resolve_topic_name(topic.name)
        self._watched.add(name)
        self._counted[name] = topic

    def count(self) -> None:
        """Count publishers, and look again at topics that had several."""
        for name, counted in self._counted.items():
            several = self._node.count_publishers(name) > 1
            if counted.of_joints:
                self._read_with_others(counted, several)
            elif several and name not in self._look_again:
                self._suspect(name)
        now = time.monotonic()
        for topic in [watched for watched, when in self._look_again.items() if when <= now]:
            self._suspect(topic)
        for topic in [watched for watched, when in self._unreported.items() if when <= now]:
            del self._unreported[topic]
            self._node.stop_robot(self.conflicts[topic])

    def has_heard(self, fault: str) -> bool:
        """Return whether a node has reported this second publisher already."""
        return any(fault.startswith(second_publisher_of(self._short(topic))) for topic in self._reported)

    @property
    def known(self) -> str:
        """The text of the fault, if a topic of the node has a second publisher; else empty.

        One that another node has reported may not be known here yet.
        """
        since = time.monotonic() - DISCOVERY_TIME
        reported = (fault for when, fault in self._reported.values() if when > since)
        return next(iter(self.conflicts.values()), "") or next(reported, "")

    def heard(self, fault: str) -> None:
        """Take note of a fault that a node has reported."""
        for topic in self._watched:
            if fault.startswith(second_publisher_of(self._short(topic))):
                self._unreported.pop(topic, None)
                self._reported[topic] = time.monotonic(), fault

    def is_doubtful(self, topic: str) -> bool:
        """Return whether a topic has a second publisher, or may have one for which this node has to stop."""
        if topic in self.conflicts:
            return self.is_contested(topic)
        return topic in self._suspected and self._relies(self._short(topic))

    def is_contested(self, topic: str) -> bool:
        """Return whether a topic is known to have a second publisher, and the robot is stopped for it."""
        return topic in self.conflicts and topic not in self._unreported

    def suspects(self, topic: str) -> bool:
        """Return whether a topic has, or may have, a second publisher."""
        return topic in self.conflicts or topic in self._suspected

    def is_published(self, topic: str) -> bool:
        """Return whether a topic, by its full name, has a publisher whose process is not known to have ended."""
        machine = self._own_machine()
        return any(not self._living.is_gone(publisher, machine) for publisher in publishers_of(self._node, topic))

    def contradiction(self, topic: str, moment: str) -> str:
        """Return the text of the fault that two different messages of a moment are."""
        alive = self._living.among(publishers_of(self._node, topic), self._own_machine())
        return contradiction(self._short(topic), moment, alive, self._own_machine())

    def _read_with_others(self, topic: Topic, several: bool) -> None:
        """Read a topic of joints that the node publishes, as long as there are others who do."""
        name = self._node.resolve_topic_name(topic.name)
        if several and name not in self._witnesses:
            joints = OwnJoints(topic.of_joints, self.contradicted(topic))
            qos = best_effort(WITNESS_DEPTH)
            self._witnesses[name] = self._node.create_subscription(
                JointState, name, with_information(joints.witness), qos, raw=True
            )
        elif not several and name in self._witnesses:
            self._node.destroy_subscription(self._witnesses.pop(name))

    def _suspect(self, topic: str) -> None:
        self._suspected.setdefault(topic, time.monotonic())
        self._look()

    def _clear(self, topic: str) -> None:
        for known in (self._suspected, self._look_again):
            known.pop(topic, None)
        self._end_conflict(topic)
        self._update()

    def _end_conflict(self, topic: str) -> None:
        self.conflicts.pop(topic, None)
        self._unreported.pop(topic, None)
        self._reported.pop(topic, None)

    def _look(self) -> None:
        """Report each suspected topic that has several living publishers, once their names are known or time is up."""
        now, machine = time.monotonic(), self._own_machine()
        for topic, since in list(self._suspected.items()):
            publishers = publishers_of(self._node, topic)
            complete = len(publishers) > 1 and all(publisher.known for publisher in publishers)
            waits = topic not in self.conflicts and now - since < self._longest_wait(publishers, machine)
            if waits and not complete:
                continue
            del self._suspected[topic]
            alive = self._living.among(publishers, machine)
            if topic in self._joints and now - self._sent_by_two[topic] > DISCOVERY_TIME:
                alive = alive[:1]
            if len(publishers) > 1:
                self._look_again[topic] = now + LOOK_PERIOD
            else:
                self._look_again.pop(topic, None)
            if len(alive) < 2:
                self._end_conflict(topic)
            elif topic not in self.conflicts or complete:
                joints = self._joints.get(topic, ())
                self._report(topic, second_publisher(self._short(topic), alive, machine, joints))
        self._update()

    def _report(self, topic: str, fault: str) -> None:
        """Report a second publisher, and log it again where a name that was not known has become known."""
        before = self.conflicts.get(topic, "")
        self.conflicts[topic] = fault
        if not before:
            self._on_conflict(self._short(topic), fault)
            if self._node.answered and not self._relies(self._short(topic)) and topic not in self._reported:
                self._unreported[topic] = time.monotonic() + REPORT_TIME
        elif UNNAMED in before:
            self._node.get_logger().error(fault)

    def _longest_wait(self, publishers: list[PublisherOf], machine: bytes) -> float:
        """Return how long (s) names are awaited."""
        if len(publishers) > 1 and sum(not self._living.is_gone(publisher, machine) for publisher in publishers) < 2:
            return NAME_TIME_AFTER_DEATH
        if not self._node.answered or self._node.in_simulated_time:
            return NAME_TIME_AT_REST
        return NAME_TIME_WITHOUT_TORQUE if self._node.commands_robot else NAME_TIME

    def _update(self) -> None:
        """Wait for names that are not known; a topic that has been reported stays so while it is looked at again."""
        open_topics = [topic for topic in self._suspected if topic not in self.conflicts]
        self.pending = any(self._relies(self._short(topic)) or not self._node.answered for topic in open_topics)
        if self._suspected and self._naming.is_canceled():
            self._naming.reset()
        elif not self._suspected and not self._naming.is_canceled():
            self._naming.cancel()

    def _own_machine(self) -> bytes:
        """Return this machine's part of identities, by a publisher of this node."""
        if not self._machine:
            publishers = publishers_of(self._node, self._node.resolve_topic_name(RUN_READY.name))
            own = (publisher.machine for publisher in publishers if is_own(self._node, publisher))
            self._machine = next(own, b"")
        return self._machine

    def _short(self, topic: str) -> str:
        """Return a topic's name as people know it, relative to the node's namespace."""
        return topic.removeprefix(self._node.get_namespace().rstrip("/") + "/")
