# SPDX-License-Identifier: Apache-2.0
"""Writes a rosbag2 directory from serialized messages such that the recording survives a killed writer.

Why not rosbag2's own recorder, or the writer of rosbags: both leave an MCAP file without summary and footer, and no
metadata.yaml, until they are closed. After a SIGKILL such a bag has to be repaired or reindexed before anything reads
it. This writer's bag is complete and indexed after every checkpoint: a bag must be readable right after SIGKILL,
without any repair. The `mcap` library produces the format; `tail` describes how the file grows.
"""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from types import TracebackType

from mcap.writer import CompressionType, Writer

from fivebar_bringup.bag.definitions import absolute_name, message_definition, qos_profiles, type_hash
from fivebar_bringup.bag.metadata import Span, bag_information, metadata_yaml, topic_metadata
from fivebar_bringup.bag.tail import TailFile, TailStream
from fivebar_description.files import replace_file
from fivebar_description.interface import Topic

RECORDING_RECORD = "fivebar_recording"
"""Name of the MCAP metadata record that holds the custom data (besides `custom_data` in metadata.yaml)."""


class BagWriter:
    """A bag being recorded: `<directory>/metadata.yaml` and `<directory>/<name>_0.mcap`.

    Messages are buffered in memory until :meth:`checkpoint`, which is meant to be called about once a second. From then
    on they survive the death of the process, and the directory is a complete, indexed bag at every instant (while the
    two files are being updated, metadata.yaml can count fewer messages than the MCAP file holds).

    An OSError from :meth:`checkpoint` (full disk, file too large) leaves the bag as of the last checkpoint. The
    messages since then stay in memory, and the next checkpoint tries them again.

    Not thread-safe.
    """

    def __init__(self, directory: Path, topics: Sequence[Topic], namespace: str = "") -> None:
        """Create the directory and an empty bag in it.

        Topic names are made absolute in `namespace`. Raises FileExistsError for an existing directory, OSError if it
        cannot be made, KeyError for a message type unknown to ROS 2 Jazzy, ValueError for a duplicate topic.
        """
        self._topics = [topic_metadata(topic, namespace) for topic in topics]
        names = [topic.name for topic in topics]
        if len(set(names)) != len(names):
            raise ValueError(f"a topic occurs twice: {', '.join(names)}")
        self._stream = TailStream()
        self._mcap = Writer(self._stream, compression=CompressionType.ZSTD, use_summary_offsets=False)
        self._mcap.start(profile="ros2", library="fivebar")
        self._channels = _register(self._mcap, topics, namespace)
        self._counts = dict.fromkeys(self._channels.values(), 0)
        self._span = Span()
        self._unsaved = True
        self._closed = False
        self._custom_data: dict[str, str] = {}

        directory.mkdir(parents=True)
        self._metadata = directory / "metadata.yaml"
        self._file_name = f"{directory.name}_0.mcap"
        self._file = TailFile(directory / self._file_name)
        try:
            self._save()
        except BaseException:
            self._file.close()
            with suppress(OSError):
                shutil.rmtree(directory)
            raise

    @property
    def message_count(self) -> int:
        """Messages written so far, including buffered ones."""
        return sum(self._counts.values())

    def write(self, topic: Topic, log_time_ns: int, data: bytes, publish_time_ns: int | None = None) -> None:
        """Add one message in CDR, as a raw subscription delivers it; `publish_time_ns` defaults to the log time.

        Raises KeyError for a topic that the bag does not have and ValueError if the bag is closed.
        """
        if self._closed:
            raise ValueError("the bag is closed")
        channel = self._channels[topic.name]
        self._mcap.add_message(channel, log_time_ns, data, log_time_ns if publish_time_ns is None else publish_time_ns)
        self._counts[channel] += 1
        self._span = self._span.with_message(log_time_ns)
        self._unsaved = True

    def checkpoint(self) -> None:
        """Save everything written so far; does nothing without new messages. Raises OSError, see the class."""
        if self._closed:
            raise ValueError("the bag is closed")
        if self._unsaved:
            self._save()

    def close(self, custom_data: Mapping[str, str]) -> None:
        """Add `custom_data` (e.g. the number of dropped messages) to the bag, save it and release the file.

        Raises OSError like :meth:`checkpoint`; the bag is closed all the same. Does nothing if already closed.
        """
        if self._closed:
            return
        self._closed = True
        self._custom_data = dict(custom_data)
        try:
            self._mcap.flush()  # type: ignore[no-untyped-call]
            self._mcap.add_metadata(RECORDING_RECORD, self._custom_data)
            self._mcap.add_metadata("rosbag2", {"serialized_metadata": self._information()})
            self._save()
        finally:
            self._file.close()

    def __enter__(self) -> BagWriter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close without custom data where :meth:`close` was not called; an error on the way out keeps its place."""
        if error is None:
            self.close({})
            return
        with suppress(OSError):
            self.close({})

    def _information(self) -> str:
        return bag_information(
            self._file_name, self._topics, list(self._counts.values()), self._span, self._custom_data
        )

    def _save(self) -> None:
        """Bring the MCAP file, then metadata.yaml up to date."""
        stream = self._stream
        self._mcap.flush()  # type: ignore[no-untyped-call]
        data_end = stream.tell()
        self._mcap.finish()  # type: ignore[no-untyped-call]
        block = stream.getvalue()
        stream.cut(data_end)  # the index is made anew each time; only the data stays, until it is on the disk
        if stream.base == 0:
            self._file.replace(block, data_end)
        else:
            self._file.extend(stream.base, block, data_end)
        if self.message_count:  # until then the stream holds the file from its first byte, as `replace` needs it
            stream.release()
        replace_file(self._metadata, metadata_yaml(self._information()).encode())
        self._unsaved = False


def _register(mcap: Writer, topics: Sequence[Topic], namespace: str) -> dict[str, int]:
    """Declare schemas and channels; return the channel of each topic, by its relative name."""
    schemas = {
        kind: mcap.register_schema(kind, "ros2msg", message_definition(kind).encode())
        for kind in dict.fromkeys(topic.type for topic in topics)
    }
    return {
        topic.name: mcap.register_channel(
            absolute_name(topic, namespace),
            "cdr",
            schemas[topic.type],
            {"offered_qos_profiles": qos_profiles(topic.qos), "topic_type_hash": type_hash(topic.type)},
        )
        for topic in topics
    }
