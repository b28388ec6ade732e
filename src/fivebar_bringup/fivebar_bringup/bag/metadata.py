# SPDX-License-Identifier: Apache-2.0
"""The text of a bag's `metadata.yaml`: rosbag2 metadata version 9, with the keys in Jazzy's order.

It is formatted by hand because it is rewritten at every checkpoint of a running recording, where a YAML library would
take several milliseconds.
"""

from __future__ import annotations

import json
import textwrap
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from fivebar_bringup.bag.definitions import absolute_name, qos_profiles, type_hash
from fivebar_description.interface import Topic

NO_START_NS = 2**63 - 1
"""Starting time of a bag without messages, as rosbag2 writes it."""


class Span(NamedTuple):
    """First and last log time of a bag in nanoseconds."""

    first_ns: int = NO_START_NS
    last_ns: int = 0

    def with_message(self, log_time_ns: int) -> Span:
        """Return the span extended to this log time."""
        return Span(min(self.first_ns, log_time_ns), max(self.last_ns, log_time_ns))

    @property
    def duration_ns(self) -> int:
        """Time from the first to the last message; 0 without messages."""
        return max(0, self.last_ns - self.first_ns)


def topic_metadata(topic: Topic, namespace: str) -> str:
    """Return the constant part of a topic's entry, one `topic_metadata` mapping."""
    return f"""\
topic_metadata:
  name: {absolute_name(topic, namespace)}
  type: {topic.type}
  serialization_format: cdr
  offered_qos_profiles:
{textwrap.indent(qos_profiles(topic.qos), "    ")}\
  type_description_hash: {type_hash(topic.type)}
"""


def bag_information(
    file_name: str,
    topics: Sequence[str],
    counts: Sequence[int],
    span: Span,
    custom_data: Mapping[str, str],
) -> str:
    """Return the bag's metadata without its outer key, the form stored inside the MCAP file.

    `topics` are the texts from :func:`topic_metadata`, `counts` the messages of each.
    """
    total = sum(counts)
    path = _quoted(file_name)
    entries = "".join(
        textwrap.indent(f"{topic}message_count: {count}\n", "    ").replace("    ", "  - ", 1)
        for topic, count in zip(topics, counts, strict=True)
    )
    custom = "".join(f"\n  {_quoted(key)}: {_quoted(value)}" for key, value in custom_data.items()) or " {}"
    return f"""\
version: 9
storage_identifier: mcap
duration:
  nanoseconds: {span.duration_ns}
starting_time:
  nanoseconds_since_epoch: {span.first_ns}
message_count: {total}
topics_with_message_count:{" []" if not entries else ""}
{entries}\
compression_format: ""
compression_mode: ""
relative_file_paths:
  - {path}
files:
  - path: {path}
    starting_time:
      nanoseconds_since_epoch: {span.first_ns}
    duration:
      nanoseconds: {span.duration_ns}
    message_count: {total}
custom_data:{custom}
ros_distro: jazzy
"""


def metadata_yaml(information: str) -> str:
    """Return the content of `metadata.yaml` from the text of :func:`bag_information`."""
    return "rosbag2_bagfile_information:\n" + textwrap.indent(information, "  ")


def _quoted(text: str) -> str:
    # a JSON string is also a YAML string, and quotes values such as "0", "no" or "a: b" safely
    return json.dumps(text, ensure_ascii=False)
