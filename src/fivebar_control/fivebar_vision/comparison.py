# SPDX-License-Identifier: Apache-2.0
"""Compares the platform's position seen by the camera with that from the joints, at the time of the exposure."""

from __future__ import annotations

import math

from fivebar_control.estimation.platform_reading import PlatformReading

KEPT = 2.0
"""Time (s) for which positions from the joints are kept, since pictures arrive late."""

Position = tuple[float, float]


class VisionCheck:
    """Compares readings with positions from the joints, in whichever order they arrive."""

    def __init__(self, rate_hz: int, lead_samples: int) -> None:
        """Begin a run; the joints published with sample k are those expected `lead_samples` later."""
        self._kept = math.ceil(KEPT * rate_hz)
        self._lead = lead_samples
        self._platform: dict[int, Position] = {}
        self._newest = -1
        self._waiting: list[tuple[float, PlatformReading]] = []

    def joints(self, sample: int, x: float, y: float) -> list[tuple[float, Position]]:
        """Take the platform's position (m) from the joints of a sample, and return what can be compared now.

        Returns the moment of each exposure, in samples, and the difference of both positions (m).
        """
        moment = sample + self._lead
        self._platform[moment] = (x, y)
        self._newest = max(self._newest, moment)
        self._platform.pop(moment - self._kept, None)
        return self._compared()

    def seen(self, moment: float, reading: PlatformReading) -> list[tuple[float, Position]]:
        """Take a reading at a moment, in samples, and return what can be compared now, as `joints` does."""
        if math.isfinite(reading.x):
            self._waiting.append((moment, reading))
        return self._compared()

    def _compared(self) -> list[tuple[float, Position]]:
        compared = []
        while self._waiting and self._waiting[0][0] <= self._newest:
            moment, reading = self._waiting.pop(0)
            there = self._at(moment)
            if there is not None:
                compared.append((moment, (reading.x - there[0], reading.y - there[1])))
        return compared

    def _at(self, moment: float) -> Position | None:
        """Return the platform's position (m) at a moment, interpolated between samples; None where it is not known."""
        before, part = math.floor(moment), moment - math.floor(moment)
        earlier = self._platform.get(before)
        later = earlier if part == 0.0 else self._platform.get(before + 1)
        if earlier is None or later is None:
            return None
        return earlier[0] + part * (later[0] - earlier[0]), earlier[1] + part * (later[1] - earlier[1])
