"""Asks a running graph for a motion and hears what becomes of it."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from types import TracebackType
from typing import Any

import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from fivebar_description.interface import GOAL, GOAL_STATUS
from fivebar_description.ros.qos import qos_profile
from fivebar_description.ros.run import use_local_network_only

FOUND_TIME = 5.0
"""Longest time (s) until somebody who takes requests is found."""

SETTLING_TIME = 0.5
"""Time (s) in which statuses of earlier requests come."""


class GoalClient:
    """Publishes on `goal` and listens to `goal/status`, in a context of its own; use it as a context manager."""

    def __init__(self, domain: int) -> None:
        """Join a DDS domain."""
        use_local_network_only()
        self._statuses: list[dict[str, Any]] = []
        self._context = Context()
        rclpy.init(context=self._context, domain_id=domain, signal_handler_options=SignalHandlerOptions.NO)
        self._node = Node("goal_client", context=self._context)
        self._node.create_subscription(String, GOAL_STATUS.name, self._on_status, qos_profile(GOAL_STATUS.qos))
        self._goal = self._node.create_publisher(JointState, GOAL.name, qos_profile(GOAL.qos))
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)

    def find(self) -> bool:
        """Wait until somebody takes requests; return whether there is anybody."""
        end = time.monotonic() + FOUND_TIME
        while self._goal.get_subscription_count() == 0 or self._node.count_publishers(GOAL_STATUS.name) == 0:
            if time.monotonic() > end:
                return False
            self._executor.spin_once(timeout_sec=0.05)
        settled = time.monotonic() + SETTLING_TIME
        while time.monotonic() < settled:
            self._executor.spin_once(timeout_sec=0.05)
        self._statuses.clear()
        return True

    def request(self, fields: Mapping[str, float]) -> None:
        """Publish a request, by the names of its fields."""
        self._goal.publish(JointState(name=list(fields), position=list(fields.values())))

    def next_status(self, seconds: float) -> dict[str, Any] | None:
        """Return the next status; None if none comes in time (s)."""
        end = time.monotonic() + seconds
        while not self._statuses:
            if time.monotonic() > end:
                return None
            self._executor.spin_once(timeout_sec=0.05)
        return self._statuses.pop(0)

    def _on_status(self, message: String) -> None:
        self._statuses.append(json.loads(message.data))

    def __enter__(self) -> GoalClient:
        """Return the client."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Leave the domain."""
        self._executor.shutdown()
        self._node.destroy_node()
        self._context.try_shutdown()
