# SPDX-License-Identifier: Apache-2.0
"""The dwell time of the switching: what a zone does to errors, and what the time after it does."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fivebar_control.laws.registry import CONDITION, SUPERVISIONS
from fivebar_control.model.geometry import wrap
from fivebar_control.model.kinematics import state_from_platform
from fivebar_studies.sweep.drawing import draw
from switching_study import LARGE, RIG, SEED, crossing, finite_growth, middle, passed, zone_map


@pytest.mark.extra
def test_errors_fall_over_a_zone_and_the_time_after_it() -> None:
    """Two runs are nearer to each other, in the motors' norm, a dwell time after the zone than before it."""
    scenario = middle(1.0, CONDITION)
    found, plan = zone_map(scenario), scenario.plan()
    assert (found.growth, found.rate) == pytest.approx((1.67, 25.0), abs=5e-3)
    assert found.dwell == pytest.approx(math.log(found.growth) / 25.0)
    c, crossed, robot = 25.0, plan.crossings[0].time, scenario.five_bar()
    begin, end = crossed - plan.zone_time - 1e-3, crossed + plan.zone_time + 1e-3 + found.dwell

    def apart(one: list[float], two: list[float]) -> float:
        first, second = (state_from_platform(robot, plan.mode, *at) for at in (one, two))
        pairs = ((first.leg1, second.leg1), (first.leg2, second.leg2))
        places = [c * wrap(leg.q1 - other.q1) for leg, other in pairs]
        speeds = [leg.dq1 - other.dq1 + place for (leg, other), place in zip(pairs, places, strict=True)]
        return math.hypot(*places, *speeds)

    planned = np.array(plan.path.at(begin)[:4])
    kept = passed(scenario, plan, planned, (begin, end)).tolist()
    random = np.random.default_rng(0)
    for _ in range(6):
        start = planned + 1e-5 * random.normal(size=4) * (1.0, 1.0, 25.0, 25.0)
        ended = passed(scenario, plan, start, (begin, end)).tolist()
        assert apart(ended, kept) < apart(start.tolist(), planned.tolist())


@pytest.mark.extra
def test_every_supervision_needs_less_than_the_time_between_two_zones() -> None:
    for supervision in SUPERVISIONS:
        for duration in (0.5, 1.0, 2.0):
            assert zone_map(middle(duration, supervision)).dwell < 0.03


@pytest.mark.extra
def test_a_random_crossing_lets_errors_grow_more_than_the_middle_one() -> None:
    """Small displacements grow by no more than the norm of the map; one of 2 mm is outside of what it says."""
    scenario = crossing(draw(SEED, 6, RIG), CONDITION)
    found = zone_map(scenario)
    assert found.growth == pytest.approx(18.15, abs=0.01)
    assert found.dwell == pytest.approx(0.116, abs=5e-4)
    assert 1.0 < finite_growth(scenario, 1e-5) < found.growth
    assert finite_growth(scenario, LARGE) == pytest.approx(5.08, abs=0.01)
