# SPDX-License-Identifier: Apache-2.0
"""The states of a graph for the live page: nodes, safety, drives, faults and the run."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from diagnostic_msgs.msg import DiagnosticArray
from std_msgs.msg import String

from fivebar_bringup.reference.faults import advice
from fivebar_bringup.ros.diagnostics_listener import LEVELS, LONGEST_NAME, MOST_NODES
from fivebar_description.interface import (
    ALL_WELL,
    DIAGNOSTICS,
    DRIVES_STATE,
    GOAL_STATUS,
    RUN_STATUS,
    SAFETY_STATE,
    Topic,
    node_of_status,
)
from fivebar_description.outside_text import one_line
from fivebar_description.ros.messages import qos_profile
from fivebar_description.ros.node import GraphNode
from fivebar_description.status_texts import read_goal_status, read_run_status
from fivebar_live.run_state import OFF, RunWord, node_level, run_state

R = TypeVar("R")

QUEUE_DEPTH = 50


class GraphStates:
    """Keeps the latest states that the graph publishes."""

    def __init__(
        self,
        node: GraphNode,
        changed: Callable[[], None],
        on_goal: Callable[[Any], None],
        of_drives: Mapping[str, tuple[str, str]],
    ) -> None:
        """Subscribe on behalf of a node.

        Args:
            node: the node; nodes of other namespaces are left out.
            changed: is called when the state of safety or drives changes.
            on_goal: is called with the status of a request.
            of_drives: meaning and recovery of the faults of the drives.
        """
        self._of_drives = of_drives
        self._own = node.get_name()
        self._space = node.get_namespace().rstrip("/") + "/"
        self._texts: dict[str, str] = {}
        self._faults: dict[str, str] = {}
        self._nodes: dict[str, tuple[float, str, str]] = {}
        self._run: dict[str, Any] = {}
        self.ended = False
        """Whether whoever runs the graph has told what became of the run, so that its nodes are silent by right."""

        def follow(topic: Topic, read: Callable[[str], R], take: Callable[[R], None]) -> None:
            node.create_subscription(String, topic.name, node.reading(topic, read, take), qos_profile(topic.qos))

        def follow_state(topic: Topic) -> None:
            def note(text: str) -> None:
                self._texts[topic.name] = text
                # drives that are switched off still have the fault that they had before
                if not text.startswith(OFF):
                    self._faults[topic.name] = text
                changed()

            follow(topic, one_line, note)

        follow_state(SAFETY_STATE)
        follow_state(DRIVES_STATE)
        follow(RUN_STATUS, read_run_status, self._on_run)
        follow(GOAL_STATUS, read_goal_status, on_goal)
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
        state = run_state(self._run, faults, drives, silence)
        word = RunWord.FINISHED if self.ended else state.word
        return {
            "nodes": [
                {"name": name, "level": node_level(level, age, word), "message": message, "age": age}
                for name, age, level, message in nodes
            ],
            "safety": self._texts.get(SAFETY_STATE.name),
            "drives": drives,
            "state": state._asdict(),
            "faults": [{"text": text, **advice(text, self._of_drives)._asdict()} for text in faults],
        }

    def _on_run(self, status: dict[str, Any]) -> None:
        self._run = status

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            name = node_of_status(status.name)
            known = name in self._nodes
            if len(name) > LONGEST_NAME or not (known or len(self._nodes) < MOST_NODES):
                continue
            level = LEVELS.get(status.level, "stale")
            self._nodes[name] = (time.monotonic(), level, one_line(status.message))
