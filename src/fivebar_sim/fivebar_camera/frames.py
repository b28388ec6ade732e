# SPDX-License-Identifier: Apache-2.0
"""When the camera exposes, and when its pictures arrive: late by the latency and a jitter, some never."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from fivebar_description.camera import CameraSettings

STREAM = 8
"""Random stream of the pictures' delays, losses and errors."""


class Frame(NamedTuple):
    """Exposure and arrival of a picture.

    Attributes:
        number: its number.
        sample: that of the middle of its exposure; its stamp is that of this sample, by the camera's clock.
        arrival: sample with which the picture arrives, -1 where it is lost.
        noise_x, noise_y: error of a position that is simulated without a picture, in its standard deviations.
    """

    number: int
    sample: int
    arrival: int
    noise_x: float
    noise_y: float


def frame_of(settings: CameraSettings, rate_hz: int, seed: int, sample: int) -> Frame | None:
    """Return the picture that is exposed at a sample, None where there is none.

    The picture of sample 0 arrives with that sample: the robot rests before, and the run waits for the picture.
    """
    number, rest = divmod(sample, settings.every(rate_hz))
    if rest:
        return None
    late, lost = np.random.default_rng([seed, STREAM, number]).random(2)
    noise_x, noise_y = np.random.default_rng([seed, STREAM + 1, number]).standard_normal(2)
    delay = settings.latency + settings.jitter * float(late)
    arrival = sample + max(1, math.ceil(delay * rate_hz - 1e-9))
    if number == 0:
        arrival = 0
    elif lost < settings.dropped:
        arrival = -1
    return Frame(number, sample, arrival, float(noise_x), float(noise_y))


class FrameSchedule:
    """The pictures of a run; call `exposed` once for every sample, in their order."""

    def __init__(self, settings: CameraSettings, rate_hz: int, seed: int) -> None:
        """Begin before sample 0; the seed is that of latency and losses."""
        self._settings, self._rate_hz, self._seed = settings, rate_hz, seed
        self._under_way: list[Frame] = []

    def exposed(self, sample: int) -> Frame | None:
        """Return the picture of a sample, None where there is none or where it is lost."""
        frame = frame_of(self._settings, self._rate_hz, self._seed, sample)
        if frame is None or frame.arrival < 0:
            return None
        self._under_way.append(frame)
        return frame

    def arrived(self, sample: int) -> list[Frame]:
        """Return the pictures that have arrived by a sample and were not returned before, by arrival."""
        come = [frame for frame in self._under_way if frame.arrival <= sample]
        self._under_way = [frame for frame in self._under_way if frame.arrival > sample]
        return sorted(come, key=lambda frame: (frame.arrival, frame.number))
