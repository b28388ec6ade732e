# SPDX-License-Identifier: Apache-2.0
"""In lockstep, holds a sample back until the camera's positions that arrive with it are there."""

from __future__ import annotations

from fivebar_camera.frames import FrameSchedule
from fivebar_description.camera import CameraSettings


class Sights:
    """Counts the positions that a sample waits for, and those that have arrived, by their stamps.

    Image processing takes wall time but no simulated time: a sample with which pictures arrive is published once their
    positions are there.
    """

    def __init__(self, settings: CameraSettings, rate_hz: int, seed: int) -> None:
        """Begin before sample 0 of a run."""
        self._schedule = FrameSchedule(settings, rate_hz, seed)
        self._sample = -1
        self._arrived = 0
        self._stamps: list[int] = []
        self._taken = 0
        self._given = -1
        self._latest: list[int] = []

    @property
    def complete(self) -> bool:
        """Whether all positions are there that come with the samples so far."""
        return len(self._stamps) >= self._arrived

    def expect(self, sample: int) -> None:
        """Begin a sample; beginning the same sample again adds nothing to wait for."""
        if sample > self._sample:
            self._sample = sample
            self._schedule.exposed(sample)
            self._arrived += len(self._schedule.arrived(sample))

    def note(self, stamp_ns: int) -> None:
        """Take a position by its stamp (ns)."""
        if stamp_ns not in self._stamps[-64:]:
            self._stamps.append(stamp_ns)

    def taken(self, sample: int) -> list[int]:
        """Return the stamps (ns) of the positions that come with the present sample, the same when called again."""
        if self._taken < self._arrived:
            self._latest = self._stamps[self._taken : self._arrived]
            self._taken, self._given = self._arrived, sample
        return self._latest if self._latest and self._given == sample else []
