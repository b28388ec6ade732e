# SPDX-License-Identifier: Apache-2.0
"""The time of a run in lockstep, by which its messages are logged: so the clock of a player agrees with stamps."""

from __future__ import annotations

import struct

from fivebar_description.interface import NANOSECONDS, START_STAMP_NS

MOST_APART_NS = 10 * NANOSECONDS
"""Longest time (ns) between the stamp of a sample and the run's time; a message that is further away is another's."""

_STAMP = struct.Struct("<iI")
_STAMP_PLACE = 4


def stamp_in(data: bytes) -> int | None:
    """Return the stamp (ns) of a stamped message in little-endian CDR, None where there is none."""
    if len(data) < _STAMP_PLACE + _STAMP.size or data[1:2] != b"\1":
        return None
    seconds, nanoseconds = _STAMP.unpack_from(data, _STAMP_PLACE)
    return int(seconds) * NANOSECONDS + int(nanoseconds)


class RunTime:
    """The time (ns) of a run: the stamp of its newest measurement.

    A message of a sample is logged at the time of that sample, whenever it arrives, any other at the present time. The
    times of a topic never go back.
    """

    def __init__(self) -> None:
        """Begin at the time of sample 0."""
        self._now = START_STAMP_NS
        self._last: dict[str, int] = {}

    def of(self, topic: str, sample_stamp: int | None, measured: bool) -> int:
        """Return the log time of a message.

        Args:
            topic: its topic.
            sample_stamp: the stamp of the sample that it belongs to, None without one.
            measured: whether it is the measurement of that sample.
        """
        time = self._now
        if sample_stamp is not None and abs(sample_stamp - self._now) <= MOST_APART_NS:
            time = sample_stamp
            if measured:
                self._now = max(self._now, sample_stamp)
        self._last[topic] = max(time, self._last.get(topic, 0))
        return self._last[topic]
