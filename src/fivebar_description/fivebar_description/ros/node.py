# SPDX-License-Identifier: Apache-2.0
"""The base of every node of the graph: checked input, counted drops, readiness, diagnostics and an orderly stop."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from typing import Any, ClassVar, Protocol

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.duration import Duration
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from rclpy.subscription import Subscription
from std_msgs.msg import Float64, String

from fivebar_description.errors import InputError
from fivebar_description.interface import (
    BASE_FRAME,
    CONTROL_QOS,
    DIAGNOSTICS,
    FAULTS,
    HARDWARE,
    JOINT_STATE,
    PAYLOAD,
    READ_BESIDES,
    RUN_PLAN,
    RUN_READY,
    TWIN_OF_TEXT,
    Topic,
    frame_prefix,
    of_robot,
    status_name,
)
from fivebar_description.parameter_names import is_key, meant_by
from fivebar_description.parameters import MOST_PAYLOAD
from fivebar_description.ros.base_node import BaseNode
from fivebar_description.ros.messages import Serializing, Twinned, qos_profile
from fivebar_description.ros.process_topics import ProcessTopics, Sender
from fivebar_description.ros.publisher_watch import PublisherWatch
from fivebar_description.ros.rate_watch import DiagnosticThresholds, RateWatch
from fivebar_description.ros.scheduling import Scheduling, apply_scheduling
from fivebar_description.ros.subscriptions import TopicSubscription, make_publisher
from fivebar_description.ros_environment import BAD_INPUT

READY_PERIOD = 0.1
"""Period (s) of the check whether every subscription of the node has a publisher."""

PATIENCE = 50
"""Checks after which a node says what it still lacks, so that it does not before others have had the time to start."""

DELIVERY_TIME = 1.0
"""Longest time (s) that a node waits at shutdown until its last messages are acknowledged."""

LAST_DELIVERY_TIME = 10.0
"""The same for a node that ends a run by itself: a recorder may be behind, and none of the run's nodes has died."""

REFUSAL_TIME = 1.0
"""Time (s) for which a node that refuses to begin repeats why: the nodes that it would disturb may know neither it nor
the second publisher yet, and would hear of both no more once it has ended."""

REFUSAL_PERIOD = 0.1

DIAGNOSTICS_PERIOD = 1.0

REPORT_PERIOD = 1.0
"""Shortest time (s) between two reports that messages of a topic contradict each other."""


class Agreement(Protocol):
    """The agreement of a node with the other nodes of a run, see `run_agreement.RunAgreement`."""

    problem: str

    @property
    def agrees(self) -> bool:
        """Whether the node may be ready."""

    @property
    def simulated(self) -> bool:
        """Whether time is simulated."""

    @property
    def digest(self) -> str:
        """The digest of the plan, empty before it has come."""


class GraphNode(BaseNode):
    """A node whose topics, messages and parameters are those of the graph."""

    process_topics: ClassVar[ProcessTopics | None] = None
    """In-process topics of this process, if it runs several nodes."""

    in_chain: ClassVar[bool] = False
    """Whether the robot moves by what the node computes: a second publisher of one of its topics is then a fault."""

    works_ahead: ClassVar[bool] = False
    """Whether what the node answers is for the next sample, so that it may come after the torque of the present one."""

    def __init__(self, name: str) -> None:
        """Create the node; subclasses add parameters and topics."""
        super().__init__(name)
        self._inputs: list[TopicSubscription] = []
        self._besides: list[TopicSubscription] = []
        self._outputs: list[Publisher[Any]] = []
        self._complete_checks = 0
        self._announced_wait = False
        self._checks = 0
        self._lacked = ""
        self._thresholds = self.declare_settings(DiagnosticThresholds)
        self._scheduling = self.declare_settings(Scheduling)
        late_after = self._thresholds.late_after_ms
        self._rate_watch = RateWatch(late_after / 1e3 if late_after else math.inf)
        self.exit_status: int | None = None
        """Set by a node that has finished; the process then exits with this status."""
        self.agreement: Agreement | None = None
        """The agreement with the other nodes of a run, if it is part of one; not ready before the plan agrees."""
        self._awaited_nodes: set[str] = set()
        self._announcements: list[Subscription[Any]] = []
        self._ready = self.advertise(RUN_READY)
        self._ready_timer = self.every(READY_PERIOD, self._check_ready)
        self._contradicted: dict[str, float] = {}
        self._refused = ""
        self._watch = PublisherWatch(self, self._on_second_publisher, self._relies_on)
        if self.in_chain:
            self._faults = self.advertise(FAULTS)
            qos = qos_profile(CONTROL_QOS)
            self.create_subscription(String, FAULTS.name, lambda message: self._watch.heard(message.data), qos)
        self._diagnostics = self.create_publisher(DiagnosticArray, DIAGNOSTICS.name, DIAGNOSTICS.qos.depth)
        self.every(DIAGNOSTICS_PERIOD, self.report)

    def stop(self) -> None:
        """Shut down in order; called once, before the node is destroyed, while it can still publish."""

    @property
    def in_simulated_time(self) -> bool:
        """Whether nothing moves while a sample waits for its answer."""
        return self.agreement is not None and self.agreement.simulated

    @property
    def second_publisher(self) -> str:
        """The text of the fault, if a topic of the node has a second publisher now; else empty."""
        return self._watch.known

    def refuses(self, topic: Topic) -> bool:
        """Return whether what comes on a topic must not be used: it may be of a second publisher, or the node ends.

        A node that commands the robot goes on after the first sample, without torque. Before that sample any second
        publisher ends the node.
        """
        if not self.answered:
            if self.in_chain:
                self._watch.count()
            return self._watch.pending or self.exit_status is not None
        if self.commands_robot or not (self._watch.pending or self._watch.conflicts):
            return False
        return self._watch.is_doubtful(self.resolve_topic_name(topic.name))

    def has_second_publisher(self, topic: Topic) -> bool:
        """Return whether a topic has a second publisher now, so that nothing that comes on it can be used."""
        return self._watch.is_contested(self.resolve_topic_name(topic.name))

    def contradicted(self, topic: Topic, moment: str) -> None:
        """Note that two different messages of a topic have come for one moment, so that one is of a second publisher.

        A node outside of the control chain keeps the first.
        """
        if not self.in_chain:
            self.drop(topic, f"another message for {moment} than the first")
            return
        name = self.resolve_topic_name(topic.name)
        if self._watch.suspects(name):
            # its publishers are named soon, or have been
            return
        now = time.monotonic()
        if now < self._contradicted.get(topic.name, -math.inf) + REPORT_PERIOD:
            return
        self._contradicted[topic.name] = now
        self.stop_robot(self._watch.contradiction(name, moment))

    def is_published(self, topic: Topic) -> bool:
        """Return whether a topic has a publisher, other than one that was killed on this machine."""
        return self._watch.is_published(self.resolve_topic_name(topic.name))

    def _relies_on(self, topic: str) -> bool:
        return self.commands_robot or any(topic == read_topic.name for read_topic in READ_BESIDES)

    def _on_second_publisher(self, topic: str, fault: str) -> None:
        """Refuse to begin, or after the first sample stop the robot, unless another node does."""
        self.forget()
        if not self.answered:
            self.get_logger().error(f"refuses to begin: {fault}")
            if self._relies_on(topic):
                self._refused = fault
                self.refuse(fault)
            self.exit_status = BAD_INPUT
        elif self._relies_on(topic):
            self.stop_robot(fault)
        else:
            self.get_logger().error(fault)

    def forget(self) -> None:
        """Forget what has come and is still to be used, since a second publisher may have sent it."""

    def refuse(self, fault: str) -> None:
        """Publish why the node ends before the first sample."""
        self._faults.publish(String(data=fault))

    def stop_robot(self, fault: str) -> None:
        """Report a fault that this node has found, unless another has; whoever commands the robot stops it."""
        if not self._watch.has_heard(fault):
            self._faults.publish(String(data=fault))
        self.get_logger().error(fault)

    def prepared(self) -> bool:
        """Return whether the node has what it needs beside its topics; it is not ready before."""
        return True

    def wait_for_publishers(self, nodes: Iterable[str]) -> None:
        """Announce the node only once other nodes know of its subscriptions: NODE, of another robot ROBOT/NODE.

        For a node that only listens: a message that is published before the publisher has discovered the subscription
        is lost, and is not repeated for this node.
        """
        self._awaited_nodes = set(nodes)

    def on_ready(self) -> None:
        """Act on having been announced to the others."""

    def note_answer(self) -> None:
        """Count a sample as answered at this moment."""
        self.answered += 1
        self._rate_watch.note(time.monotonic())

    def note_pause(self) -> None:
        """Exclude the interval until the next answer from the statistics."""
        self._rate_watch.pause()

    def schedule(self) -> None:
        """Request the priority and the processors that the parameters ask for; call it once all threads run."""
        apply_scheduling(self._scheduling, self.get_logger().warning)

    def deliver(self) -> None:
        """Wait for a limited time until subscribers have acknowledged all messages.

        A publisher that ends discards the rest, and a subscriber whose process was killed never acknowledges. Why the
        node has refused to begin is repeated before, for those that have not discovered it yet.
        """
        repeats_until = time.monotonic() + REFUSAL_TIME
        while self._refused and time.monotonic() < repeats_until:
            time.sleep(REFUSAL_PERIOD)
            self._faults.publish(String(data=self._refused))
        end = time.monotonic() + (LAST_DELIVERY_TIME if self.exit_status == 0 else DELIVERY_TIME)
        for publisher in self._outputs:
            publisher.wait_for_all_acked(Duration(seconds=max(0.0, end - time.monotonic())))

    def check_names(self) -> None:
        """Refuse parameters that were set under a name that is a slip for one of the node's, which ROS ignores.

        Names that are neither a slip nor a key of the run's file are logged: they have no effect on this node.

        Raises:
            InputError: there is one.
        """
        known = {parameter.name for parameter in self.declared}
        for name in self._parameter_overrides:
            if self.has_parameter(name):
                continue
            meant = meant_by(name, known)
            if not meant and not is_key(name):
                self.get_logger().warning(f"parameter {name}: this node has no such parameter")
            if meant:
                raise InputError(
                    f"{self.get_name()}: parameter {name}: no such parameter: expected {' or '.join(meant)}"
                )

    def on_tuned(self, callback: Callable[[dict[str, Any]], None]) -> None:
        """Register a callback that receives the new values of parameters changed at run time."""

        def changed(changes: list[Parameter[Any]]) -> None:
            callback({change.name: change.value for change in changes})

        self.add_post_set_parameters_callback(changed)

    def drain(self, after_each: Callable[[], None] = lambda: None) -> None:
        """Process queued messages where no executor does, and none that are published meanwhile for ever.

        `after_each` is called after each message.
        """
        for subscription in (
            part for topic_subscription in (*self._inputs, *self._besides) for part in topic_subscription.subscriptions
        ):
            handle = subscription.handle
            with handle:
                for _ in range(subscription.qos_profile.depth):
                    taken = handle.take_message(subscription.msg_type, subscription.raw)
                    if taken is None:
                        break
                    wants_all = subscription._callback_type is subscription.CallbackType.WithMessageInfo
                    subscription.callback(*(taken if wants_all else taken[:1]))
                    after_each()

    def destroy_node(self) -> None:
        """Destroy the node and all that it has."""
        for subscription in (*self._inputs, *self._besides):
            subscription.prepare_to_end()
        super().destroy_node()

    def count_lost(self) -> None:
        """Have counted what was lost of each topic, where no executor spins and no more messages come."""
        for subscription in (*self._inputs, *self._besides):
            subscription.count_lost()

    def look_for_others(self) -> None:
        """Take what has come and see whether the node is ready, from a callback for which its executor waits."""
        self.drain()
        if not self._ready_timer.is_canceled():
            self._check_ready()

    def frame(self, name: str) -> str:
        """Return a frame of the URDF as it is named in the namespace of this node's robot."""
        return frame_prefix(self.get_namespace()) + name

    def count_publishers(self, topic_name: str) -> int:
        """Return how many publishers a topic has, by the name that a remapping gives it, which rclpy leaves out."""
        return int(super().count_publishers(self.resolve_topic_name(topic_name)))

    def advertise(self, topic: Topic) -> Sender:
        """Create a publisher of a topic of the graph."""
        publisher = make_publisher(self, topic)
        self._outputs.append(publisher)
        if self.in_chain and topic.one_publisher:
            self._watch.add(topic)
        if topic in TWIN_OF_TEXT:
            twin = make_publisher(self, TWIN_OF_TEXT[topic])
            self._outputs.append(twin)
            return Twinned(self, topic, publisher, twin)
        sender = Serializing(publisher, self.frame(BASE_FRAME)) if topic.type == JOINT_STATE else publisher
        if self.process_topics is None or topic.qos.transient_local:
            return sender
        return self.process_topics.advertise(self.resolve_topic_name(topic.name), sender)

    def listen(
        self,
        topic: Topic,
        callback: Callable[[Any], None],
        depth: int | None = None,
        awaited: bool = True,
        only_reliable: bool = False,
        **options: Any,
    ) -> None:
        """Subscribe to a topic of the graph; where it is not awaited, the node is ready without a publisher of it.

        Topics from outside are heard whatever their publishers offer, unless with `only_reliable` none may be lost.

        What comes on a topic of JointStates is passed on as `JointSample`, unless the options say whether it is raw.
        """
        name = self.resolve_topic_name(topic.name)
        noticed = None
        if self.in_chain and topic.one_publisher:
            noticed = self._watch.contradicted(topic) if topic.of_joints else self._watch.matched(name)
        topics = self.process_topics if awaited and not topic.qos.transient_local else None
        if noticed is not None and topics is not None:
            noticed = topics.watch(name, noticed)
            if self.commands_robot:
                # what another node of the process publishes is not read from DDS
                self._watch.add(topic)
        if topic.of_joints:
            subscribe = partial(TopicSubscription, on_second_sender=noticed)
        else:
            options.setdefault("event_callbacks", SubscriptionEventCallbacks(matched=noticed))
            subscribe = partial(TopicSubscription)
        subscribe = partial(subscribe, self, topic, depth=depth, only_reliable=only_reliable, options=options)
        if not awaited:
            self._besides.append(subscribe(callback))
        elif topics is not None:
            topics.listen(name, callback, subscribe, self._inputs, self.works_ahead)
        else:
            self._inputs.append(subscribe(callback))

    def listen_to_payload(self, carry: Callable[[float], None]) -> None:
        """Have `carry` called with each payload (kg) of the platform from then on; a run needs no publisher of it."""

        def on_message(message: Float64) -> None:
            if not 0.0 <= message.data <= MOST_PAYLOAD:
                self.drop(PAYLOAD, f"{message.data} kg, expected 0 to {MOST_PAYLOAD:g} kg")
                return
            carry(message.data)

        self.listen(PAYLOAD, on_message, awaited=False)

    def _check_ready(self) -> None:
        """Announce the node once it is prepared, the plan agrees and all inputs have had a publisher in two checks.

        Then discovery is complete on both sides. For awaited nodes that is not enough. Their announcements are latched
        and reach a subscription created now, after all others: a node discovers another's subscriptions in the order of
        their creation, so one that serves the last knows all of them.
        """
        if not self._announced_wait:
            self._announced_wait = True
            self.get_logger().info(f"waits for {', '.join(self._waited_for()) or 'nothing'}")
        complete = all(subscription.get_publisher_count() > 0 for subscription in self._inputs)
        complete = complete and (self.agreement is None or self.agreement.agrees) and self.prepared()
        if complete and self._awaited_nodes:
            if not self._announcements:
                self._announcements = [self._hear(robot) for robot in {_robot_of(name) for name in self._awaited_nodes}]
            return
        self._complete_checks = self._complete_checks + 1 if complete else 0
        self._checks += 1
        lacking = self._lacking() if self._checks >= PATIENCE and not complete else ""
        if lacking != self._lacked:
            self._lacked = lacking
            if lacking:
                self.get_logger().warning(f"not ready: {lacking}")
        if self._complete_checks == 2:
            self._ready.publish(String(data=self.get_name()))
            self.on_ready()
            self._ready_timer.cancel()
            self._lacked = ""
            plan = f", plan {self.agreement.digest}" if self.agreement is not None and self.agreement.digest else ""
            self.get_logger().info(f"ready: all inputs are there{plan}")

    def _lacking(self) -> str:
        """Return what the node is not ready for: inputs that it does not hear, the plan, its preparation."""
        inputs = dict.fromkeys(
            subscription.problem or f"{subscription.topic_name} has no publisher"
            for subscription in self._inputs
            if not subscription.get_publisher_count()
        )
        if self.agreement is not None and not self.agreement.agrees:
            inputs[self.agreement.problem or f"{self.resolve_topic_name(RUN_PLAN.name)} has not come"] = None
        return "; ".join([*inputs, *([] if self.prepared() else ["it is being prepared"])])

    def _waited_for(self) -> list[str]:
        """Return what the node waits for before it is ready: publishers of its inputs, the plan, and other nodes."""
        inputs = dict.fromkeys(subscription.topic_name for subscription in self._inputs)
        if self.agreement is not None:
            inputs[self.resolve_topic_name(RUN_PLAN.name)] = None
        return [*inputs, *sorted(self._awaited_nodes)]

    def _hear(self, robot: str) -> Subscription[Any]:
        """Subscribe to the announcements of the nodes of a robot, "" for that of this node."""

        def receive(message: String) -> None:
            self._awaited_nodes.discard(f"{robot}/{message.data}" if robot else message.data)

        topic = of_robot(RUN_READY, robot)
        return self.create_subscription(String, topic.name, receive, qos_profile(topic.qos))

    def health(self) -> tuple[bytes, str]:
        """Return the diagnostic level and message of the node; classes with faults override it."""
        if self.second_publisher:
            return DiagnosticStatus.ERROR, self.second_publisher
        if self.agreement is not None and self.agreement.problem:
            return DiagnosticStatus.ERROR, self.agreement.problem
        if self._lacked:
            return DiagnosticStatus.WARN, f"not ready: {self._lacked}"
        unheard = next(
            (subscription.problem for subscription in (*self._inputs, *self._besides) if subscription.problem), ""
        )
        if unheard:
            return DiagnosticStatus.WARN, unheard
        if self._drops > self._thresholds.warn_dropped:
            return DiagnosticStatus.WARN, f"messages dropped, last: {self._last_drop}"
        return DiagnosticStatus.OK, "ok"

    def metrics(self) -> Mapping[str, object]:
        """Return the metrics that this class adds to those of every node on /diagnostics."""
        return {}

    def report(self) -> None:
        """Publish health and metrics, as each second."""
        rates = self._rate_watch.take()
        level, message = self.health()
        timing = self._thresholds.timing_problem(rates)
        if level == DiagnosticStatus.OK and timing is not None:
            level, message = DiagnosticStatus.WARN, timing
        metrics = {
            "answered": self.answered,
            "rate_hz": f"{rates.rate_hz:.1f}",
            "jitter_ms": f"{rates.jitter_ms:.3f}",
            "interval_max_ms": f"{rates.interval_max_ms:.3f}",
            "late": self._rate_watch.late,
            "dropped": self._drops,
            **self.metrics(),
        }
        status = DiagnosticStatus(
            level=level,
            name=status_name(self.get_fully_qualified_name()),
            message=message,
            hardware_id=frame_prefix(self.get_namespace()) + HARDWARE,
            values=[KeyValue(key=name, value=str(value)) for name, value in metrics.items()],
        )
        array = DiagnosticArray(status=[status])
        array.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(array)


def _robot_of(node: str) -> str:
    return node.rpartition("/")[0]
