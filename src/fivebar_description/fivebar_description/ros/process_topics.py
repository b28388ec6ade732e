"""Topics among the nodes of one process: a message goes from hand to hand there, and out to everybody else after that.

Between two nodes in one process the way through DDS costs more than what most of them compute. Here a node's message is
handed to the listeners of its process as it is, and published when they have all had their turn, the last topic
first: the torque that a sample has led to is the one that is waited for outside. A topic from outside is taken and
unpacked once, for all who listen.

This is for topics with one writer, whose messages nobody changes or waits for in a service: those that follow the
samples. What may come from several nodes (faults, states) goes through DDS for everybody.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Any, Protocol

from rclpy.subscription import Subscription

Callback = Callable[[Any], None]


class Sender(Protocol):
    """Who publishes messages of one topic."""

    def publish(self, message: Any, /) -> None:
        """Publish a message."""


class _Line:
    """One topic in the process."""

    def __init__(self, subscribe: Callable[[Callback], Subscription[Any]] | None = None) -> None:
        self.listeners: list[Callback] = []
        self.inputs: list[list[Subscription[Any]]] = []
        self.subscribe = subscribe
        self.has_writer = False


class ProcessTopics:
    """The topics of one process. Nodes join while they are made; then `connect` subscribes to what is not made here."""

    def __init__(self) -> None:
        """Begin without any."""
        self._lines: dict[str, _Line] = {}
        self._waiting: deque[tuple[list[Callback], Any]] = deque()
        self._unsent: dict[Sender, list[Any]] = {}
        self._handing_out = False

    def listen(
        self,
        topic: str,
        listener: Callback,
        subscribe: Callable[[Callback], Subscription[Any]],
        inputs: list[Subscription[Any]],
    ) -> None:
        """Let a listener hear a topic, by its full name; `inputs` gets the subscription, if it takes one."""
        line = self._lines.setdefault(topic, _Line())
        line.listeners.append(listener)
        line.inputs.append(inputs)
        line.subscribe = line.subscribe or subscribe

    def advertise(self, topic: str, publisher: Sender) -> Sender:
        """Return who publishes a topic, by its full name, in this process and through `publisher` outside."""
        line = self._lines.setdefault(topic, _Line())
        line.has_writer = True
        return _ProcessSender(self, line.listeners, publisher)

    def connect(self) -> None:
        """Subscribe once to every topic that has listeners but no writer here."""
        for line in self._lines.values():
            if line.subscribe is not None and not line.has_writer:
                subscription = line.subscribe(self._receiver(line.listeners))
                for inputs in line.inputs:
                    inputs.append(subscription)

    def hand_out(self, listeners: list[Callback], message: Any, publisher: Sender | None = None) -> None:
        """Give a message to listeners, then all that follows from it, and publish everything outside."""
        self._waiting.append((listeners, message))
        if publisher is not None:
            self._unsent.setdefault(publisher, []).append(message)
        if self._handing_out:
            return
        self._handing_out = True
        try:
            while self._waiting:
                listeners, message = self._waiting.popleft()
                for listener in listeners:
                    listener(message)
            for sender, messages in reversed(self._unsent.items()):
                for message in messages:
                    sender.publish(message)
        finally:
            # what a failed listener has left must not come out with a later message
            self._waiting.clear()
            self._unsent.clear()
            self._handing_out = False

    def _receiver(self, listeners: list[Callback]) -> Callback:
        def receive(message: Any) -> None:
            self.hand_out(listeners, message)

        return receive


class _ProcessSender:
    """Publishes a topic in its process and outside."""

    def __init__(self, topics: ProcessTopics, listeners: list[Callback], publisher: Sender) -> None:
        self._topics = topics
        self._listeners = listeners
        self._publisher = publisher

    def publish(self, message: Any, /) -> None:
        self._topics.hand_out(self._listeners, message, self._publisher)
