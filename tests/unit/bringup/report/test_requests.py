# SPDX-License-Identifier: Apache-2.0
"""The plan of a run with requests, as its statuses tell it: motions that pause and go on, and splines."""

from __future__ import annotations

import json
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from engine_agreement import changed

from fivebar_bringup.bag.recording import Recording
from fivebar_bringup.errors import BagError
from fivebar_bringup.report.requests import plan_with_requests
from fivebar_control.planning.plan_along import plan_along
from fivebar_control.planning.timed_points import digest_of
from fivebar_control.planning.trajectory_messages import points_of
from fivebar_control.trajectory.path import Path
from fivebar_control.trajectory.spline import SplineSegment, completed
from fivebar_control.trajectory.stopped import ResumedSegment, StoppedSegment
from fivebar_description.interface import GOAL_STATUS, GOAL_TRAJECTORY
from fivebar_description.status_texts import read_goal_status

SCENARIO = changed("middle", {}, controller="unified", segment_duration=1.0, waypoints=[[0.0, 0.15], [0.0, 0.02]])
RATE = SCENARIO.rate_hz


def recorded(*statuses: dict[str, Any], trajectories: tuple[Any, ...] = ()) -> Recording:
    texts = [read_goal_status(json.dumps(status)) for status in statuses]
    return cast(
        Recording,
        SimpleNamespace(
            path="bag",
            count=lambda topic: len(texts) if topic == GOAL_STATUS else 0,
            read_texts=lambda topic, read, needed: texts,
            samples=lambda topic, rate: np.arange(4 * RATE),
            messages=lambda topic: trajectories if topic == GOAL_TRAJECTORY else (),
        ),
    )


def test_a_motion_that_pauses_crosses_later() -> None:
    plan = SCENARIO.plan()
    (crossing,) = plan.crossings
    pausing = {"state": "pausing", "first_sample": 100, "last_sample": 150, "slowing_s": 0.1}
    resumed = {"state": "resumed", "first_sample": 700, "last_sample": 1200, "path_time_s": 0.25, "rising_s": 0.1}
    found = plan_with_requests(recorded(pausing, resumed), SCENARIO)
    (later,) = found.crossings
    # 0.2 + 0.1 s until it rests, at 0.25 s of the path; from 1.4 s on it goes on, 0.05 s late
    assert later.time == pytest.approx(1.4 + crossing.time - 0.25 + 0.05)
    assert found.path.at(later.time)[:2] == pytest.approx((crossing.x, crossing.y), abs=1e-9)
    assert later.segment == 1
    stop, rest = StoppedSegment(plan.path, 0.2, 0.1), ResumedSegment(plan.path, 0.25, 0.1)
    for t in (0.1, 0.25, 0.3, 1.0):
        assert found.path.at(t) == stop.at(t)
    for t in (0.05, 0.3, 1.0):
        assert found.path.at(1.4 + t) == pytest.approx(rest.at(t), abs=1e-9)
    assert plan_with_requests(recorded({**pausing, "state": "stopping"}), SCENARIO).crossings == ()


def test_a_trajectory_is_that_of_its_knots() -> None:
    plan, zero = SCENARIO.plan(), (0.0, 0.0)
    end = (plan.path.at(9.0).x, plan.path.at(9.0).y)
    knots = completed([0.0, 0.7, 1.0], [end, (0.02, 0.05), (0.0, 0.15)], [zero, None, zero], [zero, None, zero])
    moving = {"state": "moving", "first_sample": 600, "last_sample": 1100, "waypoints": [end, (0.0, 0.15)]}
    told = {**moving, "durations_s": [1.0], "knots": list(knots), "assembly_mode": 0}
    found = plan_with_requests(recorded(told), SCENARIO)
    spline = Path([SplineSegment(knots, SCENARIO.five_bar(), 0)])
    wanted = plan_along(SCENARIO.five_bar(), spline, SCENARIO.working_mode, RATE)
    assert [one.time for one in found.crossings[1:]] == pytest.approx([one.time + 1.2 for one in wanted.crossings])
    assert wanted.crossings
    assert found.path.at(1.8) == pytest.approx(spline.at(0.6), abs=1e-12)


def message(*points: tuple[float, tuple[float, float]]) -> Any:
    """Return a JointTrajectory as a bag has it."""
    stamp, empty = SimpleNamespace(sec=0, nanosec=0), np.array([])
    return SimpleNamespace(
        header=SimpleNamespace(frame_id="request/1", stamp=stamp),
        joint_names=["x", "y"],
        points=[
            SimpleNamespace(
                positions=np.array(place),
                velocities=empty,
                accelerations=empty,
                effort=empty,
                time_from_start=SimpleNamespace(sec=int(t), nanosec=round(t % 1.0 * 1e9)),
            )
            for t, place in points
        ],
    )


def test_a_trajectory_is_found_among_those_recorded() -> None:
    plan = SCENARIO.plan()
    end = (plan.path.at(9.0).x, plan.path.at(9.0).y)
    followed, other = message((0.7, (0.02, 0.05)), (1.0, (0.0, 0.15))), message((1.0, (0.0, 0.15)))
    wanted = points_of(followed, "base_link")
    moving = {"state": "moving", "first_sample": 600, "last_sample": 1100, "waypoints": [end, (0.0, 0.15)]}
    status = {**moving, "durations_s": [1.0], "trajectory": digest_of(wanted)}
    found = plan_with_requests(recorded(status, trajectories=(other, followed, other)), SCENARIO)
    assert found.path.at(1.2 + 0.7)[:2] == pytest.approx((0.02, 0.05), abs=1e-12)
    assert len(found.crossings) > len(plan.crossings)
    with pytest.raises(BagError, match="goal/status"):
        plan_with_requests(recorded(status, trajectories=(other,)), SCENARIO)
