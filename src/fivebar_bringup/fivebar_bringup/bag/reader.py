# SPDX-License-Identifier: Apache-2.0
"""Reads a rosbag2 directory, recorded by `fivebar` or by `ros2 bag record`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path

from rosbags.rosbag2 import Reader

from fivebar_bringup.bag.definitions import TYPESTORE
from fivebar_bringup.bag.recording import RawTopic, Recording, has_names
from fivebar_bringup.errors import BagError
from fivebar_description.errors import unwrapped
from fivebar_description.files import endless_kind
from fivebar_description.interface import JOINT_STATES, MOTOR_STATES, RUN_READY
from fivebar_description.topic_contents import Content, content_of

__all__ = ["RawTopic", "Recording", "read_bag"]


ALWAYS_RECORDED = (JOINT_STATES, MOTOR_STATES, RUN_READY)
"""Topics by which the namespace of a run is found, the first that a bag has."""


SEARCHED = 1000
"""Messages of a topic among which the robot's joints are looked for."""


def read_bag(directory: Path, namespace: str | None = None) -> Recording:
    """Read all messages of a bag into memory; `namespace` is that of the recorded topics, None for the one it has.

    Raises :class:`BagError`, one line that begins with the path, if the directory or its metadata.yaml is missing, if
    a file of the bag is missing, truncated, damaged or none, such as a pipe, or if the namespace has no robot while
    others have one; these are named.
    """
    if not directory.is_dir():
        raise BagError(directory, "no such directory")
    metadata = directory / "metadata.yaml"
    if not metadata.is_file():
        kind = endless_kind(metadata)
        raise BagError(metadata, "missing, so this is not a bag" if kind is None else f"is {kind}: expected a file")
    for file in sorted(directory.iterdir()):
        # the reader would wait for a writer, or read for ever
        if (kind := endless_kind(file)) is not None:
            raise BagError(file, f"is {kind}: expected a file")
    try:
        topics, custom_data, promised = _read(directory)
    except Exception as error:  # the reader raises many kinds of exception on damaged files, assertions included
        what = unwrapped(error) or type(error).__name__
        if isinstance(error, MemoryError):
            what = "a length in it is beyond this machine's memory, as in damaged files"
        raise BagError(directory, f"the bag cannot be read: {what}") from error
    count = sum(len(topic.messages) for topic in topics.values())
    if count < promised:
        raise BagError(directory, f"the bag holds {count} of the {promised} messages that its metadata.yaml names")
    if namespace is None:
        return Recording(directory, topics, custom_data, _found(directory, topics))
    known = _namespaces(topics)
    if known and "/".join(["", *filter(None, namespace.split("/"))]) not in known:
        raise BagError(
            directory,
            f"has no robot in the namespace {namespace or '/'}: expected {_shown(known)} by --namespace, or none given",
        )
    return Recording(directory, topics, custom_data, namespace)


def _namespaces(topics: Iterable[str]) -> list[str]:
    """Return all namespaces with topics by which that of a run is found, "" for none."""
    ends = tuple(f"/{known.name}" for known in ALWAYS_RECORDED)
    return sorted({name.removesuffix(end) for name in topics for end in ends if name.endswith(end)})


def _shown(namespaces: Iterable[str]) -> str:
    return ", ".join(namespace or "/" for namespace in namespaces)


def _found(directory: Path, topics: Mapping[str, RawTopic]) -> str:
    """Return the namespace of the robot's run in a bag, "" for none; BagError where several runs are in it.

    A namespace whose joint states are of another robot is none of a run.
    """
    for known in ALWAYS_RECORDED:
        end = f"/{known.name}"
        named = sorted(name.removesuffix(end) for name in topics if name.endswith(end))
        own = [namespace for namespace in named if _is_own(topics[f"{namespace}{end}"], content_of(known))]
        if len(own) > 1:
            shown = _shown(own)
            raise BagError(directory, f"holds the runs of several namespaces, {shown}: expected one, by --namespace")
        if own:
            return own[0]
    return ""


def _is_own(topic: RawTopic, content: Content | None) -> bool:
    """Return whether a topic is of a run: one of joint states has the robot's, unless it has no message."""
    if content is None or not topic.messages:
        return True
    with suppress(Exception):  # the decoder raises many kinds of exception on corrupt bytes
        some = (TYPESTORE.deserialize_cdr(data, topic.type) for data in topic.messages[:SEARCHED])
        return any(has_names(message, content.names) for message in some)
    # what is wrong with it is said by whoever reads it
    return True


def _read(directory: Path) -> tuple[dict[str, RawTopic], dict[str, str], int]:
    """Return the topics by absolute name, the custom data and the number of messages that the metadata names."""
    with Reader(directory) as reader:
        for connection in reader.connections:
            if not isinstance(connection.topic, str):
                raise TypeError(f"topic {connection.topic!r} in its metadata.yaml: expected a name")
        topics = {connection.topic: RawTopic(connection.msgtype, [], []) for connection in reader.connections}
        for connection, log_time, data in reader.messages():
            topic = topics[connection.topic]
            topic.log_times.append(log_time)
            topic.messages.append(data)
        return topics, dict(reader.storage.metadata.custom or {}), int(reader.message_count)
