# SPDX-License-Identifier: Apache-2.0
"""Collects the diagnostics of every node of a running graph from /diagnostics."""

from __future__ import annotations

import time
from typing import NamedTuple

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus

from fivebar_description.interface import DIAGNOSTICS, node_of_status
from fivebar_description.outside_text import one_line
from fivebar_description.ros.domain_member import DomainMember

LEVELS = {
    DiagnosticStatus.OK: "ok",
    DiagnosticStatus.WARN: "warning",
    DiagnosticStatus.ERROR: "error",
    DiagnosticStatus.STALE: "stale",
}

DEPTH = 100

LONGEST_NAME, MOST_NODES, MOST_FIGURES = 256, 256, 64
"""Characters of a node's name, number of nodes, and number of values of each that are kept."""


class NodeReport(NamedTuple):
    """Latest diagnostics of a node: its name, level (ok, warning, error, stale), message and values by name."""

    node: str
    level: str
    message: str
    figures: dict[str, str]


class DiagnosticsListener(DomainMember):
    """Subscribes to /diagnostics."""

    def __init__(self, domain: int) -> None:
        """Join a DDS domain."""
        super().__init__("fivebar_status", domain)
        self._reports: dict[str, tuple[float, NodeReport]] = {}
        self.node.create_subscription(DiagnosticArray, DIAGNOSTICS.name, self._on_diagnostics, DEPTH)

    def wait_for_report(self, seconds: float) -> bool:
        """Wait for the first report, for at most some time (s); return whether one has arrived."""
        return self.wait_for(lambda: self._reports, seconds)

    def reports(self, oldest: float) -> list[NodeReport]:
        """Return the latest report of every node, sorted by name; one older than `oldest` (s) becomes stale."""
        now = time.monotonic()
        return [
            report if now - at <= oldest else report._replace(level="stale", message=f"silent for {now - at:.0f} s")
            for _, (at, report) in sorted(self._reports.items())
        ]

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            name = one_line(node_of_status(status.name), LONGEST_NAME)
            if name not in self._reports and len(self._reports) >= MOST_NODES:
                continue
            figures = {one_line(pair.key, LONGEST_NAME): one_line(pair.value) for pair in status.values[:MOST_FIGURES]}
            level = LEVELS.get(status.level, "stale")
            self._reports[name] = time.monotonic(), NodeReport(name, level, one_line(status.message), figures)
