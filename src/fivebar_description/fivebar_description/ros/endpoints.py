# SPDX-License-Identifier: Apache-2.0
"""Who publishes and who hears a topic, as far as a node has discovered them."""

from __future__ import annotations

import os

from rclpy.node import Node
from rclpy.topic_endpoint_info import TopicEndpointInfo

from fivebar_description.publishers import HALF, PublisherOf


def node_name(endpoint: TopicEndpointInfo) -> str:
    """Return the full name of the node that a publisher or a subscription is of."""
    return f"{endpoint.node_namespace.rstrip('/')}/{endpoint.node_name}"


def publishers_of(node: Node, topic: str) -> list[PublisherOf]:
    """Return the publishers of a topic, by its full name, that a node knows."""
    publishers = node.get_publishers_info_by_topic(topic)
    return [PublisherOf(node_name(publisher), bytes(publisher.endpoint_gid)) for publisher in publishers]


def is_own(node: Node, publisher: PublisherOf) -> bool:
    """Return whether a publisher is of a node of this process, and not of another one's node of the same name."""
    return (publisher.node, publisher.process) == (node.get_fully_qualified_name(), os.getpid() % HALF)
