"""Asks a running graph for a motion and hears what becomes of it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from sensor_msgs.msg import JointState
from std_msgs.msg import String

from fivebar_description.interface import GOAL, GOAL_STATUS
from fivebar_description.ros.domain_member import DomainMember

FOUND_TIME = 5.0
"""Longest time (s) until somebody who takes requests is found."""

SETTLING_TIME = 0.5
"""Time (s) in which statuses of earlier requests come."""


class GoalClient(DomainMember):
    """Publishes on `goal` and listens to `goal/status`."""

    def __init__(self, domain: int) -> None:
        """Join a DDS domain."""
        super().__init__("goal_client", domain)
        self._statuses: list[dict[str, Any]] = []
        self.listen(GOAL_STATUS, self._on_status)
        self._goal = self.advertise(GOAL)

    def find(self) -> bool:
        """Wait until somebody takes requests; return whether there is anybody."""
        if not self.wait_for(self._found, FOUND_TIME):
            return False
        self.take_for(SETTLING_TIME)
        self._statuses.clear()
        return True

    def _found(self) -> bool:
        return bool(self._goal.get_subscription_count() and self.node.count_publishers(GOAL_STATUS.name))

    def request(self, fields: Mapping[str, float]) -> None:
        """Publish a request, by the names of its fields."""
        self._goal.publish(JointState(name=list(fields), position=list(fields.values())))

    def next_status(self, seconds: float) -> dict[str, Any] | None:
        """Return the next status; None if none comes in time (s)."""
        return self._statuses.pop(0) if self.wait_for(lambda: self._statuses, seconds) else None

    def _on_status(self, message: String) -> None:
        self._statuses.append(json.loads(message.data))
