# SPDX-License-Identifier: Apache-2.0
"""Requests of a running graph are planned by their odds, as far as the run's file and the time allow."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from fivebar_bringup.motions import planner_with_odds
from fivebar_bringup.motions.planner_with_odds import PlannerWithOdds, planner_of
from fivebar_bringup.odds import alternatives
from fivebar_bringup.odds.trials import ROBOTS, trials_of
from fivebar_bringup.scenario import Scenario
from fivebar_control.planning.alternative_courses import chart_for
from fivebar_control.planning.order_planning import task_of
from fivebar_control.planning.orders import Conditions, PlanningRequest
from fivebar_control.planning.roadmap import roadmap_of_geometry
from fivebar_control.scenario.goal_conditions import conditions_of

HOME, BEYOND = (0.0, 0.15), (0.0, 0.02)


def scenario(**changes: object) -> Scenario:
    content = {
        "name": "stand",
        "controller": "unified",
        "waypoints": (HOME, (0.0, 0.14)),
        "segment_duration": 0.2,
        "plant": {"torque_limit": 2.0},
        "loads": {"tilt": 0.02, "push": 2.0, "push_length": 0.05, "passive": 0.005},
    }
    return Scenario.model_validate(content | changes)


def crossing(duration: float = 0.0, payload: float = 0.0) -> PlanningRequest:
    return PlanningRequest(HOME, (1, -1), BEYOND, -1, duration, payload=payload)


@pytest.fixture(scope="module")
def orders() -> PlannerWithOdds:
    return PlannerWithOdds(scenario(), conditions_of(scenario()))


@pytest.mark.extra
def test_a_request_is_made_in_a_likely_duration_and_one_that_is_given_is_kept(orders: PlannerWithOdds) -> None:
    chosen, kept = orders.plan(crossing()), orders.plan(crossing(2.0))
    assert not chosen.refused
    assert chosen.odds is not None and kept.odds is not None
    assert chosen.odds["robots"] == ROBOTS
    assert chosen.odds["share"] >= 0.9 > kept.odds["share"]
    assert kept.durations == (2.0,)
    assert kept.odds["better"]["duration_s"] < 2.0
    assert kept.odds["better"]["share"] > kept.odds["share"]
    # the same request is not planned again
    assert orders.plan(crossing(2.0)) is kept


@pytest.mark.extra
def test_all_moves_succeed_on_no_more_robots_than_the_least_likely_one(orders: PlannerWithOdds) -> None:
    slow, quick = (orders.together([one]) for one in (crossing(2.0), crossing(0.5)))
    both = orders.together([crossing(2.0), crossing(0.5), crossing(2.0)])
    assert max(0, slow.successes + quick.successes - ROBOTS) <= both.successes <= min(slow.successes, quick.successes)
    assert slow.successes < quick.successes


@pytest.mark.extra
def test_a_payload_rides_on_the_robots(orders: PlannerWithOdds) -> None:
    robot = scenario().carrying(0.3).five_bar()
    assert robot.mass == scenario().five_bar().mass + 0.3
    # a push moves a heavy platform less
    laden, bare = orders.plan(crossing(2.0, payload=3.0)).odds, orders.plan(crossing(2.0)).odds
    assert laden is not None and bare is not None
    assert laden["successes"] > bare["successes"]


def test_without_the_time_the_screen_decides_and_the_odds_are_not_known() -> None:
    calm = scenario(loads={"push": 0.2})
    planned = PlannerWithOdds(calm, conditions_of(calm), odds_time=0.0).plan(crossing(0.5))
    assert planned.odds == {"unknown": "0 robots could be tried within 0 s (risk.odds_time)"}
    refused = PlannerWithOdds(scenario(), conditions_of(scenario()), odds_time=0.0).plan(crossing(2.0)).refused
    assert "declared loads" in refused
    assert refused.endswith("the odds are not known: 0 robots could be tried within 0 s (risk.odds_time)")


def test_a_refusal_for_want_of_time_is_not_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    """The clock stands until the first robots have been tried, and jumps beyond the allowed time then."""
    hurried = PlannerWithOdds(scenario(), conditions_of(scenario()), odds_time=60.0)
    request, now = crossing(), [0.0]
    slow = hurried.plan(crossing(2.0))
    monkeypatch.setattr(planner_with_odds, "plan_once", lambda *_: slow)
    monkeypatch.setattr(time, "monotonic", lambda: now[0])

    def first_tried(*given: object) -> object:
        found = trials_of(*given)  # type: ignore[arg-type]
        now[0] = 61.0
        return found

    with monkeypatch.context() as cut:
        cut.setattr(alternatives, "trials_of", first_tried)
        refused = hurried.plan(request).refused
    assert refused.endswith("expected at least 90% (risk.success), and no time was left to try others (risk.odds_time)")
    # the same request, with time
    found = hurried.plan(request)
    assert not found.refused
    assert found.odds is not None and found.odds["share"] >= 0.9
    assert hurried.plan(request) is found


def test_by_the_clock_the_map_is_drawn_before_the_first_request() -> None:
    by_the_clock = PlannerWithOdds(scenario(), conditions_of(scenario()), odds_time=60.0)
    roadmap_of_geometry.cache_clear()
    by_the_clock.warm_up()
    assert roadmap_of_geometry.cache_info().misses == 1
    laden = PlanningRequest(HOME, (1, -1), BEYOND, -1, 0.0, payload=1.0)
    chart_for(task_of(conditions_of(scenario()), laden))
    assert roadmap_of_geometry.cache_info().misses == 1


def test_the_planner_of_a_process_takes_the_run_s_file(tmp_path: Path) -> None:
    file = tmp_path / "run.yaml"
    file.write_text(scenario(loads={"push": 0.2}).to_yaml(), encoding="utf-8")

    def odds(conditions: Conditions) -> object:
        named = conditions._replace(planner="fivebar_bringup.motions.planner_with_odds:planner_of", file=str(file))
        return planner_of(named)(crossing(0.5)).odds

    conditions = conditions_of(scenario(loads={"push": 0.2}))
    known = odds(conditions)
    assert isinstance(known, dict) and known["successes"] == ROBOTS
    # what it would draw is not the robot that the graph has been told of
    assert odds(conditions._replace(rate_hz=400)) == {"unknown": "the settings are not those of the run's file"}
    file.write_text("name: [", encoding="utf-8")
    unreadable = odds(conditions)
    assert isinstance(unreadable, dict) and "the run's file cannot be used" in unreadable["unknown"]
    file.write_text(scenario(loads={}).to_yaml(), encoding="utf-8")
    assert odds(conditions_of(scenario(loads={}))) is None
