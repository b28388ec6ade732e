# SPDX-License-Identifier: Apache-2.0
"""The platform by the camera against that by the joints, and against the exact one, from a bag."""

from __future__ import annotations

import math

import numpy as np

from fivebar_bringup.bag.recording import FloatArray, IntArray, Recording
from fivebar_bringup.recorded.series import NOTHING_SEEN, VisionSeries
from fivebar_description.interface import NANOSECONDS, VISION_NAMES, VISION_PLATFORM

PlatformTrack = tuple[IntArray, FloatArray]
"""A platform's way: samples (whole numbers, rising), and positions at them, [n, 2] (m)."""


def vision_series(
    recording: Recording, rate_hz: int, joints: PlatformTrack, exact: PlatformTrack | None
) -> VisionSeries:
    """Return what the camera saw, compared with two ways; that by the joints may be an estimate's."""
    if recording.count(VISION_PLATFORM) == 0 or not set(VISION_NAMES) <= set(recording.joint_names(VISION_PLATFORM)):
        return NOTHING_SEEN
    stamps, first = np.unique(recording.stamps(VISION_PLATFORM), return_index=True)
    moments = np.array((stamps - recording.epoch_ns(rate_hz)) * (rate_hz / NANOSECONDS), np.float64)
    position = recording.values(VISION_PLATFORM, "position", VISION_NAMES[:2])[first]
    return VisionSeries(moments / rate_hz, position, position - _at(joints, moments), position - _at(exact, moments))


def _at(way: PlatformTrack | None, moments: FloatArray) -> FloatArray:
    """Return where a way was at some moments, [n, 2], between two samples in a straight line; NaN beyond its ends."""
    if way is None or not way[0].size:
        return np.full((moments.size, 2), math.nan)
    sample, position = way
    columns = [np.interp(moments, sample, position[:, axis], math.nan, math.nan) for axis in range(2)]
    return np.column_stack(columns)
