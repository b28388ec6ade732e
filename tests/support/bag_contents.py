# SPDX-License-Identifier: Apache-2.0
"""The messages of a topic in a bag, for the comparison of runs to the last bit; and a bag's in a namespace."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rosbags.rosbag2 import Reader

from fivebar_bringup.bag.recording import Recording
from fivebar_bringup.bag.writer import BagWriter
from fivebar_description.interface import Topic

JOINT_STATE_FIELDS = ("position", "velocity", "effort")


def contents(bag: Recording, topic: Topic, fields: Sequence[str] = JOINT_STATE_FIELDS) -> list[tuple[int, bytes]]:
    """Return stamp and values of every message, in order; of a repeated message only the first.

    A plant repeats sample 0 until it is answered, so a run may hold it more than once.
    """
    rows = np.hstack([bag.field(topic, field) for field in fields])
    return list(dict.fromkeys(zip(bag.stamps(topic).tolist(), [row.tobytes() for row in rows], strict=True)))


def copied_into(namespace: str, bag: Path, copy: Path) -> None:
    """Write the messages of a bag into another one as if they had been recorded in a namespace."""
    with Reader(bag) as reader:
        topics = {one.topic: Topic(one.topic.removeprefix("/"), one.msgtype) for one in reader.connections}
        with BagWriter(copy, list(topics.values()), namespace) as writer:
            for connection, log_time, data in reader.messages():
                writer.write(topics[connection.topic], log_time, data)
