# SPDX-License-Identifier: Apache-2.0
"""Stops of a motion under way: where they are feasible, the same reference up to then, and at rest at the end."""

from __future__ import annotations

import math

import pytest

from fivebar_control.model.kinematics import state_from_platform
from fivebar_control.model.singularity import inverse_condition
from fivebar_control.planning.limits import MotionLimits
from fivebar_control.planning.order_planning import plan_once
from fivebar_control.planning.orders import Conditions, StopRequest
from fivebar_control.trajectory.path import Path
from fivebar_control.trajectory.stopped import StoppedSegment
from fivebar_description.robot_file import load_robot

PATH = Path.through([(0.0, 0.15), (0.0, 0.02)], [1.0])
"""On the locus after 0.5 s."""

CONDITIONS = Conditions("dextar", 500, 2.0, 15.0)


def stop_from(earliest: float) -> StoppedSegment | str:
    planned = plan_once(CONDITIONS, StopRequest(PATH.segments, (1, -1), earliest))
    return planned.refused if planned.stop is None else planned.stop.stop


def test_a_motion_stops_at_once_where_it_can() -> None:
    stop = stop_from(0.3)
    assert isinstance(stop, StoppedSegment)
    assert stop.begin == 0.3
    assert all(stop.at(t) == PATH.at(t) for t in (0.0, 0.1, 0.3))
    place = stop.at(stop.duration)
    assert (place.vx, place.vy, place.ax, place.ay) == (0.0, 0.0, 0.0, 0.0)
    assert stop.at(stop.duration + 1.0) == place
    # speed and acceleration are the derivatives of the place, without a step where it begins to slow down
    step = 1e-5
    for t in (0.3, 0.32, 0.35, 0.39):
        before, here, after = (stop.at(t + shift) for shift in (-step, 0.0, step))
        assert here.vy == pytest.approx((after.y - before.y) / (2.0 * step), abs=1e-6)
        assert here.ay == pytest.approx((after.vy - before.vy) / (2.0 * step), abs=1e-2)


@pytest.mark.parametrize("earliest", [0.44, 0.48, 0.5])
def test_a_stop_near_the_locus_is_put_off(earliest: float) -> None:
    stop = stop_from(earliest)
    assert isinstance(stop, StoppedSegment)
    assert stop.begin > 0.5
    for number in range(20):
        place = stop.at(stop.begin + stop.slowing * number / 19)
        kappa = inverse_condition(state_from_platform(load_robot("dextar"), (1, -1), place.x, place.y, 0.0, 0.0))
        assert kappa >= MotionLimits().rest


@pytest.mark.parametrize("earliest", [0.15, 0.36, 0.55])
def test_a_pause_goes_on_along_the_same_path(earliest: float) -> None:
    """Where it could not gather speed before the locus it is put off until the platform is past it."""
    request = StopRequest(PATH.segments, (1, -1), earliest, pauses=True)
    found = plan_once(CONDITIONS, request).stop
    assert found is not None
    assert found.resumed is not None
    stop, resumed = found
    here, there = stop.at(stop.duration), resumed.at(0.0)
    assert (here.x, here.y) == pytest.approx((there.x, there.y), abs=1e-12)
    assert (there.vx, there.vy, there.ax, there.ay) == (0.0, 0.0, 0.0, 0.0)
    assert resumed.at(resumed.duration) == pytest.approx(PATH.at(1.0), abs=1e-12)
    # at the locus it is as quick as planned, since only then it meets the dynamic criterion
    for t in (resumed.rising, resumed.rising + 0.1, resumed.duration - 0.02):
        assert resumed.at(t) == pytest.approx(PATH.at(resumed.begin + t - 0.5 * resumed.rising), abs=1e-12)
    assert resumed.begin > 0.5 or resumed.begin + 0.5 * resumed.rising < 0.5
    step = 1e-5
    for share in (0.2, 0.5, 0.8):
        t = share * resumed.rising
        before, here, after = (resumed.at(t + shift) for shift in (-step, 0.0, step))
        assert here.vy == pytest.approx((after.y - before.y) / (2.0 * step), abs=1e-6)
        assert here.ay == pytest.approx((after.vy - before.vy) / (2.0 * step), abs=1e-2)


def test_a_motion_that_ends_before_it_could_stop_goes_on() -> None:
    assert "goes on to its end" in str(stop_from(0.97))
    assert "goes on to its end" in str(stop_from(math.inf))
