"""The states of a graph for the live page: nodes, safety, drives, faults and the run."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from std_msgs.msg import String

from fivebar_bringup.live.recovery import advice
from fivebar_bringup.nodes.diagnostics_listener import LEVELS
from fivebar_description.interface import (
    ALL_WELL,
    DIAGNOSTICS,
    DRIVES_STATE,
    GOAL_STATUS,
    RUN_STATUS,
    SAFETY_STATE,
    Topic,
)
from fivebar_description.ros.node import GraphNode
from fivebar_description.ros.qos import qos_profile

QUEUE_DEPTH = 50


class GraphStates:
    """Keeps the latest states that the graph publishes."""

    def __init__(self, node: GraphNode, changed: Callable[[], None], on_goal: Callable[[Any], None]) -> None:
        """Subscribe on behalf of a node.

        Args:
            node: the node; nodes of other namespaces are left out.
            changed: is called when the state of safety or drives changes.
            on_goal: is called with the status of a request.
        """
        self._space = node.get_namespace().rstrip("/") + "/"
        self._texts: dict[str, str] = {}
        self._nodes: dict[str, tuple[float, str, str]] = {}

        def follow(topic: Topic, then: Callable[[str], None]) -> None:
            def note(message: String) -> None:
                self._texts[topic.name] = message.data
                then(message.data)

            node.create_subscription(String, topic.name, note, qos_profile(topic.qos))

        follow(SAFETY_STATE, lambda text: changed())
        follow(DRIVES_STATE, lambda text: changed())
        follow(RUN_STATUS, lambda text: None)
        follow(GOAL_STATUS, lambda text: on_goal(_object(text)))
        node.create_subscription(DiagnosticArray, DIAGNOSTICS.name, self._on_diagnostics, QUEUE_DEPTH)

    def as_json(self) -> dict[str, Any]:
        """Return the states in the page's format."""
        now = time.monotonic()
        texts = [self._texts.get(topic.name, ALL_WELL) for topic in (SAFETY_STATE, DRIVES_STATE)]
        faults = dict.fromkeys(text for text in texts if text != ALL_WELL)
        return {
            "nodes": [
                {"name": name.removeprefix(self._space), "level": level, "message": message, "age": round(now - at, 1)}
                for name, (at, level, message) in sorted(self._nodes.items())
                if name.startswith(self._space)
            ],
            "safety": self._texts.get(SAFETY_STATE.name),
            "drives": self._texts.get(DRIVES_STATE.name),
            "run": _object(self._texts.get(RUN_STATUS.name, "{}")),
            "faults": [{"text": text, **advice(text)._asdict()} for text in faults],
        }

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            self._nodes[status.name] = (time.monotonic(), LEVELS.get(status.level, "stale"), status.message)


def _object(text: str) -> Any:
    """Return the JSON object in a text of another node, {} where it is none."""
    try:
        return json.loads(text)
    except ValueError:
        return {}
