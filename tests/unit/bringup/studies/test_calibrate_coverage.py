"""The intervals of a calibration hold the true values about as often as they say, on robots that are more than it."""

from __future__ import annotations

import numpy as np
import pytest

from fivebar_bringup.studies.single.calibrate_coverage import ANY, Calibrated, calibrated, coverage
from fivebar_control.calibration.closure import GEOMETRY

ROBOTS = 8


def test_the_coverage_is_the_share_of_intervals_that_hold() -> None:
    count = len(GEOMETRY)
    good = Calibrated(np.zeros(count + 2), np.ones(count + 2))
    bad = good._replace(errors=np.array([0.5, 0.5, 0.5, -2.0, 0.5, 0.5, 0.5, 0.5, 3.0, 1.0]))
    found = coverage([good, bad])
    assert list(found) == [*GEOMETRY, "all", ANY]
    assert (found["l_22"], found["l_11"]) == (0.5, 1.0)
    assert (found["all"], found[ANY]) == (15 / 16, 0.75)


@pytest.mark.extra
def test_intervals_hold_the_truth_of_robots_that_are_more_than_the_model() -> None:
    """Few robots: all of their crossings, and nine of ten parameters, of which those of a robot err together."""
    robots = [calibrated(1, number) for number in range(ROBOTS)]
    found = coverage(robots)
    assert found[ANY] >= 0.95
    assert found["all"] >= 0.85
    # and the intervals say something: they are narrower than what was known before, 0.34 mm and 3.9 mrad
    widths = np.array([one.half_widths[: len(GEOMETRY)] for one in robots])
    assert np.all(np.median(widths, axis=0) < [2.5e-4, 2.5e-4, 2.5e-4, 2.5e-4, 3e-4, 3e-4, 1.5e-3, 1.5e-3])
    assert max(float(np.max(one.half_widths[len(GEOMETRY) :])) for one in robots) < 3e-5
