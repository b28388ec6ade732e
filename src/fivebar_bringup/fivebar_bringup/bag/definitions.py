# SPDX-License-Identifier: Apache-2.0
"""Topic metadata of a bag: absolute names, message definitions, type hashes, and QoS as rosbag2 writes it."""

from __future__ import annotations

from functools import cache

from rosbags.typesys import Stores, get_typestore

from fivebar_description.interface import Qos, Topic

TYPESTORE = get_typestore(Stores.ROS2_JAZZY)
"""Message types of ROS 2 Jazzy; serializes and decodes CDR without ROS."""


def absolute_name(topic: Topic, namespace: str = "") -> str:
    """Return the topic's name as the graph sees it, e.g. "/joint_states", or "/left/joint_states" in "left".

    A name that begins with "/" is absolute already.
    """
    if topic.name.startswith("/"):
        return topic.name
    parts = [part for part in namespace.split("/") if part]
    return "/" + "/".join([*parts, topic.name])


@cache
def message_definition(message_type: str) -> str:
    """Return the definition of a type and its dependencies as ros2msg text; KeyError for a type unknown to Jazzy."""
    _known(message_type)
    return TYPESTORE.generate_msgdef(message_type, ros_version=2)[0]


@cache
def type_hash(message_type: str) -> str:
    """Return the RIHS01 hash of a type, as in Jazzy's type support; KeyError for a type unknown to Jazzy."""
    _known(message_type)
    return TYPESTORE.hash_rihs01(message_type)


def qos_profiles(qos: Qos) -> str:
    """Return `offered_qos_profiles` as YAML: a list with one profile, with infinite deadline and lease."""
    durability = "transient_local" if qos.transient_local else "volatile"
    return f"""\
- history: keep_last
  depth: {qos.depth}
  reliability: reliable
  durability: {durability}
  deadline:
    sec: 9223372036
    nsec: 854775807
  lifespan:
    sec: 9223372036
    nsec: 854775807
  liveliness: automatic
  liveliness_lease_duration:
    sec: 9223372036
    nsec: 854775807
  avoid_ros_namespace_conventions: false
"""


def _known(message_type: str) -> None:
    if message_type not in TYPESTORE.fielddefs:
        raise KeyError(f"{message_type}: no such message type in ROS 2 Jazzy")
