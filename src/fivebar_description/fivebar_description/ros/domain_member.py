# SPDX-License-Identifier: Apache-2.0
"""A node for programs that are no part of the graph: in a context of its own, it spins only while it is asked to."""

from __future__ import annotations

import os
import time
from collections import Counter
from collections.abc import Callable
from types import TracebackType
from typing import Any, Self, TypeVar

import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.signals import SignalHandlerOptions

from fivebar_description.errors import InputError
from fivebar_description.interface import Topic
from fivebar_description.interrupts import interrupts_deferred
from fivebar_description.joint_sample import MessageError
from fivebar_description.outside_text import one_line
from fivebar_description.ros.messages import message_class, qos_profile
from fivebar_description.ros.run import use_local_network_only
from fivebar_description.ros_environment import check_ros_environment

R = TypeVar("R")


def _cause() -> str:
    """Return what in the environment may keep ROS from starting, "" for nothing that is known."""
    return ": look at ROS_SECURITY_ENABLE" if os.environ.get("ROS_SECURITY_ENABLE", "").lower() == "true" else ""


LOOK_PERIOD = 0.05
"""Polling period (s) of a condition that is waited for."""


class DomainMember:
    """A member of a DDS domain; use it as a context manager."""

    def __init__(self, name: str, domain: int, namespace: str = "") -> None:
        """Join a domain under the name of a node, in a namespace.

        Raises:
            InputError: ROS cannot start in this environment.
        """
        check_ros_environment()
        use_local_network_only()
        self.refused: Counter[str] = Counter()
        """Messages that were left out because they could not be read, by topic."""
        self._context = Context()
        try:
            rclpy.init(context=self._context, domain_id=domain, signal_handler_options=SignalHandlerOptions.NO)
            self.node = Node(name, namespace=namespace, context=self._context)
        except rclpy_implementation.RCLError as error:
            raise InputError(f"ROS does not start in domain {domain}: {one_line(str(error))}{_cause()}") from error
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)

    def listen(self, topic: Topic, callback: Callable[[Any], None]) -> None:
        """Subscribe to a topic of the graph."""
        self.node.create_subscription(message_class(topic), topic.name, callback, qos_profile(topic.qos))

    def listen_to_texts(self, topic: Topic, read: Callable[[str], R], take: Callable[[R], None]) -> None:
        """Pass on what a reader finds in the texts of a topic; one that it refuses is counted and left out."""

        def receive(message: Any) -> None:
            try:
                value = read(message.data)
            except MessageError as error:
                self.refused[topic.name] += 1
                if self.refused[topic.name] == 1:
                    self.node.get_logger().warning(f"left out a message on {topic.name}: {one_line(str(error))}")
                return
            take(value)

        self.listen(topic, receive)

    def advertise(self, topic: Topic) -> Publisher[Any]:
        """Return a publisher of a topic of the graph."""
        return self.node.create_publisher(message_class(topic), topic.name, qos_profile(topic.qos))

    def take_one(self, seconds: float) -> None:
        """Take one message, waiting for it at most some seconds."""
        with interrupts_deferred():
            self._executor.spin_once(timeout_sec=seconds)

    def take_for(self, seconds: float) -> None:
        """Take what comes within some time (s)."""
        self.wait_for(lambda: False, seconds)

    def wait_for(self, condition: Callable[[], object], seconds: float) -> bool:
        """Take messages until a condition holds, for some seconds at most; return whether it does."""
        end = time.monotonic() + seconds
        while not condition():
            left = end - time.monotonic()
            if left <= 0.0:
                return False
            self.take_one(min(left, LOOK_PERIOD))
        return True

    def __enter__(self) -> Self:
        """Return the member."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Leave the domain."""
        self._executor.shutdown()
        self.node.destroy_node()
        self._context.try_shutdown()
