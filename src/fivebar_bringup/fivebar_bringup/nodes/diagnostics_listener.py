"""An ear for /diagnostics: what every node of a running graph says of itself."""

from __future__ import annotations

import time
from types import TracebackType
from typing import NamedTuple

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from fivebar_description.ros.run import use_local_network_only

LEVELS = {
    DiagnosticStatus.OK: "ok",
    DiagnosticStatus.WARN: "warning",
    DiagnosticStatus.ERROR: "error",
    DiagnosticStatus.STALE: "stale",
}

DEPTH = 100


class NodeReport(NamedTuple):
    """What a node said last: its name, level (ok, warning, error, stale), message and figures by name."""

    node: str
    level: str
    message: str
    figures: dict[str, str]


class DiagnosticsListener:
    """Listens to /diagnostics in a context of its own; use it as a context manager."""

    def __init__(self, domain: int) -> None:
        """Join a DDS domain."""
        use_local_network_only()
        self._reports: dict[str, tuple[float, NodeReport]] = {}
        self._context = Context()
        rclpy.init(context=self._context, domain_id=domain, signal_handler_options=SignalHandlerOptions.NO)
        self._node = Node("fivebar_status", context=self._context)
        self._node.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, DEPTH)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)

    def listen(self, seconds: float) -> None:
        """Listen for some time (s)."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0.0:
            self._executor.spin_once(timeout_sec=left)

    def heard(self, seconds: float) -> bool:
        """Listen until a node has been heard, for some time (s) at most; return whether one has."""
        end = time.monotonic() + seconds
        while not self._reports and (left := end - time.monotonic()) > 0.0:
            self._executor.spin_once(timeout_sec=left)
        return bool(self._reports)

    def reports(self, oldest: float) -> list[NodeReport]:
        """Return the last report of every node by name; one older than `oldest` (s) is called stale."""
        now = time.monotonic()
        return [
            report if now - came <= oldest else report._replace(level="stale", message=f"silent for {now - came:.0f} s")
            for _, (came, report) in sorted(self._reports.items())
        ]

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            figures = {pair.key: pair.value for pair in status.values}
            level = LEVELS.get(status.level, "stale")
            self._reports[status.name] = time.monotonic(), NodeReport(status.name, level, status.message, figures)

    def __enter__(self) -> DiagnosticsListener:
        """Return the listener."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Leave the domain."""
        self._executor.shutdown()
        self._node.destroy_node()
        self._context.try_shutdown()
