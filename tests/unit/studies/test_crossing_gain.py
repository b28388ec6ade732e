# SPDX-License-Identifier: Apache-2.0
"""The parts of a working mode that are joined: one assembly mode each, and with the gates all of them."""

from __future__ import annotations

import math

import pytest

from fivebar_control.planning.limits import MotionLimits
from fivebar_control.planning.postures import place_at
from fivebar_control.planning.roadmap import SPACING, roadmap
from fivebar_description.parameters import FiveBar
from result_pages.crossing_gain import (
    CROSSING_GAIN,
    MODE,
    PAIR,
    ROBOT,
    GainSettings,
    joined_pairs,
    reach,
)


def test_without_crossing_a_part_has_one_assembly_mode(dextar: FiveBar) -> None:
    limits = MotionLimits()
    chart = roadmap(dextar, (1, -1), limits.serial_margin, limits.rest)
    apart, together = chart.regions(False), chart.regions(True)
    for region in apart:
        assert len({place_at(dextar, (1, -1), *point).assembly for point in region}) == 1
    assert set().union(*apart) == set().union(*together)
    assert sum(map(len, apart)) == sum(map(len, together))
    # what two parts share a way between, a way on the map joins
    (whole,) = together
    first, *others = sorted(apart, key=len)
    assert others
    assert chart.way(next(iter(sorted(first))), next(iter(sorted(others[-1])))) is not None
    assert chart.way(min(first), max(others[-1]), frozenset(chart.gates)) is None
    assert reach(together).pairs == 1.0
    assert reach(together).area == 1e4 * SPACING**2 * len(whole)


def test_pairs_are_counted_that_one_part_at_least_holds() -> None:
    a, b, c, d = ((float(index), 0.0) for index in range(4))
    parts = [[frozenset({a, b}), frozenset({c})], [frozenset({b, c}), frozenset({d})]]
    # of 16 ordered pairs: each place with itself, a with b and b with c, either way round
    assert joined_pairs(parts) == 8 / 16
    assert math.isclose(reach(parts[0]).pairs, 5 / 9)


@pytest.mark.extra
def test_a_case_is_a_working_mode_a_robot_or_a_pair() -> None:
    settings = GainSettings(robots=("motkin", "dextar"), pairs=2)
    assert CROSSING_GAIN.cases(settings) == 2 * (4 + 1 + 2)
    mode, whole, pair = (CROSSING_GAIN.run(settings, number)[0] for number in (7, 11, 13))
    assert [(row.robot, row.kind) for row in (mode, whole, pair)] == [
        ("dextar", MODE), ("dextar", ROBOT), ("dextar", PAIR),
    ]  # fmt: skip
    assert (mode.joined_across, mode.largest) == (1.0, 270.0)
    assert whole.joined is not None and mode.joined is not None and mode.joined < whole.joined < 1.0
    assert pair.time_with is not None and (pair.time_without is None or pair.time_with <= pair.time_without)
