"""The publishers that a node hears on a topic, whatever their quality of service, and those that it does not hear."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from rcl_interfaces.msg import SetParametersResult
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
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
from fivebar_description.joint_sample import MessageError
from fivebar_description.ros.endpoints import node_name
from fivebar_description.ros.messages import SampleReader, best_effort, message_class, qos_profile

if TYPE_CHECKING:
    from fivebar_description.ros.node import GraphNode

SENDER_DEPTH = 1000
"""History depth of publishers. Subscribers of the control path keep few messages, but the recorder must lose none
while it gets no processor time; acknowledged messages are not kept."""

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


def _refused(node: GraphNode, topic: Topic, error: Exception) -> InputError:
    return InputError(f"{node.get_name()}: qos_overrides of {topic.name}: {unwrapped(error)}")


def make_publisher(node: GraphNode, topic: Topic) -> Publisher[Any]:
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


class Hearing:
    """A subscription, and a second one as soon as a publisher offers less than it asks for, where that is to be heard.

    Sensors may publish with best effort, and a latched topic may get its messages from a publisher that keeps none. A
    subscription that asks for less from the start would lose messages of publishers that do better.
    """

    def __init__(
        self,
        node: GraphNode,
        topic: Topic,
        callback: Callable[[Any], None],
        depth: int | None,
        only_reliable: bool,
        options: dict[str, Any],
    ) -> None:
        """Subscribe; with `only_reliable` publishers that offer less are reported, also of a topic from outside.

        What comes on a topic of JointStates is passed on as `JointSample`, unless the options say whether it is raw.

        Raises:
            InputError: parameters override the quality of service with what is none.
        """
        self._node = node
        self._topic = topic
        self._callback = callback
        if topic.type == JOINT_STATE and "raw" not in options:
            self._read, self._take = SampleReader(), callback
            self._callback, options["raw"] = self._on_sample, True
        self._depth = depth if depth is not None else topic.qos.depth
        self._hears_all = topic.from_outside and not only_reliable
        self._events = options.pop("event_callbacks", None) or SubscriptionEventCallbacks()
        self._events.incompatible_qos = self._on_incompatible
        self._options = options
        self._policy = ""
        profile = qos_profile(topic.qos, depth)
        try:
            self._first = self._subscribe(profile, qos_overriding_options=OVERRIDDEN)
        except WRONG_OVERRIDE as error:
            raise _refused(node, topic, error) from error
        self.subscriptions: list[Subscription[Any]] = [self._first]
        """The subscription, and the second one if there is one."""
        self.topic_name: str = self._first.topic_name

    def _subscribe(self, profile: QoSProfile, **options: Any) -> Subscription[Any]:
        return self._node.create_subscription(
            message_class(self._topic),
            self._topic.name,
            self._callback,
            profile,
            event_callbacks=self._events,
            **options,
            **self._options,
        )

    def _on_sample(self, data: bytes) -> None:
        """Pass on the sample in a serialised JointState, and drop what is none."""
        try:
            sample = self._read(data)
        except MessageError as error:
            self._node.drop(self._topic, str(error))
            return
        self._take(sample)

    def get_publisher_count(self) -> int:
        """Return how many publishers are heard."""
        return max(int(one.get_publisher_count()) for one in self.subscriptions)

    @property
    def problem(self) -> str:
        """The publishers that are not heard, and why; empty where all are."""
        if not self._policy:
            return ""
        asked = self._first.qos_profile
        found = self._node.get_publishers_info_by_topic(self.topic_name)
        names = ", ".join(sorted({node_name(one) for one in found if _offers_less(one.qos_profile, asked)}))
        if not names:
            return ""
        word = self._policy.lower()
        wanted = getattr(asked, word).name.lower() if hasattr(asked, word) else word
        return (
            f"{self.topic_name}: not heard from {names}, since the {word} differs: expected {wanted}, or in this node"
            f" the parameter qos_overrides.{self.topic_name}.subscription.{word}"
        )

    def _on_incompatible(self, event: Any) -> None:
        if self._hears_all and len(self.subscriptions) == 1:
            if not self._topic.qos.transient_local:
                # it hears the others as well, so each message would come twice
                self._first.callback = _ignore
            self.subscriptions.append(self._subscribe(best_effort(self._depth)))
            return
        if not self._hears_all:
            self._policy = qos_policy_name_from_kind(event.last_policy_kind)
            self._node.get_logger().warning(self.problem)


def _offers_less(offered: QoSProfile, asked: QoSProfile) -> bool:
    """Return whether a publisher does not acknowledge, or does not keep for latecomers, as is asked."""
    if asked.reliability == ReliabilityPolicy.RELIABLE and offered.reliability == ReliabilityPolicy.BEST_EFFORT:
        return True
    latched, volatile = DurabilityPolicy.TRANSIENT_LOCAL, DurabilityPolicy.VOLATILE
    return bool(asked.durability == latched and offered.durability == volatile)


def _ignore(message: Any) -> None:
    """Do nothing with a message that another subscription gets too."""
