"""The launcher's ear in the graph: how far the run is, and whether the plant has ended it; and its voice for faults."""

from __future__ import annotations

import json
from types import TracebackType
from typing import Any

import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from std_msgs.msg import String

from fivebar_description.interface import FAULTS, RUN_STATUS
from fivebar_description.ros.qos import qos_profile
from fivebar_description.ros.run import use_local_network_only


class RunMonitor:
    """Listens to run/status in a context of its own; use it as a context manager."""

    def __init__(self, domain: int) -> None:
        """Join a DDS domain."""
        use_local_network_only()
        self.status: dict[str, Any] = {}
        self._context = Context()
        rclpy.init(context=self._context, domain_id=domain, signal_handler_options=SignalHandlerOptions.NO)
        self._node = Node("run_monitor", context=self._context)
        self._node.create_subscription(String, RUN_STATUS.name, self._on_status, qos_profile(RUN_STATUS.qos))
        self._faults = self._node.create_publisher(String, FAULTS.name, qos_profile(FAULTS.qos))
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)

    def wait(self, seconds: float) -> None:
        """Take one status message, waiting for it at most some seconds."""
        self._executor.spin_once(timeout_sec=seconds)

    def announce(self, fault: str) -> None:
        """Publish a fault; from any thread."""
        self._faults.publish(String(data=fault))

    def _on_status(self, message: String) -> None:
        self.status = json.loads(message.data)

    def __enter__(self) -> RunMonitor:
        """Return the monitor."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Leave the domain."""
        self._executor.shutdown()
        self._node.destroy_node()
        self._context.try_shutdown()
