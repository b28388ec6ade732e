# SPDX-License-Identifier: Apache-2.0
"""Records the graph's topics into an MCAP bag, as raw serialized messages."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from rclpy.event_handler import SubscriptionEventCallbacks
from std_msgs.msg import String

from fivebar_bringup.bag.recorder_settings import ALL_TOPICS, RecorderSettings
from fivebar_bringup.bag.run_time import RunTime, stamp_in
from fivebar_bringup.bag.writer import BagWriter
from fivebar_description.interface import (
    DIAGNOSTICS,
    DRIVES_STATE,
    FAULTS,
    GOAL,
    JOINT_STATE,
    JOINT_STATES,
    MOTOR_STATES,
    PICTURES,
    RECORDED_BESIDES,
    RUN_READY,
    STATE_QOS,
    TOPICS,
    TORQUE_COMMAND,
    VISION_ERROR,
    WORK_TOPICS,
    Topic,
    of_robot,
    robot_of_name,
    topic_named,
)
from fivebar_description.ros.node import GraphNode
from fivebar_description.ros.run import run_node
from fivebar_description.strict_yaml import InputError
from fivebar_description.suggestion import expected_one_of

CHECKPOINT_PERIOD = 0.5
"""Time (s) between two checkpoints: a killed recorder loses less than one second, with margin."""

POLL_PERIOD = 0.01
"""Period (s) of looking whether nodes have ended."""

QUEUE_DEPTH = 20_000
"""Messages that each subscription can queue: many seconds, so that a slow disk loses no message."""

LAST_COMMANDS = (TORQUE_COMMAND, DRIVES_STATE)
"""Topics on which the nodes that command the robot publish that it has been stopped."""

LAST_COMMANDS_TIME = 2.0
"""Longest time (s) to go on recording after a signal until these nodes have ended: they may get it at the same time."""


class BagRecorder(GraphNode):
    """Writes every message of an explicit list of topics and counts messages lost in transport."""

    def __init__(self) -> None:
        """Make the node and the bag."""
        super().__init__("bag_recorder")
        settings = self.declare_settings(RecorderSettings)
        # before there is a bag
        self.check_names()
        topics = [_topic(name) for name in settings.topics]
        directory = _free(Path(settings.directory))
        try:
            self._bag = BagWriter(directory, topics, self.get_namespace())
        except FileExistsError as error:
            raise InputError(f"bag_recorder: directory: {directory}: exists already, expected a new one") from error
        except OSError as error:
            raise InputError(f"bag_recorder: directory: {directory}: cannot be made: {error.strerror}") from error
        self._run_time = RunTime() if settings.simulated_time else None
        self._lost: dict[str, int] = {}
        self._failed = False
        faults = [topic.name for topic in topics if topic.name.endswith(FAULTS.name)]
        robots = {robot_of_name(name, FAULTS.name) for name in faults} or {""}
        commands = [of_robot(topic, robot) for robot in robots for topic in LAST_COMMANDS]
        self._last_commands = [topic for topic in commands if topic in topics]
        self._due = 0.0
        """When the next checkpoint is due while the queues are emptied (monotonic, s)."""
        self._faults_of_robots = [self.advertise(of_robot(FAULTS, robot)) for robot in robots]
        self._announced_to = [self.advertise(of_robot(RUN_READY, robot)) for robot in robots if robot]
        for topic in topics:
            self._record(topic)
        self.wait_for_publishers(settings.wait_for_nodes)
        self.every(CHECKPOINT_PERIOD, self._checkpoint)

    def stop(self) -> None:
        """Record queued messages, and how the robot is stopped, and close the bag, with the number of lost messages.

        Checkpoints go on meanwhile: on a busy machine it may take long, and whoever waits sees that the bag grows.
        """
        self.drain(self._checkpoint_when_due)
        end = time.monotonic() + LAST_COMMANDS_TIME
        while not self._failed and time.monotonic() < end and any(map(self.is_published, self._last_commands)):
            time.sleep(POLL_PERIOD)
            self.drain(self._checkpoint_when_due)
        self.drain(self._checkpoint_when_due)
        self.count_lost()
        lost = {f"dropped {name}": str(count) for name, count in self._lost.items()}
        try:
            self._bag.close({"dropped": str(sum(self._lost.values())), **lost})
        except OSError as error:
            self._fail(error)

    def on_ready(self) -> None:
        """Announce the recorder to the robots of a cell, which are in namespaces of their own."""
        for announced_to in self._announced_to:
            announced_to.publish(String(data=self.get_name()))

    def _record(self, topic: Topic) -> None:
        def count_lost(information: Any) -> None:
            self._lost[topic.name] = information.total_count

        # a picture or a report of health less is no loss of data, nor is a state that a later one has replaced
        counted = not _is_of(topic, (*PICTURES, DIAGNOSTICS)) and topic.qos != STATE_QOS
        events = SubscriptionEventCallbacks(message_lost=count_lost) if counted else None
        self.listen(
            topic,
            self._receiver(topic),
            QUEUE_DEPTH,
            awaited=not _is_of(topic, (*RECORDED_BESIDES, *WORK_TOPICS)),
            raw=True,
            event_callbacks=events,
        )

    def _receiver(self, topic: Topic) -> Callable[[bytes], None]:
        run_time = self._run_time
        sampled = topic.type == JOINT_STATE and not topic.from_outside and not _is_of(topic, (GOAL, VISION_ERROR))
        measured = _is_of(topic, (JOINT_STATES, MOTOR_STATES))

        def receive(data: bytes) -> None:
            if run_time is None:
                log_time = time.time_ns()
            else:
                log_time = run_time.of(topic.name, stamp_in(data) if sampled else None, measured)
            self._bag.write(topic, log_time, data)
            self.answered += 1

        return receive

    def _checkpoint_when_due(self) -> None:
        if time.monotonic() >= self._due:
            self._checkpoint()

    def _checkpoint(self) -> None:
        self._due = time.monotonic() + CHECKPOINT_PERIOD
        try:
            self._bag.checkpoint()
        except OSError as error:
            self._fail(error)

    def _fail(self, error: OSError) -> None:
        """Stop the robot: a run that cannot be recorded must not go on. The bag keeps its last checkpoint."""
        if not self._failed:
            self._failed = True
            text = f"recording_failed: {error.strerror}; the bag ends at its last checkpoint"
            for robot_faults in self._faults_of_robots:
                robot_faults.publish(String(data=text))
            self.get_logger().error(text)
        self.exit_status = 1


def _free(directory: Path) -> Path:
    """Return a directory, or the next one with a number where it is a bag: parameters of a run can be used again."""
    numbered, number = directory, 2
    while (numbered / "metadata.yaml").is_file():
        numbered, number = directory.with_name(f"{directory.name}-{number}"), number + 1
    return numbered


def _is_of(topic: Topic, some: Sequence[Topic]) -> bool:
    """Return whether a topic is one of some, of this robot or of another one in a cell."""
    return any(topic == of_robot(wanted, robot_of_name(topic.name, wanted.name)) for wanted in some)


def _topic(name: str) -> Topic:
    """Return a topic by its name; one of a robot in a namespace begins with that, left/joint_states."""
    topic = topic_named(name)
    parts = name.split("/")
    for number in range(1, len(parts)):
        of_a_robot = topic_named("/".join(parts[number:]))
        if of_a_robot is not None and of_a_robot.name in ALL_TOPICS:
            topic = of_robot(of_a_robot, "/".join(parts[:number]))
            break
    if topic is None:
        known = [topic.name for topic in (*TOPICS, *RECORDED_BESIDES)]
        words = expected_one_of(name, known, ", or the LAW/torque of another law", "some of")
        raise InputError(f"bag_recorder: topics: {name!r}: {words}")
    return topic


def main() -> None:
    """Run the node."""
    run_node(BagRecorder)


if __name__ == "__main__":
    main()
