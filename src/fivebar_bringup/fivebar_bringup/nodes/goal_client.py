# SPDX-License-Identifier: Apache-2.0
"""Requests a motion from a running graph and follows its status."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from rclpy.topic_endpoint_info import TopicEndpointInfo

from fivebar_control.planning.timed_points import TimedPoints
from fivebar_control.ros.trajectory_requests import trajectory_message
from fivebar_description.interface import GOAL, GOAL_STATUS, GOAL_TRAJECTORY
from fivebar_description.ros.domain_member import DomainMember
from fivebar_description.ros.messages import goal_message, new_request_id
from fivebar_description.status_texts import read_goal_status

DISCOVERY_TIMEOUT = 5.0
"""Timeout (s) for finding a goal server."""

SETTLING_TIME = 0.5
"""Time (s) within which the latched status of an earlier request arrives."""

ANSWER_TIME = 3.0
"""Time (s) after which a request without any status has not been heard: it is answered as soon as it is.

A server may take seconds to discover a new writer, although the writer has discovered the server, or a recorder.
"""


class GoalClient(DomainMember):
    """Publishes on `goal` and subscribes to `goal/status`."""

    def __init__(self, domain: int, namespace: str = "") -> None:
        """Join a DDS domain, in the namespace of a robot."""
        super().__init__("goal_client", domain, namespace)
        self._statuses: list[dict[str, Any]] = []
        self.listen_to_texts(GOAL_STATUS, read_goal_status, self._on_status)
        self._goal, self._trajectory = self.advertise(GOAL), self.advertise(GOAL_TRAJECTORY)
        self._unanswered: Callable[[], None] | None = None
        self._id = ""

    def find(self) -> bool:
        """Wait for a goal server; return whether there is one."""
        if not self.wait_for(self._found, DISCOVERY_TIMEOUT):
            return False
        self.take_for(SETTLING_TIME)
        self._statuses.clear()
        return True

    def _found(self) -> bool:
        """Return whether a node that answers requests hears them; a recorder hears them, too."""
        answered_by = _nodes(self.node.get_publishers_info_by_topic(GOAL_STATUS.name))
        topics = ((GOAL, self._goal), (GOAL_TRAJECTORY, self._trajectory))
        return all(
            _nodes(self.node.get_subscriptions_info_by_topic(topic.name)) & answered_by
            and publisher.get_subscription_count() > 0
            for topic, publisher in topics
        )

    def request(self, fields: Mapping[str, float]) -> None:
        """Publish a request with these fields by name; from then on only its own statuses count."""
        self._id = new_request_id()
        message = goal_message(fields, self._id)
        self._ask(lambda: self._goal.publish(message))

    def follow(self, points: TimedPoints) -> None:
        """Publish a request to go through points; from then on only its own statuses count."""
        self._id = new_request_id()
        message = trajectory_message(points, self._id)
        self._ask(lambda: self._trajectory.publish(message))

    def _ask(self, publish: Callable[[], None]) -> None:
        self._unanswered = publish
        publish()

    def next_status(self, seconds: float) -> dict[str, Any] | None:
        """Return the next status; None if none arrives within some time (s).

        Until the first one arrives the request is published again from time to time.
        """
        end = time.monotonic() + seconds
        while not self.wait_for(lambda: self._statuses, min(ANSWER_TIME, max(0.0, end - time.monotonic()))):
            if time.monotonic() >= end:
                return None
            if self._unanswered is not None:
                self._unanswered()
        return self._statuses.pop(0)

    def _on_status(self, status: dict[str, Any]) -> None:
        if status.get("id") != self._id:
            return
        self._unanswered = None
        self._statuses.append(status)


def _nodes(endpoints: Sequence[TopicEndpointInfo]) -> set[tuple[str, str]]:
    return {(endpoint.node_namespace, endpoint.node_name) for endpoint in endpoints}
