# SPDX-License-Identifier: Apache-2.0
"""The launcher's node: receives the progress of run and program and publishes faults that the launcher detects."""

from __future__ import annotations

from collections.abc import Callable, Collection
from contextlib import suppress
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from std_msgs.msg import String

from fivebar_bringup.graph.node_spec import BRIDGES
from fivebar_description.interface import (
    DIAGNOSTICS,
    FAULTS,
    PROGRAM_STATUS,
    RUN_STATUS,
    TORQUE_LATENCY,
    node_of_status,
)
from fivebar_description.joint_sample import MessageError
from fivebar_description.outside_text import one_line, read_object
from fivebar_description.process_names import describe_process
from fivebar_description.ros.domain_member import DomainMember
from fivebar_description.status_texts import LatencyText, read_program_status, read_run_status

REPORTS = 100
"""Reports on /diagnostics that are kept until they are read: nodes of one process publish theirs together."""

MOST_STRANGERS = 8
"""Number of processes of other runs that are named."""


class RunMonitor(DomainMember):
    """Subscribes to run/status, program/status and what a bridge tells on /diagnostics, and publishes faults."""

    def __init__(self, domain: int, namespace: str = "", processes: Collection[int] = ()) -> None:
        """Join a DDS domain, in the namespace of a robot.

        Args:
            domain: number of the domain.
            namespace: of the robot, "" for none.
            processes: ids of the run's own processes; a status from any other one belongs to another run.
        """
        super().__init__("run_monitor", domain, namespace)
        self._processes = frozenset(processes)
        self.status: dict[str, Any] = {}
        self.faults: list[str] = []
        """All that have been published, by this node too."""
        self.program: dict[str, Any] = {}
        """The status of the program that is carried out, empty where there is none."""
        self.strangers: set[object] = set()
        """Ids of processes that are not of this run and have published a status."""
        self.bridge_latency: dict[str, float] | None = None
        """Median, 99th percentile and maximum from a sample to its torque (ms), as a bridge has told last."""
        self._bridges = {f"{namespace}/{name}" for name in BRIDGES}
        self.node.create_subscription(DiagnosticArray, DIAGNOSTICS.name, self._on_diagnostics, REPORTS)
        self.listen_to_texts(RUN_STATUS, read_run_status, self._of_this_run(self._take_status))
        self.listen_to_texts(PROGRAM_STATUS, read_program_status, self._of_this_run(self._take_program))
        self.listen_to_texts(FAULTS, one_line, self.faults.append)
        self._faults = self.advertise(FAULTS)

    def sees_nodes(self) -> bool:
        """Return whether any other node has been found in the domain."""
        return len(self.node.get_node_names()) > 1

    def publish_fault(self, fault: str) -> None:
        """Publish a fault; thread-safe."""
        self._faults.publish(String(data=fault))

    def _of_this_run(self, take: Callable[[dict[str, Any]], None]) -> Callable[[dict[str, Any]], None]:
        def receive(status: dict[str, Any]) -> None:
            pid = status.get("pid")
            if pid in self._processes:
                take(status)
            elif pid not in self.strangers and len(self.strangers) < MOST_STRANGERS:
                self.strangers.add(pid)
                self.node.get_logger().warning(f"another run publishes its status here: {describe_process(pid)}")

        return receive

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            if node_of_status(status.name) not in self._bridges:
                continue
            for told in status.values:
                if told.key == TORQUE_LATENCY:
                    self.bridge_latency = None
                    with suppress(MessageError):
                        self.bridge_latency = read_object(told.value, LatencyText)

    def _take_program(self, status: dict[str, Any]) -> None:
        self.program = status

    def _take_status(self, status: dict[str, Any]) -> None:
        self.status = status
