# SPDX-License-Identifier: Apache-2.0
"""When the faults of a run came."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fivebar_bringup.bag.recording import Recording
from fivebar_bringup.recorded.series import RunSeries
from fivebar_description.interface import FAULTS


class FaultMark(NamedTuple):
    """When a fault was recorded (s) and its text."""

    time: float
    text: str


def fault_marks(recording: Recording, series: RunSeries) -> list[FaultMark]:
    """Return the recorded faults, each at the last sample that was recorded before it."""
    if not recording.count(FAULTS) or not series.sample.size:
        return []
    rows = np.searchsorted(series.log_time_ns, recording.log_times(FAULTS), side="right") - 1
    times = series.time[np.maximum(rows, 0)].tolist()
    return [FaultMark(*mark) for mark in zip(times, recording.texts(FAULTS), strict=True)]
