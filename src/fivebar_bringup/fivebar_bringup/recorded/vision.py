"""The platform by the camera against that by the joints, and against the exact one, from a bag."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from fivebar_bringup.bag.recording import FloatArray, IntArray, Recording
from fivebar_description.interface import NANOSECONDS, VISION_NAMES, VISION_PLATFORM


class VisionSeries(NamedTuple):
    """Observations of the camera, in order of the exposures.

    Attributes:
        time: [n], of the exposures (s).
        position: [n, 2], x and y by the camera (m), NaN where it saw nothing.
        error: [n, 2], that minus the platform by the joints at the same time (m).
        true_error: [n, 2], that minus the exact platform (m).
    """

    time: FloatArray
    position: FloatArray
    error: FloatArray
    true_error: FloatArray


NOTHING_SEEN = VisionSeries(np.zeros(0), np.zeros((0, 2)), np.zeros((0, 2)), np.zeros((0, 2)))


class PlatformTrack(NamedTuple):
    """A platform's way: samples (whole numbers, rising), and positions at them, [n, 2] (m)."""

    sample: IntArray
    position: FloatArray


NOWHERE = PlatformTrack(np.empty(0, np.int64), np.empty((0, 2)))
"""Nothing is known of the platform."""


def vision_series(recording: Recording, rate_hz: int, joints: PlatformTrack, exact: PlatformTrack) -> VisionSeries:
    """Return what the camera saw, compared with two ways; those of the joints may be an estimate's."""
    if recording.count(VISION_PLATFORM) == 0 or not set(VISION_NAMES) <= set(recording.joint_names(VISION_PLATFORM)):
        return NOTHING_SEEN
    stamps, first = np.unique(recording.stamps(VISION_PLATFORM), return_index=True)
    moments = np.array((stamps - recording.epoch_ns) * (rate_hz / NANOSECONDS), np.float64)
    position = recording.field(VISION_PLATFORM, "position")[first, :2]
    return VisionSeries(moments / rate_hz, position, position - _at(joints, moments), position - _at(exact, moments))


def _at(way: PlatformTrack, moments: FloatArray) -> FloatArray:
    """Return where a way was at some moments, [n, 2], between two samples in a straight line; NaN beyond its ends."""
    if not way.sample.size:
        return np.full((moments.size, 2), math.nan)
    columns = [np.interp(moments, way.sample, way.position[:, axis], math.nan, math.nan) for axis in range(2)]
    return np.column_stack(columns)
