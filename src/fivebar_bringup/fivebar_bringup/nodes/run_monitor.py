"""The launcher's node: receives the progress of run and program and publishes faults that the launcher detects."""

from __future__ import annotations

import json
from typing import Any

from std_msgs.msg import String

from fivebar_description.interface import FAULTS, PROGRAM_STATUS, RUN_STATUS
from fivebar_description.ros.domain_member import DomainMember


class RunMonitor(DomainMember):
    """Subscribes to run/status and program/status, and publishes faults."""

    def __init__(self, domain: int, namespace: str = "") -> None:
        """Join a DDS domain, in the namespace of a robot."""
        super().__init__("run_monitor", domain, namespace)
        self.status: dict[str, Any] = {}
        self.faults: list[str] = []
        """All that have been published, by this node too."""
        self.program: dict[str, Any] = {}
        """The status of the program that is carried out, empty where there is none."""
        self.listen(RUN_STATUS, self._on_status)
        self.listen(PROGRAM_STATUS, self._on_program)
        self.listen(FAULTS, self._on_fault)
        self._faults = self.advertise(FAULTS)

    def publish_fault(self, fault: str) -> None:
        """Publish a fault; thread-safe."""
        self._faults.publish(String(data=fault))

    def _on_fault(self, message: String) -> None:
        self.faults.append(message.data)

    def _on_program(self, message: String) -> None:
        self.program = json.loads(message.data)

    def _on_status(self, message: String) -> None:
        self.status = json.loads(message.data)
