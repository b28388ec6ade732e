# SPDX-License-Identifier: Apache-2.0
"""The publishers that a node hears on a topic, whatever their quality of service, and those that it does not hear."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rclpy.event_handler import EventHandler, QoSSubscriptionEventType, SubscriptionEventCallbacks
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import (
    DurabilityPolicy,
    InvalidQoSProfileException,
    QoSPolicyKind,
    QoSProfile,
    ReliabilityPolicy,
    qos_policy_name_from_kind,
)
from rclpy.qos_overriding_options import InvalidQosOverridesError, QoSOverridingOptions
from rclpy.subscription import Subscription

from fivebar_description.errors import InputError, unwrapped
from fivebar_description.interface import JOINT_STATE, Topic
from fivebar_description.joint_sample import JointSample, MessageError, part_of
from fivebar_description.outside_text import one_line
from fivebar_description.publishers import OneSender
from fivebar_description.ros.base_node import BaseNode
from fivebar_description.ros.endpoints import node_name
from fivebar_description.ros.messages import SampleReader, best_effort, message_class, qos_profile

SENDER_DEPTH = 1000
"""History depth of publishers. Subscribers of the control path keep few messages, but the recorder must lose none
while it gets no processor time; acknowledged messages are not kept."""

REMOVAL_TIME = 0.1
"""Time (s) after which a subscription that another one has replaced is destroyed."""

MOST_DEPTH = 100_000
"""Messages that a history may be asked to keep."""


def _checked(profile: QoSProfile) -> SetParametersResult:
    """Refuse a depth that the middleware cannot keep, of which it would print lines of its own."""
    return SetParametersResult(
        successful=1 <= profile.depth <= MOST_DEPTH, reason=f"depth {profile.depth}: expected 1 to {MOST_DEPTH}"
    )


OVERRIDDEN = QoSOverridingOptions(
    (QoSPolicyKind.DEPTH, QoSPolicyKind.RELIABILITY, QoSPolicyKind.DURABILITY), callback=_checked
)
"""Policies that the parameters `qos_overrides.TOPIC.publisher` and `.subscription` set."""

WRONG_OVERRIDE = (
    InvalidParameterTypeException,
    InvalidParameterValueException,
    InvalidQoSProfileException,
    InvalidQosOverridesError,
    RuntimeError,
    AssertionError,
)
"""Exceptions of rclpy for a policy that it does not know."""


def _refused(node: Node, topic: Topic, error: Exception) -> InputError:
    return InputError(f"{node.get_name()}: qos_overrides of {topic.name}: {unwrapped(error)}")


def make_publisher(node: Node, topic: Topic) -> Publisher[Any]:
    """Return a publisher of a topic, whose quality of service parameters may override.

    Raises:
        InputError: they do, with what is no such policy.
    """
    depth = topic.qos.depth if topic.qos.transient_local else SENDER_DEPTH
    try:
        return node.create_publisher(
            message_class(topic), topic.name, qos_profile(topic.qos, depth), qos_overriding_options=OVERRIDDEN
        )
    except WRONG_OVERRIDE as error:
        raise _refused(node, topic, error) from error


def with_information(take: Callable[[bytes, Mapping[str, Any]], None]) -> Callable[..., None]:
    """Return a callback of a subscription that takes a message and its information from every executor of rclpy.

    EventsExecutor calls it with a tuple of both, the others with two arguments; either finds out by the signature that
    the information is wanted.
    """

    def receive(*received: Any) -> None:
        take(*(received[0] if len(received) == 1 else received))

    receive.__signature__ = inspect.signature(take)  # type: ignore[attr-defined]
    return receive


class OwnJoints:
    """Reads the robot's joints from what comes on a topic, and notices where two publishers send them."""

    def __init__(self, joints: tuple[str, ...], on_second_sender: Callable[[Any], None] | None) -> None:
        """Begin without a message; `on_second_sender` is called with the information of one of another publisher."""
        self._joints = joints
        self._read = SampleReader()
        self._sender = OneSender()
        self._on_second_sender = on_second_sender

    def read(self, data: bytes, information: Mapping[str, Any]) -> tuple[JointSample, JointSample | None]:
        """Return the sample in a serialised JointState, and its part about the robot's joints, None without any.

        Raises:
            MessageError: it is no JointState.
        """
        sample = self._read(data)
        own = part_of(sample, self._joints)
        contradicted = own is not None and self._sender.is_contradicted(information["publication_sequence_number"])
        if contradicted and self._on_second_sender is not None:
            self._on_second_sender(information)
        return sample, own

    def witness(self, data: bytes, information: Mapping[str, Any]) -> None:
        """Look at a message only for who has sent it."""
        with suppress(MessageError):
            self.read(data, information)


class AlwaysReady:
    """A wait set in which everything is ready, to take an event without waiting for it."""

    def add_event(self, event: object) -> int:
        """Return the index of an event."""
        return 0

    def is_ready(self, kind: str, index: int) -> bool:
        """Return that it is."""
        return True


ALWAYS_READY = AlwaysReady()


class TopicSubscription:
    """A subscription, which hears publishers of topics from outside whatever quality of service they offer.

    That of a sensor asks for best effort, and for reliability as long as all its publishers offer that: so no driver is
    told that nothing is sent, and no picture of a reliable camera is lost. The first readings of a reliable one may be.

    Requests, of which none may be lost, and what is latched, which publishers may keep or not, are subscribed to a
    second time as soon as a publisher offers less.
    """

    def __init__(
        self,
        node: BaseNode,
        topic: Topic,
        callback: Callable[[Any], None],
        depth: int | None,
        only_reliable: bool,
        options: dict[str, Any],
        on_second_sender: Callable[[Any], None] | None = None,
    ) -> None:
        """Subscribe; with `only_reliable` publishers that offer less are reported, also of a topic from outside.

        What comes on a topic of JointStates is passed on as `JointSample`, unless the options say whether it is raw. On
        a topic of the robot's joints that is the part about these; messages of other joints alone are left out.
        `on_second_sender` is called when two publishers send the robot's joints.

        Raises:
            InputError: parameters override the quality of service with what is none.
        """
        self._node = node
        self._topic = topic
        self._callback = callback
        if topic.type == JOINT_STATE and "raw" not in options:
            self._read, self._take = SampleReader(), callback
            self._callback, options["raw"] = self._on_sample, True
            if topic.of_joints:
                self._callback = with_information(self._on_joints)
            self._joints = OwnJoints(topic.of_joints, on_second_sender)
            self._told_others = False
        self._depth = depth if depth is not None else topic.qos.depth
        self._hears_all = topic.from_outside and not only_reliable
        self._follows_offer = self._hears_all and topic.one_publisher
        self._events = options.pop("event_callbacks", None) or SubscriptionEventCallbacks()
        self._events.incompatible_qos = self._on_incompatible
        self._replaced: list[Subscription[Any]] = []
        self._of_losses: list[EventHandler] = []
        if self._follows_offer:
            self._on_publishers = self._events.matched
            self._events.matched = self._on_matched
            # an event of a subscription does not destroy it
            self._removal = node.every(REMOVAL_TIME, self._remove_replaced)
            self._removal.cancel()
        self._options = options
        self._policy = ""
        profile = best_effort(self._depth) if self._follows_offer else qos_profile(topic.qos, depth)
        try:
            self._first = self._subscribe(profile, qos_overriding_options=OVERRIDDEN)
        except WRONG_OVERRIDE as error:
            raise _refused(node, topic, error) from error
        # not where a parameter asks for another
        self._follows_offer &= self._first.qos_profile.reliability == ReliabilityPolicy.BEST_EFFORT
        self.subscriptions: list[Subscription[Any]] = [self._first]
        """The subscription, and the second one if there is one."""
        self.topic_name: str = self._first.topic_name

    def _subscribe(self, profile: QoSProfile, **options: Any) -> Subscription[Any]:
        subscription = self._node.create_subscription(
            message_class(self._topic),
            self._topic.name,
            self._callback,
            profile,
            event_callbacks=self._events,
            **options,
            **self._options,
        )
        # the middleware locks up for ever where an executor takes this event while further messages are lost
        for handler in subscription.event_handlers:
            if handler.event_type == QoSSubscriptionEventType.RCL_SUBSCRIPTION_MESSAGE_LOST:
                self._node.remove_waitable(handler)
                self._of_losses.append(handler)
        return subscription

    def count_lost(self) -> None:
        """Call back with the messages that have been lost, where no executor spins and no more messages come."""
        for handler in self._of_losses:
            handler.add_to_wait_set(ALWAYS_READY)
            information = handler.take_data() if handler.is_ready(ALWAYS_READY) else None
            if information is not None and information.total_count > 0:
                handler.callback(information)

    def _on_sample(self, data: bytes) -> None:
        """Pass on the sample in a serialised JointState, and drop what is none."""
        try:
            sample = self._read(data)
        except MessageError as error:
            self._node.drop(self._topic, str(error))
            return
        self._take(sample)

    def _on_joints(self, data: bytes, information: Mapping[str, Any]) -> None:
        """Pass on the robot's joints in a serialised JointState, which may have others besides, such as a gripper's."""
        try:
            sample, own = self._joints.read(data, information)
        except MessageError as error:
            self._node.drop(self._topic, str(error))
            return
        if own is None:
            self._leave_out(sample)
            return
        if len(own.name) < len(sample.name):
            self._tell_others(sample)
        self._take(own)

    def _leave_out(self, sample: JointSample) -> None:
        """Leave out a message of other joints, which is a mistake where nobody else could send the robot's."""
        if self._topic.name in self._node.external_inputs or self.get_publisher_count() > 1:
            self._tell_others(sample)
            return
        self._node.drop(self._topic, f"has none of {', '.join(self._topic.of_joints)}")

    def _tell_others(self, sample: JointSample) -> None:
        """Log once which joints are left out."""
        if not self._told_others:
            self._told_others = True
            others = [name for name in sample.name if name not in self._topic.of_joints]
            self._node.get_logger().info(f"{self._topic.name} has other joints, too: {one_line(', '.join(others))}")

    def get_publisher_count(self) -> int:
        """Return how many publishers are heard."""
        return max(int(subscription.get_publisher_count()) for subscription in self.subscriptions)

    @property
    def problem(self) -> str:
        """The publishers that are not heard, and why; empty where all are."""
        if not self._policy or (self._topic.of_joints and self.get_publisher_count()):
            # whose joints the others are is not known, and those that are heard may be the robot's
            return ""
        asked = self._first.qos_profile
        publishers = self._node.get_publishers_info_by_topic(self.topic_name)
        names = ", ".join(
            sorted({node_name(publisher) for publisher in publishers if _offers_less(publisher.qos_profile, asked)})
        )
        if not names:
            return ""
        word = self._policy.lower()
        wanted = getattr(asked, word).name.lower() if hasattr(asked, word) else word
        return (
            f"{self.topic_name}: not heard from {names}, since the {word} differs: expected {wanted}, or in this node"
            f" the parameter qos_overrides.{self.topic_name}.subscription.{word}"
        )

    def _on_matched(self, event: Any) -> None:
        """Ask for what all publishers offer, once that has changed."""
        if self._on_publishers is not None:
            self._on_publishers(event)
        if self._follows_offer:
            self._follow_offer()

    def _follow_offer(self) -> None:
        offers = {
            publisher.qos_profile.reliability for publisher in self._node.get_publishers_info_by_topic(self.topic_name)
        }
        wanted = ReliabilityPolicy.RELIABLE if offers == {ReliabilityPolicy.RELIABLE} else ReliabilityPolicy.BEST_EFFORT
        (present,) = self.subscriptions
        if present.qos_profile.reliability == wanted:
            return
        profile = best_effort(present.qos_profile.depth)
        profile.reliability = wanted
        # it hears publishers as well, until it is destroyed
        present.callback = _ignore
        self._replaced.append(present)
        self.subscriptions[:] = [self._subscribe(profile)]
        self._removal.reset()

    def prepare_to_end(self) -> None:
        """Make the node able to destroy the subscriptions."""
        self._give_back([*self._of_losses])

    def _give_back(self, handlers: Sequence[EventHandler]) -> None:
        for handler in handlers:
            # a subscription takes all of its events with it
            self._node.add_waitable(handler)
            self._of_losses.remove(handler)

    def _remove_replaced(self) -> None:
        self._removal.cancel()
        while self._replaced:
            replaced = self._replaced.pop()
            self._give_back([handler for handler in self._of_losses if handler in replaced.event_handlers])
            self._node.destroy_subscription(replaced)

    def _on_incompatible(self, event: Any) -> None:
        if self._follows_offer:
            self._follow_offer()
            return
        if self._hears_all and len(self.subscriptions) == 1:
            if not self._topic.qos.transient_local:
                # it hears the others as well, so each message would come twice
                self._first.callback = _ignore
            self.subscriptions.append(self._subscribe(best_effort(self._depth)))
            return
        if not self._hears_all:
            self._policy = qos_policy_name_from_kind(event.last_policy_kind)
            if self.problem:
                self._node.get_logger().warning(self.problem)


def _offers_less(offered: QoSProfile, asked: QoSProfile) -> bool:
    """Return whether a publisher does not acknowledge, or does not keep for latecomers, as is asked."""
    if asked.reliability == ReliabilityPolicy.RELIABLE and offered.reliability == ReliabilityPolicy.BEST_EFFORT:
        return True
    latched, volatile = DurabilityPolicy.TRANSIENT_LOCAL, DurabilityPolicy.VOLATILE
    return bool(asked.durability == latched and offered.durability == volatile)


def _ignore(message: Any) -> None:
    """Do nothing with a message that another subscription gets too."""
