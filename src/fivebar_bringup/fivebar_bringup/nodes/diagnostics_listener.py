"""An ear for /diagnostics: what every node of a running graph says of itself."""

from __future__ import annotations

import time
from typing import NamedTuple

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus

from fivebar_description.ros.domain_member import DomainMember

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


class DiagnosticsListener(DomainMember):
    """Listens to /diagnostics."""

    def __init__(self, domain: int) -> None:
        """Join a DDS domain."""
        super().__init__("fivebar_status", domain)
        self._reports: dict[str, tuple[float, NodeReport]] = {}
        self.node.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, DEPTH)

    def heard(self, seconds: float) -> bool:
        """Listen until a node has been heard, for some time (s) at most; return whether one has."""
        return self.wait_for(lambda: self._reports, seconds)

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
