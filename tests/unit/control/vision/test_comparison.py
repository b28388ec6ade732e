# SPDX-License-Identifier: Apache-2.0
"""The comparison of camera and joints joins both at the time of the exposure."""

from __future__ import annotations

import pytest

from fivebar_control.estimation.platform_reading import PlatformReading
from fivebar_vision.comparison import VisionCheck
from fivebar_vision.picture_reading import NOT_SEEN


def reading(x: float) -> PlatformReading:
    return PlatformReading(x, 0.1, 1e-5, 1e-5, 0.0)


@pytest.mark.parametrize("lead", [0, 2])
def test_a_late_picture_meets_the_joints_of_its_exposure(lead: int) -> None:
    check = VisionCheck(500, lead)
    for sample in range(50):
        assert not check.joints(sample, 1e-3 * (sample + lead), 0.1)
    ((moment, difference),) = check.seen(20.0, reading(0.021))
    assert moment == 20.0
    assert difference == pytest.approx((1e-3, 0.0))


def test_a_picture_waits_for_the_joints_and_lies_between_samples() -> None:
    check = VisionCheck(500, 0)
    assert not check.seen(1.25, reading(1.25e-3))
    assert not check.joints(0, 0.0, 0.1)
    assert not check.joints(1, 1e-3, 0.1)
    ((_, difference),) = check.joints(2, 2e-3, 0.1)
    assert difference == pytest.approx((0.0, 0.0), abs=1e-15)


def test_what_was_not_seen_is_not_compared() -> None:
    check = VisionCheck(500, 0)
    check.joints(0, 0.0, 0.0)
    assert not check.seen(0.0, NOT_SEEN)
