"""The base of every node of the graph: checked input, counted drops, readiness, diagnostics and an orderly stop."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from typing import Any, ClassVar, TypeVar

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from rclpy.subscription import Subscription
from rclpy.timer import Timer
from std_msgs.msg import String

from fivebar_description.interface import RUN_READY, Topic
from fivebar_description.ros.messages import message_class
from fivebar_description.ros.parameters import Spec, check_changes, declare, specs_of
from fivebar_description.ros.process_topics import ProcessTopics, Sender
from fivebar_description.ros.qos import qos_profile
from fivebar_description.ros.rate_watch import DiagnosticThresholds, RateWatch
from fivebar_description.ros.scheduling import Scheduling, apply_scheduling
from fivebar_description.settings import from_parameters

READY_PERIOD = 0.1
"""Time (s) between two looks at whether all topics of the node are joined to their other ends."""

SENDER_DEPTH = 1000
"""Messages that a sender keeps for listeners which have not taken them yet. A listener keeps few, but what is recorded
must survive a recorder that gets no processor time for a while; acknowledged messages are not kept."""

DELIVERY_TIME = 1.0
"""Longest time (s) that an ending node waits for its last messages to arrive."""

DIAGNOSTICS_PERIOD = 1.0
WARNING_PERIOD = 5.0

S = TypeVar("S", bound=tuple[Any, ...])


class GraphNode(Node):
    """A node whose topics, messages and parameters are those of the graph."""

    process_topics: ClassVar[ProcessTopics | None] = None
    """The topics among the nodes of this process, where there are several."""

    def __init__(self, name: str) -> None:
        """Make the node; parameters and topics are added by its class."""
        super().__init__(name)
        self._specs: list[Spec] = []
        self._inputs: list[Subscription[Any]] = []
        self._outputs: list[Publisher[Any]] = []
        self._steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._complete_looks = 0
        self._drops = 0
        self._last_drop = ""
        self.answered = 0
        """Samples answered so far."""
        self._thresholds = self.declare_settings(DiagnosticThresholds)
        self._scheduling = self.declare_settings(Scheduling)
        late_after = self._thresholds.late_after_ms
        self._rate_watch = RateWatch(late_after / 1e3 if late_after else math.inf)
        self.exit_status: int | None = None
        """Set by a node that has done its work: the process then ends with this status."""
        self._awaited_nodes: set[str] = set()
        self._announcements: Subscription[Any] | None = None
        self._ready = self.advertise(RUN_READY)
        self._ready_timer = self.every(READY_PERIOD, self._look_ready)
        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self.every(DIAGNOSTICS_PERIOD, self._publish_diagnostics)
        self.add_on_set_parameters_callback(lambda changes: check_changes(self._specs, changes))

    def stop(self) -> None:
        """Do what must be done last; called once, before the node ends, while it can still publish."""

    def wait_for_publishers(self, nodes: Iterable[str]) -> None:
        """Announce the node only once other nodes know of its subscriptions.

        For a node that only listens: what is sent before the sender knows of a subscription is lost, and nobody repeats
        it for this node.
        """
        self._awaited_nodes = set(nodes)

    def note_answer(self) -> None:
        """Count a sample as answered, now."""
        self.answered += 1
        self._rate_watch.note(time.monotonic())

    def note_pause(self) -> None:
        """Do not take the time until the next answer for a late one."""
        self._rate_watch.pause()

    def schedule(self) -> None:
        """Ask the system for the priority and the processors of the node's parameters; call it once all threads run."""
        apply_scheduling(self._scheduling, self.get_logger().warning)

    def deliver(self) -> None:
        """Wait until every listener has what was published, for a short while: a node that ends takes the rest along.

        What a listener has not acknowledged by then is lost; one that was killed never will.
        """
        end = time.monotonic() + DELIVERY_TIME
        for publisher in self._outputs:
            publisher.wait_for_all_acked(Duration(seconds=max(0.0, end - time.monotonic())))

    def parameters(self, specs: Sequence[Spec]) -> dict[str, Any]:
        """Declare parameters and return their values.

        Raises:
            InputError: a value given from outside is not allowed.
        """
        values = declare(self, specs)
        # known only now, so that a refused declaration is explained by `declare` and not by rclpy's callback
        self._specs.extend(specs)
        return values

    def declare_settings(
        self, settings: type[S], prefix: str = "", without: Collection[str] = (), **defaults: Any
    ) -> S:
        """Declare the settings of a NamedTuple as parameters and return their values; the arguments as in `specs_of`.

        Raises:
            InputError: a value given from outside is not allowed.
        """
        values = self.parameters(specs_of(settings, prefix, without, **defaults))
        return from_parameters(settings, values, prefix, without)

    def on_tuned(self, callback: Callable[[dict[str, Any]], None]) -> None:
        """Call back with the new values after parameters were changed while the node runs."""

        def changed(changes: list[Parameter[Any]]) -> None:
            callback({change.name: change.value for change in changes})

        self.add_post_set_parameters_callback(changed)

    def take_the_rest(self) -> None:
        """Take what has arrived and still waits; for nodes that only listen, whose end must not lose what was said."""
        for subscription in self._inputs:
            handle = subscription.handle
            with handle:
                while (taken := handle.take_message(subscription.msg_type, subscription.raw)) is not None:
                    subscription.callback(taken[0])

    def advertise(self, topic: Topic) -> Sender:
        """Return who publishes a topic of the graph."""
        depth = topic.qos.depth if topic.qos.transient_local else SENDER_DEPTH
        publisher: Sender = self.create_publisher(message_class(topic), topic.name, qos_profile(topic.qos, depth))
        self._outputs.append(publisher)
        if self.process_topics is None or topic.qos.transient_local:
            return publisher
        return self.process_topics.advertise(self.resolve_topic_name(topic.name), publisher)

    def listen(self, topic: Topic, callback: Callable[[Any], None], depth: int | None = None, **options: Any) -> None:
        """Subscribe to a topic of the graph."""

        def subscribe(callback: Callable[[Any], None]) -> Subscription[Any]:
            return self.create_subscription(
                message_class(topic), topic.name, callback, qos_profile(topic.qos, depth), **options
            )

        if self.process_topics is not None and not topic.qos.transient_local:
            self.process_topics.listen(self.resolve_topic_name(topic.name), callback, subscribe, self._inputs)
        else:
            self._inputs.append(subscribe(callback))

    def every(self, period: float, callback: Callable[[], None]) -> Timer:
        """Call back every `period` seconds of the steady clock."""
        return self.create_timer(period, callback, clock=self._steady)

    def drop(self, topic: Topic, reason: str) -> None:
        """Count a message that is not used, and say so, at most every few seconds."""
        self._drops += 1
        self._last_drop = f"{topic.name}: {reason}"
        self.get_logger().warning(
            f"dropped a message on {self._last_drop} ({self._drops} so far)",
            throttle_duration_sec=WARNING_PERIOD,
        )

    def _look_ready(self) -> None:
        """Announce the node once all its inputs have a publisher, seen twice in a row so that both ends know.

        For awaited nodes that is not enough. Their announcements, which are kept for latecomers, come to a subscription
        made now, after all others: nodes learn of another's subscriptions in the order in which they were made, so a
        node that answers the last one knows of all.
        """
        complete = all(subscription.get_publisher_count() > 0 for subscription in self._inputs)
        if complete and self._awaited_nodes:
            if self._announcements is None:
                self._announcements = self.create_subscription(
                    String, RUN_READY.name, self._on_announcement, qos_profile(RUN_READY.qos)
                )
            return
        self._complete_looks = self._complete_looks + 1 if complete else 0
        if self._complete_looks == 2:
            self._ready.publish(String(data=self.get_name()))
            self._ready_timer.cancel()

    def _on_announcement(self, message: String) -> None:
        self._awaited_nodes.discard(message.data)

    def health(self) -> tuple[bytes, str]:
        """Return the diagnostic level and message of the node; classes with faults override it."""
        if self._drops > self._thresholds.warn_dropped:
            return DiagnosticStatus.WARN, f"messages dropped, last: {self._last_drop}"
        return DiagnosticStatus.OK, "ok"

    def figures(self) -> Mapping[str, object]:
        """Return what a node tells on /diagnostics besides what all tell."""
        return {}

    def _publish_diagnostics(self) -> None:
        rates = self._rate_watch.take()
        level, message = self.health()
        timing = self._thresholds.timing_problem(rates)
        if level == DiagnosticStatus.OK and timing is not None:
            level, message = DiagnosticStatus.WARN, timing
        figures = {
            "answered": self.answered,
            "rate_hz": f"{rates.rate_hz:.1f}",
            "jitter_ms": f"{rates.jitter_ms:.3f}",
            "interval_max_ms": f"{rates.interval_max_ms:.3f}",
            "late": self._rate_watch.late,
            "dropped": self._drops,
            **self.figures(),
        }
        status = DiagnosticStatus(
            level=level,
            name=self.get_fully_qualified_name(),
            message=message,
            hardware_id="fivebar",
            values=[KeyValue(key=name, value=str(value)) for name, value in figures.items()],
        )
        array = DiagnosticArray(status=[status])
        array.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(array)
