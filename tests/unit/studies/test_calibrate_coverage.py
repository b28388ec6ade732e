# SPDX-License-Identifier: Apache-2.0
"""The intervals of a calibration hold the true values about as often as they say, on robots that are more than it."""

from __future__ import annotations

import numpy as np
import pytest

from calibrate_coverage import (
    ANY,
    Calibrated,
    calibrated,
    calibrated_by_hand,
    coverage,
    drawn,
    drawn_of_rig,
    gap_text,
    put_together,
)
from fivebar_control.calibration.closure import GEOMETRY
from fivebar_studies.rigs.named import find_rig

ROBOTS = 8


def test_the_coverage_is_the_share_of_intervals_that_hold() -> None:
    count = len(GEOMETRY)
    good = Calibrated(np.zeros(count + 2), np.ones(count + 2), np.full(2, 0.4))
    bad = good._replace(errors=np.array([0.5, 0.5, 0.5, -2.0, 0.5, 0.5, 0.5, 0.5, 3.0, 1.0]))
    found = coverage([good, bad])
    assert list(found) == [*GEOMETRY, "all", ANY]
    assert (found["l_22"], found["l_11"]) == (0.5, 1.0)
    assert (found["all"], found[ANY]) == (15 / 16, 0.75)


def test_the_elbow_gaps_are_told_before_and_after() -> None:
    count = len(GEOMETRY)
    errors = np.array([*np.zeros(count), 1e-5, -2e-5])
    one = Calibrated(errors, np.full(count + 2, 1.5e-5), np.array([1e-4, -3e-4]))
    other = one._replace(errors=0.5 * errors, gaps_before=np.array([5e-4, 0.0]))
    text = gap_text([one, other])
    assert "before 0.40, 0.50 mm" in text and "after 0.0150, 0.0200 mm" in text
    assert "half width 0.0150 mm; 75.0 % of 4 crossings" in text


@pytest.mark.extra
def test_a_rigid_robot_that_a_hand_leads_is_calibrated_at_its_crossings() -> None:
    scenario = drawn_of_rig(put_together(find_rig("calibrated")), 1, 0)
    for encoders_only, within in ((False, 6e-6), (True, 2.5e-5)):
        found = calibrated_by_hand(scenario, encoders_only)
        assert len(found.gaps_before) == 8 and np.max(np.abs(found.gaps_before)) > 1e-4
        assert np.max(np.abs(found.errors[len(GEOMETRY) :])) < within


@pytest.mark.extra
def test_intervals_hold_the_truth_of_robots_that_are_more_than_the_model() -> None:
    """Few robots: all of their crossings, and nine of ten parameters, of which those of a robot err together."""
    robots = [calibrated(drawn(1, number)) for number in range(ROBOTS)]
    found = coverage(robots)
    assert found[ANY] >= 0.95
    assert found["all"] >= 0.85
    # and the intervals say something: they are narrower than what was known before, 0.34 mm and 3.9 mrad
    widths = np.array([one.half_widths[: len(GEOMETRY)] for one in robots])
    assert np.all(np.median(widths, axis=0) < [2.5e-4, 2.5e-4, 2.5e-4, 2.5e-4, 3e-4, 3e-4, 1.5e-3, 1.5e-3])
    assert max(float(np.max(one.half_widths[len(GEOMETRY) :])) for one in robots) < 3e-5
