# SPDX-License-Identifier: Apache-2.0
"""Crossings of the MOTKIN bench at low rates: what 500 Hz make, 100 Hz do not."""

from __future__ import annotations

from fivebar_bringup.runs.screening import screened
from motkin_rates import WITHIN, base, drawn, peak


def test_a_random_crossing_is_made_at_500_hz_and_neither_accepted_nor_made_at_100_hz() -> None:
    motion = next(iter(drawn(1)))
    keys = {
        "waypoints": [list(point) for point in motion.waypoints],
        "segment_duration": list(motion.durations),
        "time_law": motion.course.time_law,
    }
    quick, slow = (base(**keys, rate_hz=rate_hz) for rate_hz in (500, 100))
    assert screened(quick, quick.plan()).feasible
    assert not screened(slow, slow.plan()).feasible
    assert peak(quick) < 0.5 * WITHIN
    # the drives' gains act, and lessen nothing on an exact robot
    assert peak(quick, gains=True) != peak(quick)
    assert peak(quick, gains=True) < 0.5 * WITHIN
    assert peak(slow) > WITHIN
