"""In-process topics: nodes of one process exchange messages directly; DDS gets them afterwards.

Between two nodes of one process, transport through DDS costs more than most of their computations. Here a message is
passed to the callbacks of its process by reference and published on DDS when all of them have run, the newest topic
first, because the torque command is what other processes wait for. A topic from another process is received and
deserialised once for all listeners.

This is for topics with a single publisher whose messages are never modified: those of the control cycle. Topics that
may have several publishers (faults, states) go through DDS only.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Any, Protocol

from fivebar_description.ros.hearing import Hearing

Callback = Callable[[Any], None]


class Sender(Protocol):
    """Publishes the messages of one topic."""

    def publish(self, message: Any, /) -> None:
        """Publish a message."""


class _Topic:
    """One topic within the process."""

    def __init__(self, subscribe: Callable[[Callback], Hearing] | None = None) -> None:
        self.listeners: list[Callback] = []
        self.matched: list[Callback] = []
        self.inputs: list[list[Hearing]] = []
        self.subscribe = subscribe
        self.has_writer = False


class ProcessTopics:
    """The topics of one process: nodes register while they are created, then `connect` subscribes to the others."""

    def __init__(self) -> None:
        """Start without topics."""
        self._lines: dict[str, _Topic] = {}
        self._waiting: deque[tuple[list[Callback], Any]] = deque()
        self._unsent: dict[Sender, list[Any]] = {}
        self._dispatching = False

    def listen(
        self,
        topic: str,
        listener: Callback,
        subscribe: Callable[[Callback], Hearing],
        inputs: list[Hearing],
    ) -> None:
        """Register a callback for a topic by its full name; `inputs` receives the subscription, if one is created."""
        line = self._lines.setdefault(topic, _Topic())
        line.listeners.append(listener)
        line.inputs.append(inputs)
        line.subscribe = line.subscribe or subscribe

    def watch(self, topic: str, matched: Callback) -> Callback:
        """Register a callback for events that a publisher of a topic is found or lost; return what calls them all."""
        callbacks = self._lines.setdefault(topic, _Topic()).matched
        callbacks.append(matched)

        def call(event: Any) -> None:
            for callback in callbacks:
                callback(event)

        return call

    def advertise(self, topic: str, publisher: Sender) -> Sender:
        """Return a publisher of a topic, by its full name, within this process and through `publisher` on DDS."""
        line = self._lines.setdefault(topic, _Topic())
        line.has_writer = True
        return _ProcessSender(self, line.listeners, publisher)

    def connect(self) -> None:
        """Subscribe once to every topic that has listeners but no publisher in this process."""
        for line in self._lines.values():
            if line.subscribe is not None and not line.has_writer:
                subscription = line.subscribe(self._receiver(line.listeners))
                for inputs in line.inputs:
                    inputs.append(subscription)

    def dispatch(self, listeners: list[Callback], message: Any, publisher: Sender | None = None) -> None:
        """Run the callbacks of a message and of all messages that they publish, then publish all of them on DDS."""
        self._waiting.append((listeners, message))
        if publisher is not None:
            self._unsent.setdefault(publisher, []).append(message)
        if self._dispatching:
            return
        self._dispatching = True
        try:
            while self._waiting:
                listeners, message = self._waiting.popleft()
                for listener in listeners:
                    listener(message)
            for sender, messages in reversed(self._unsent.items()):
                for message in messages:
                    sender.publish(message)
        finally:
            # messages left by a callback that raised must not be published with a later one
            self._waiting.clear()
            self._unsent.clear()
            self._dispatching = False

    def _receiver(self, listeners: list[Callback]) -> Callback:
        def receive(message: Any) -> None:
            self.dispatch(listeners, message)

        return receive


class _ProcessSender:
    """Publishes a topic within its process and on DDS."""

    def __init__(self, topics: ProcessTopics, listeners: list[Callback], publisher: Sender) -> None:
        self._topics = topics
        self._listeners = listeners
        self._publisher = publisher

    def publish(self, message: Any, /) -> None:
        self._topics.dispatch(self._listeners, message, self._publisher)
