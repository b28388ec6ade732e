# SPDX-License-Identifier: Apache-2.0
"""Topics among the nodes of a process: each listener hears each message once, and the torque goes out first."""

from __future__ import annotations

from typing import Any

import pytest

from fivebar_description.ros.process_topics import ProcessTopics


class Outside:
    """Who hears what leaves the process, and from where messages can come."""

    def __init__(self) -> None:
        self.heard: list[tuple[str, Any]] = []
        self.receivers: dict[str, Any] = {}

    def sender(self, topic: str) -> Any:
        outside = self

        class Sender:
            def publish(self, message: Any) -> None:
                outside.heard.append((topic, message))

        return Sender()

    def subscribe(self, topic: str) -> Any:
        def subscribe(callback: Any) -> Any:
            assert topic not in self.receivers, "a second subscription to the same topic"
            self.receivers[topic] = callback
            return topic

        return subscribe


@pytest.fixture
def outside() -> Outside:
    return Outside()


def test_a_chain_runs_to_its_end_before_anything_leaves(outside: Outside) -> None:
    """Two laws answer a state, a third node their answers; the last one's is the first that is heard outside."""
    topics = ProcessTopics()
    inputs: list[Any] = []
    senders = {name: topics.advertise(name, outside.sender(name)) for name in ("law1", "law2", "command")}
    order: list[str] = []

    def law(name: str) -> Any:
        def answer(message: int) -> None:
            order.append(name)
            senders[name].publish(message + 1)

        return answer

    candidates: list[int] = []

    def blend(message: int) -> None:
        assert outside.heard == []
        candidates.append(message)
        if len(candidates) == 2:
            senders["command"].publish(sum(candidates))

    for topic, listener in (("state", law("law1")), ("state", law("law2")), ("law1", blend), ("law2", blend)):
        topics.listen(topic, listener, outside.subscribe(topic), inputs)
    topics.connect()
    assert inputs == ["state", "state"], "only what no node of the process publishes comes from outside"
    outside.receivers["state"](10)
    assert order == ["law1", "law2"]
    assert outside.heard == [("command", 22), ("law2", 11), ("law1", 11)]


def test_messages_of_one_topic_leave_in_their_order(outside: Outside) -> None:
    """A trajectory generator answers sample 0 with the references of two samples."""
    topics = ProcessTopics()
    reference = topics.advertise("reference", outside.sender("reference"))
    torque = topics.advertise("torque", outside.sender("torque"))

    def generate(message: int) -> None:
        reference.publish(message)
        reference.publish(message + 1)

    topics.listen("state", generate, outside.subscribe("state"), [])
    topics.listen("state", torque.publish, outside.subscribe("state"), [])
    topics.connect()
    outside.receivers["state"](0)
    assert outside.heard == [("torque", 0), ("reference", 0), ("reference", 1)]


def test_a_torque_is_there_before_the_work_for_the_next_sample_begins(outside: Outside) -> None:
    """However the nodes were created: the generator first, the law after it, and the blender last."""
    topics = ProcessTopics()
    senders = {name: topics.advertise(name, outside.sender(name)) for name in ("reference", "candidate", "torque")}
    order: list[str] = []

    def node(name: str, publishes: str) -> Any:
        def answer(message: int) -> None:
            order.append(name)
            if publishes:
                senders[publishes].publish(message)

        return answer

    for topic, listener, ahead in (
        ("state", node("generator", "reference"), True),
        ("state", node("law", "candidate"), False),
        ("reference", node("law hears the reference", ""), False),
        ("candidate", node("blender", "torque"), False),
        ("torque", node("bridge", ""), False),
        ("state", node("second law", ""), False),
    ):
        topics.listen(topic, listener, outside.subscribe(topic), [], ahead)
    topics.connect()
    outside.receivers["state"](7)
    assert order == ["law", "blender", "bridge", "second law", "generator", "law hears the reference"]
    # what other processes wait for is at the end of the longest chain
    assert [topic for topic, _ in outside.heard] == ["torque", "reference", "candidate"]


def test_a_listener_gets_the_messages_of_a_topic_in_their_order(outside: Outside) -> None:
    """Also where a bridge measures the next sample while it takes the torque of the present one."""
    topics = ProcessTopics()
    senders = {name: topics.advertise(name, outside.sender(name)) for name in ("state", "torque")}
    seen: list[tuple[str, int]] = []

    def law(message: int) -> None:
        seen.append(("law", message))
        senders["torque"].publish(message)

    def bridge(message: int) -> None:
        seen.append(("bridge", message))
        if message < 3:
            senders["state"].publish(message + 1)

    def generator(message: int) -> None:
        seen.append(("generator", message))

    topics.listen("state", generator, outside.subscribe("state"), [], ahead=True)
    topics.listen("state", law, outside.subscribe("state"), [])
    topics.listen("torque", bridge, outside.subscribe("torque"), [])
    topics.listen("begin", senders["state"].publish, outside.subscribe("begin"), [])
    topics.connect()
    outside.receivers["begin"](1)
    assert seen == [(name, number) for number in (1, 2, 3) for name in ("law", "bridge", "generator")]


def test_a_message_that_answers_nothing_leaves_at_once(outside: Outside) -> None:
    topics = ProcessTopics()
    sender = topics.advertise("command", outside.sender("command"))
    topics.connect()
    sender.publish("zero")
    assert outside.heard == [("command", "zero")]


def test_a_failed_listener_leaves_nothing_behind(outside: Outside) -> None:
    """The last word of a node that ends on an error must get out, and nothing of what it was about to say."""
    topics = ProcessTopics()
    sender = topics.advertise("torque", outside.sender("torque"))

    def fail(message: Any) -> None:
        sender.publish("wrong")
        raise ValueError(message)

    topics.listen("state", fail, outside.subscribe("state"), [])
    topics.connect()
    with pytest.raises(ValueError, match="bad"):
        outside.receivers["state"]("bad")
    sender.publish("zero")
    assert outside.heard == [("torque", "zero")]
