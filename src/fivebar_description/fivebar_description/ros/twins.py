"""The texts of the graph as standard messages, published with them, for tools that show and plot such messages."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from rclpy.publisher import Publisher
from std_msgs.msg import Header, String

from fivebar_description.interface import (
    ALL_WELL,
    BASE_FRAME,
    DRIVES_STATE,
    HARDWARE,
    RUN_EPOCH,
    SAFETY_STATE,
    Topic,
    frame_prefix,
)
from fivebar_description.ros.messages import to_stamp
from fivebar_description.run_plan import read_epoch

if TYPE_CHECKING:
    from fivebar_description.ros.node import GraphNode

LEVELS = {"failed": DiagnosticStatus.ERROR, "refused": DiagnosticStatus.WARN, "stopped": DiagnosticStatus.WARN}
"""Levels of the states of a run, a request or a program; all others are well."""


MOST_LISTED = 25
"""Elements of an array that a twin has: more of them would keep a control cycle waiting."""


class Twinned:
    """Publishes a text and, made of it, the standard message that says the same."""

    def __init__(self, text: Publisher[Any], twin: Publisher[Any], made: Callable[[str], Any]) -> None:
        self._text, self._twin, self._made = text, twin, made

    def publish(self, message: String, /) -> None:
        """Publish a text and its twin."""
        self._text.publish(message)
        self._twin.publish(self._made(message.data))


def twin_of(node: GraphNode, topic: Topic) -> Callable[[str], Any]:
    """Return what makes the twin of a text that a node publishes on a topic."""
    if topic == RUN_EPOCH:
        frame = node.frame(BASE_FRAME)
        return lambda text: Header(stamp=to_stamp(read_epoch(text) or 0), frame_id=frame)
    described = state_status if topic in (SAFETY_STATE, DRIVES_STATE) else content_status
    name = node.resolve_topic_name(topic.name)
    hardware = frame_prefix(node.get_namespace()) + HARDWARE

    def status(text: str) -> DiagnosticStatus:
        found = described(text)
        found.name, found.hardware_id = name, hardware
        return found

    return status


def state_status(text: str) -> DiagnosticStatus:
    """Return the status that a text says: that all is well, or a fault."""
    level = DiagnosticStatus.OK if text == ALL_WELL else DiagnosticStatus.ERROR
    fault, _, detail = text.partition(": ")
    return DiagnosticStatus(level=level, message=text, values=_values({"state": fault, "detail": detail}))


def content_status(text: str) -> DiagnosticStatus:
    """Return the status in a text of JSON: its state, with the reason, and all its values."""
    content = json.loads(text)
    state, reason = str(content["state"]), content.get("reason", "")
    return DiagnosticStatus(
        level=LEVELS.get(state, DiagnosticStatus.OK),
        message=f"{state}: {reason}" if reason else state,
        values=_values(content),
    )


def _values(content: Mapping[str, Any]) -> list[KeyValue]:
    return [KeyValue(key=key, value=value) for key, value in _flat(content, "")]


def _flat(content: Mapping[str, Any], prefix: str) -> Iterator[tuple[str, str]]:
    """Yield values by their names with dots; of an array its elements, by their numbers, of a long one its length."""
    for key, value in content.items():
        if isinstance(value, list) and len(value) > MOST_LISTED:
            yield f"{prefix}{key}.length", str(len(value))
            continue
        if isinstance(value, list):
            value = {str(number): one for number, one in enumerate(value)}
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", "" if value is None else str(value)
