# SPDX-License-Identifier: Apache-2.0
"""In-process topics: nodes of one process exchange messages directly; DDS gets them afterwards.

Between two nodes of one process, transport through DDS costs more than most of their computations. Here a message is
passed to the callbacks of its process by reference. What a callback publishes is passed on before the next callback
runs, and callbacks that work for the next sample run last: so a torque is written as soon as it can be. DDS gets the
messages when all callbacks have run, those at the end of the longest chain first, because the torque command is what
other processes wait for. A topic from another process is received and deserialised once for all listeners.

This is for topics with a single publisher whose messages are never modified: those of the control cycle. Topics that
may have several publishers (faults, states) go through DDS only.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, Protocol

from fivebar_description.ros.subscriptions import TopicSubscription

Callback = Callable[[Any], None]


class Sender(Protocol):
    """Publishes the messages of one topic."""

    def publish(self, message: Any, /) -> None:
        """Publish a message."""


class _Topic:
    """One topic within the process."""

    def __init__(self, subscribe: Callable[[Callback], TopicSubscription] | None = None) -> None:
        self.listeners: list[Callback] = []
        self.ahead = 0
        """How many of the listeners, the last ones, work for the next sample."""
        self.matched: list[Callback] = []
        self.inputs: list[list[TopicSubscription]] = []
        self.subscribe = subscribe
        self.has_writer = False


class ProcessTopics:
    """The topics of one process: nodes register while they are created, then `connect` subscribes to the others."""

    def __init__(self) -> None:
        """Start without topics."""
        self._lines: dict[str, _Topic] = {}
        self._published: list[tuple[list[Callback], Any]] = []
        self._unsent: dict[Sender, tuple[int, list[Any]]] = {}
        """Messages that DDS is to get, by topic, and by how many others the first of them was caused."""
        self._depth = 0
        self._dispatching = False

    def listen(
        self,
        topic: str,
        listener: Callback,
        subscribe: Callable[[Callback], TopicSubscription],
        inputs: list[TopicSubscription],
        ahead: bool = False,
    ) -> None:
        """Register a callback for a topic by its full name; `inputs` receives the subscription, if one is created.

        A callback that works `ahead`, for the next sample, runs after those that do not.
        """
        line = self._lines.setdefault(topic, _Topic())
        line.listeners.insert(len(line.listeners) if ahead else len(line.listeners) - line.ahead, listener)
        line.ahead += ahead
        line.inputs.append(inputs)
        line.subscribe = line.subscribe or subscribe

    def watch(self, topic: str, matched: Callback) -> Callback:
        """Register a callback for what is noticed about the publishers of a topic; return what calls them all."""
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
        if listeners:
            self._published.append((listeners, message))
        if publisher is not None:
            if publisher in self._unsent:
                self._unsent[publisher][1].append(message)
            else:
                self._unsent[publisher] = self._depth, [message]
        if self._dispatching:
            return
        self._dispatching = True
        try:
            self._pass_on()
            unsent = sorted(reversed(self._unsent.items()), key=_depth_of, reverse=True)
            for sender, (_, messages) in unsent:
                for message in messages:
                    sender.publish(message)
        finally:
            # messages left by a callback that raised must not be published with a later one
            self._published.clear()
            self._unsent.clear()
            self._depth = 0
            self._dispatching = False

    def _pass_on(self) -> None:
        """Pass on what is published; where a topic's last message is not through yet, only after everything else.

        So each listener gets the messages of a topic in their order.
        """
        published = self._published
        # messages that are being passed on: to whom still, what, and by how many others each was caused; `busy` has all
        # to whom each is passed on
        passed: list[tuple[Iterator[Callback], Any, int]] = []
        busy: list[list[Callback]] = []
        """All to whom the topic of each is passed on."""
        later: list[tuple[list[Callback], Any]] = []
        while True:
            if published:
                known = {id(listeners) for listeners in busy}
                # the first one that was published comes to lie on top
                for listeners, message in reversed(published):
                    if id(listeners) not in known:
                        passed.append((iter(listeners), message, self._depth))
                        busy.append(listeners)
                later += [publication for publication in published if id(publication[0]) in known]
                published.clear()
            if not passed:
                if not later:
                    return
                self._depth = 0
                published.append(later.pop(0))
                continue
            left, message, depth = passed[-1]
            for listener in left:
                self._depth = depth + 1
                listener(message)
                if published:
                    break
            else:
                passed.pop()
                busy.pop()

    def _receiver(self, listeners: list[Callback]) -> Callback:
        def receive(message: Any) -> None:
            self.dispatch(listeners, message)

        return receive


def _depth_of(unsent: tuple[Sender, tuple[int, list[Any]]]) -> int:
    return unsent[1][0]


class _ProcessSender:
    """Publishes a topic within its process and on DDS."""

    def __init__(self, topics: ProcessTopics, listeners: list[Callback], publisher: Sender) -> None:
        self._topics = topics
        self._listeners = listeners
        self._publisher = publisher

    def publish(self, message: Any, /) -> None:
        self._topics.dispatch(self._listeners, message, self._publisher)
