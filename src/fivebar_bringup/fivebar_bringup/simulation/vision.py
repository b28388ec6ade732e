"""Camera and vision listener of a run without ROS: what the two nodes do, in this process."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from fivebar_control.vision.comparison import VisionCheck
from fivebar_control.vision.reading import PlatformReading, simulated_reading
from fivebar_description.interface import NANOSECONDS, moment_of_stamp, sample_stamp_ns
from fivebar_sim.plant import Measurement

if TYPE_CHECKING:
    from fivebar_bringup.scenario import Scenario


class VisionSample(NamedTuple):
    """A position by the camera: its stamp (ns), the moment of that in samples, and what was seen."""

    stamp: int
    moment: float
    reading: PlatformReading


class SimulatedVision:
    """The camera of a scenario, and who reads its pictures."""

    def __init__(self, scenario: Scenario) -> None:
        """Begin a run."""
        # OpenCV takes a fifth of a second to load, which a run without a camera need not
        from fivebar_control.vision.camera_file import optics_of
        from fivebar_control.vision.localisation import PlatformTracker
        from fivebar_sim.vision.camera import Camera

        self._settings, self._rate_hz = scenario.camera, scenario.rate_hz
        self._camera = Camera(scenario.actual_robot(), self._settings, self._rate_hz, scenario.plant.seed)
        self._tracker = PlatformTracker(self._settings, optics_of(self._settings))
        self._check = VisionCheck(self._rate_hz, scenario.lead_samples)

    def arrived(self, sample: int, truth: Measurement) -> tuple[VisionSample, ...]:
        """Return what comes with a sample, given the exact joint states at it."""
        from fivebar_control.vision.sight import reading_of

        found = []
        for one in self._camera.take(sample, truth.position, truth.velocity):
            stamp = self._camera.stamp_ns(sample_stamp_ns(one.sample, self._rate_hz))
            if one.picture is None:
                reading = simulated_reading(self._settings, one.x, one.y)
            else:
                reading, late = reading_of(self._tracker, self._settings, one.picture)
                stamp += late
            found.append(VisionSample(stamp, moment_of_stamp(stamp, self._rate_hz), reading))
        return tuple(found)

    def compared(
        self, sample: int, vision: tuple[VisionSample, ...], x: float, y: float
    ) -> tuple[tuple[int, tuple[float, float]], ...]:
        """Return the stamps (ns) of exposures that can be compared now, and their differences (m).

        `x` and `y` (m) are the platform by the joint states that the sample publishes.
        """
        if not self._settings.pictures:
            return ()
        compared = self._check.joints(sample, x, y)
        for one in vision:
            compared += self._check.seen(one.moment, one.reading)
        period_ns, first = NANOSECONDS // self._rate_hz, sample_stamp_ns(0, self._rate_hz)
        return tuple((first + round(moment * period_ns), difference) for moment, difference in compared)
