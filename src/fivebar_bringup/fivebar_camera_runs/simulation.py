# SPDX-License-Identifier: Apache-2.0
"""Camera and vision listener of a run without ROS: what the two nodes do, in this process."""

from __future__ import annotations

from fivebar_bringup.scenario import Scenario
from fivebar_camera.camera import Camera
from fivebar_control.estimation.platform_reading import PlatformReading, StampedPosition
from fivebar_description.interface import NANOSECONDS, moment_of_stamp, sample_stamp_ns
from fivebar_sim.plant import Measurement
from fivebar_vision.camera_file import optics_of
from fivebar_vision.comparison import VisionCheck
from fivebar_vision.localisation import PlatformTracker
from fivebar_vision.picture_reading import reading_of


class SimulatedVision:
    """The camera of a scenario, and who reads its pictures."""

    def __init__(self, scenario: Scenario) -> None:
        """Begin a run."""
        self._settings, self._rate_hz = scenario.camera, scenario.rate_hz
        self._camera = Camera(scenario.actual_robot(), self._settings, self._rate_hz, scenario.plant.seed)
        self._tracker = PlatformTracker(self._settings, optics_of(self._settings))
        self._check = VisionCheck(self._rate_hz, scenario.lead_samples)

    def arrived(self, sample: int, truth: Measurement) -> tuple[StampedPosition, ...]:
        """Return what comes with a sample, given the exact joint states at it."""
        positions = []
        for observation in self._camera.take(sample, truth.position, truth.velocity):
            stamp = self._camera.stamp_ns(sample_stamp_ns(observation.sample, self._rate_hz))
            if observation.picture is None:
                spread = self._settings.deviation
                reading = PlatformReading(observation.x, observation.y, spread, spread, 0.0)
            else:
                reading, late = reading_of(self._tracker, self._settings, observation.picture)
                stamp += late
            positions.append(StampedPosition(stamp, moment_of_stamp(stamp, self._rate_hz), reading))
        return tuple(positions)

    def compared(
        self, sample: int, vision: tuple[StampedPosition, ...], x: float, y: float
    ) -> tuple[tuple[int, tuple[float, float]], ...]:
        """Return the stamps (ns) of exposures that can be compared now, and their differences (m).

        `x` and `y` (m) are the platform by the joint states that the sample publishes.
        """
        if not self._settings.pictures:
            return ()
        compared = self._check.joints(sample, x, y)
        for observation in vision:
            compared += self._check.seen(observation.moment, observation.reading)
        period_ns, first = NANOSECONDS // self._rate_hz, sample_stamp_ns(0, self._rate_hz)
        return tuple((first + round(moment * period_ns), difference) for moment, difference in compared)
