"""The states of a graph for the live page: nodes, safety, drives, faults and the run."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from std_msgs.msg import String

from fivebar_bringup.live.recovery import advice
from fivebar_bringup.live.run_state import OFF, node_level, run_state
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
        self._own = node.get_name()
        self._space = node.get_namespace().rstrip("/") + "/"
        self._texts: dict[str, str] = {}
        self._faults: dict[str, str] = {}
        self._nodes: dict[str, tuple[float, str, str]] = {}

        def follow(topic: Topic, then: Callable[[str], None]) -> None:
            def note(message: String) -> None:
                self._texts[topic.name] = message.data
                then(message.data)

            node.create_subscription(String, topic.name, note, qos_profile(topic.qos))

        def follow_faults(topic: Topic) -> None:
            def note(text: str) -> None:
                # drives that are switched off still have the fault that they had before
                if not text.startswith(OFF):
                    self._faults[topic.name] = text
                changed()

            follow(topic, note)

        follow_faults(SAFETY_STATE)
        follow_faults(DRIVES_STATE)
        follow(RUN_STATUS, lambda text: None)
        follow(GOAL_STATUS, lambda text: on_goal(_object(text)))
        node.create_subscription(DiagnosticArray, DIAGNOSTICS.name, self._on_diagnostics, QUEUE_DEPTH)

    def as_json(self) -> dict[str, Any]:
        """Return the states in the page's format."""
        now = time.monotonic()
        texts = [self._faults.get(topic.name, ALL_WELL) for topic in (SAFETY_STATE, DRIVES_STATE)]
        faults = list(dict.fromkeys(text for text in texts if text != ALL_WELL))
        nodes = [
            (name.removeprefix(self._space), round(now - at, 1), level, message)
            for name, (at, level, message) in sorted(self._nodes.items())
            if name.startswith(self._space)
        ]
        drives = self._texts.get(DRIVES_STATE.name)
        # the viewer itself goes on
        silence = min((age for name, age, *_ in nodes if name != self._own), default=None)
        state = run_state(_object(self._texts.get(RUN_STATUS.name, "{}")), faults, drives, silence)
        return {
            "nodes": [
                {"name": name, "level": node_level(level, age, state.word), "message": message, "age": age}
                for name, age, level, message in nodes
            ],
            "safety": self._texts.get(SAFETY_STATE.name),
            "drives": drives,
            "state": state._asdict(),
            "faults": [{"text": text, **advice(text)._asdict()} for text in faults],
        }

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            self._nodes[status.name] = (time.monotonic(), LEVELS.get(status.level, "stale"), status.message)


def _object(text: str) -> Any:
    """Return the JSON object in a text of another node, {} where it is none."""
    try:
        content = json.loads(text)
    except ValueError:
        return {}
    return content if isinstance(content, dict) else {}
