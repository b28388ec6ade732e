# SPDX-License-Identifier: Apache-2.0
"""Payloads in a bag: what the platform carried, from when on."""

from __future__ import annotations

from typing import NamedTuple

from fivebar_bringup.bag.recording import Recording
from fivebar_description.interface import PAYLOAD
from fivebar_description.parameters import MOST_PAYLOAD


class RecordedPayload(NamedTuple):
    """A payload (kg) in all, and when its message was recorded (ns)."""

    log_time_ns: int
    mass: float


def recorded_payloads(recording: Recording) -> list[RecordedPayload]:
    """Return the payloads of a bag in the order of their messages, without those that every node drops.

    Raises:
        BagError: they cannot be read.
    """
    if not recording.count(PAYLOAD):
        return []
    masses = recording.field(PAYLOAD, "data").tolist()
    payloads = map(RecordedPayload, recording.log_times(PAYLOAD).tolist(), masses)
    return [payload for payload in payloads if 0.0 <= payload.mass <= MOST_PAYLOAD]
