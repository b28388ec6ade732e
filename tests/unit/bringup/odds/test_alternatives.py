# SPDX-License-Identifier: Apache-2.0
"""Other time laws and places are tried where no duration is likely enough, and only there."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from types import SimpleNamespace

import pytest

from fivebar_bringup.odds import alternatives, choice
from fivebar_bringup.odds.alternatives import Alternatives, best_of_all
from fivebar_bringup.odds.odds import Odds
from fivebar_bringup.odds.planned_motion import PlannedMotion
from fivebar_bringup.odds.robot_errors import NO_ERRORS, RobotErrors
from fivebar_bringup.odds.trials import LAST_ROBOTS, OTHER_ROBOTS, ROBOTS, Trials
from fivebar_bringup.scenario import Scenario
from fivebar_control.planning.alternative_courses import TimedCourse
from fivebar_control.planning.course import Course
from fivebar_control.trajectory.time_laws import OPTIMAL, QUINTIC, SEPTIC

START, GOAL = (0.0, 0.15), (0.0, 0.02)
ROUND = Course((START, (0.03, 0.1), (0.03, 0.05), GOAL), (0.0, 0.0), QUINTIC)


def motion(timed: TimedCourse) -> PlannedMotion[str]:
    course, durations = timed
    content = {
        "name": "motion",
        "controller": "unified",
        "waypoints": course.waypoints,
        "segment_duration": durations,
        "time_law": course.time_law,
    }
    return PlannedMotion(course.time_law, Scenario.model_validate(content))


def straight(duration: float, time_law: str = QUINTIC) -> PlannedMotion[str]:
    return motion(TimedCourse(Course((START, GOAL), (), time_law), (duration,)))


def others(refused: str = "") -> Alternatives[str]:
    return Alternatives(
        lambda timed: None if timed.course.time_law == refused else motion(timed),
        lambda course: [course._replace(time_law=SEPTIC)],
        lambda: [TimedCourse(ROUND, (0.3, 0.4, 0.3))],
        500,
    )


@pytest.fixture
def made_by(monkeypatch: pytest.MonkeyPatch) -> dict[tuple[str | int, ...], float]:
    """Return what share of the robots makes a motion, by its law and its number of legs, to be filled in.

    With the number of its first robot behind these it is the share of that range of robots.
    """
    shares: dict[tuple[str | int, ...], float] = {}

    def trials_of(scenario: Scenario, errors: RobotErrors, seed: int, robots: Iterable[int], until: float) -> Trials:
        numbers = list(robots)
        motion = scenario.time_law, len(scenario.durations())
        share = shares.get((*motion, min(numbers, default=0)), shares.get(motion, 0.0))
        made = sum(number % ROBOTS < share * ROBOTS for number in numbers)
        return Trials(Odds(made, len(numbers)), share * len(numbers))

    monkeypatch.setattr(choice, "trials_of", trials_of)
    return shares


def test_laws_and_places_are_tried_where_no_duration_is_likely_enough(
    made_by: dict[tuple[str | int, ...], float],
) -> None:
    made_by |= {(QUINTIC, 1): 0.5, (SEPTIC, 1): 0.75, (QUINTIC, 3): 1.0}
    first = straight(1.0)
    found = best_of_all([first], others(), NO_ERRORS, 1, 0.9)
    assert found is not None
    assert found.odds == Odds(24, 24)
    assert found.motion.how_other_than(first) == " by way of (0.0300, 0.1000) m and (0.0300, 0.0500) m"
    made_by[QUINTIC, 3] = 0.6
    found = best_of_all([first], others(), NO_ERRORS, 1, 0.9)
    assert found is not None
    assert (found.motion.motion, found.odds) == (SEPTIC, Odds(18, 24))
    assert found.motion.how_other_than(first) == " by time law septic"
    # nothing else is tried where that is enough
    made_by[QUINTIC, 3] = 1.0
    found = best_of_all([first], others(), NO_ERRORS, 1, 0.5)
    assert found is not None
    assert (found.motion, found.odds) == (first, Odds(12, 24))
    assert best_of_all([], others(), NO_ERRORS, 1, 0.9) is None


def test_the_odds_of_what_is_chosen_last_are_those_on_robots_that_decided_nothing(
    made_by: dict[tuple[str | int, ...], float],
) -> None:
    first, last = straight(1.0), LAST_ROBOTS.start
    made_by |= {(QUINTIC, 1): 0.5, (QUINTIC, 3): 1.0, (QUINTIC, 3, last): 0.75}
    found = best_of_all([first], others(), NO_ERRORS, 1, 0.9)
    assert found is not None
    assert (found.motion.duration, found.odds, found.robots) == (1.0, Odds(18, 24), LAST_ROBOTS)
    # not the larger of two shares, of which one is that of a motion that looked worse
    made_by[QUINTIC, 3, last] = 0.25
    found = best_of_all([first], others(), NO_ERRORS, 1, 0.9)
    assert found is not None
    assert (len(found.motion.scenario.durations()), found.odds) == (3, Odds(6, 24))
    # what is not likely enough is not tried until it is
    made_by |= {(QUINTIC, 1): 0.75, (QUINTIC, 3): 0.5, (QUINTIC, 1, last): 1.0}
    found = best_of_all([first], others(), NO_ERRORS, 1, 0.9)
    assert found is not None
    assert (found.motion, found.odds, found.robots) == (first, Odds(18, 24), OTHER_ROBOTS)


def test_no_place_is_sought_when_the_time_is_over(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = SimpleNamespace(now=0.0)
    monkeypatch.setattr(alternatives, "time", SimpleNamespace(monotonic=lambda: clock.now))

    def elsewhere() -> Iterator[TimedCourse]:
        for _ in range(4):
            clock.now += 1.0
            yield TimedCourse(ROUND, (0.3, 0.4, 0.3))

    places = others()._replace(elsewhere=elsewhere, other_laws=lambda course: [])
    assert len(list(places.beside(straight(1.0), until=2.5))) == 2
    assert clock.now == 3.0


def test_another_duration_keeps_the_law_where_that_is_feasible() -> None:
    scaled = others().in_duration(motion(TimedCourse(ROUND, (0.3, 0.4, 0.3))), 0.5)
    assert scaled is not None
    assert scaled.scenario.durations() == (0.15, 0.2, 0.15)
    assert scaled.motion == QUINTIC
    quicker = others(refused=QUINTIC).in_duration(straight(1.0), 0.5)
    assert quicker is not None
    assert (quicker.motion, quicker.duration) == (OPTIMAL, 0.5)
