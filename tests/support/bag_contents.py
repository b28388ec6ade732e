"""The messages of a topic in a bag, for the comparison of runs to the last bit."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fivebar_bringup.recorded.bag.recording import Recording
from fivebar_description.interface import Topic

JOINT_STATE_FIELDS = ("position", "velocity", "effort")


def contents(bag: Recording, topic: Topic, fields: Sequence[str] = JOINT_STATE_FIELDS) -> list[tuple[int, bytes]]:
    """Return stamp and values of every message, in order; of a repeated message only the first.

    A plant repeats sample 0 until it is answered, so a run may hold it more than once.
    """
    rows = np.hstack([bag.field(topic, field) for field in fields])
    return list(dict.fromkeys(zip(bag.stamps(topic).tolist(), [row.tobytes() for row in rows], strict=True)))
