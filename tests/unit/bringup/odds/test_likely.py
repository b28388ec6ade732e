# SPDX-License-Identifier: Apache-2.0
"""A motion is made if it is likely enough; with too little time it is not known whether it is."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

import pytest

from fivebar_bringup.odds import alternatives, likely
from fivebar_bringup.odds.alternatives import Alternatives
from fivebar_bringup.odds.choice import Choice
from fivebar_bringup.odds.likely import likely_motion
from fivebar_bringup.odds.odds import Odds, told_odds
from fivebar_bringup.odds.planned_motion import PlannedMotion
from fivebar_bringup.odds.robot_errors import RobotErrors
from fivebar_bringup.odds.trials import Trials
from fivebar_bringup.scenario import Scenario
from fivebar_control.planning.alternative_courses import TimedCourse
from fivebar_description.strict_yaml import InputError


def in_seconds(duration: float) -> PlannedMotion[str]:
    content = {
        "name": "motion",
        "controller": "unified",
        "waypoints": ((0.0, 0.15), (0.0, 0.02)),
        "segment_duration": duration,
        "loads": {"push": 2.0},
    }
    return PlannedMotion(f"{duration:g} s", Scenario.model_validate(content))


def planned(timed: TimedCourse) -> PlannedMotion[str]:
    motion = in_seconds(timed.duration)
    return motion._replace(scenario=motion.scenario.model_copy(update={"time_law": timed.course.time_law}))


OTHERS = Alternatives(planned, lambda course: [course._replace(time_law="septic")], list, 500)


def trying(first: Odds, fresh: Odds | None = None) -> Callable[..., Trials]:
    def trials_of(scenario: Scenario, errors: RobotErrors, seed: int, robots: range, *more: float) -> Trials:
        return Trials(first if robots.start == 0 or fresh is None else fresh)

    return trials_of


def try_with(monkeypatch: pytest.MonkeyPatch, trials_of: Callable[..., Trials]) -> None:
    for module in (alternatives, likely):
        monkeypatch.setattr(module, "trials_of", trials_of)


def found_with(
    monkeypatch: pytest.MonkeyPatch,
    first: Odds,
    best: Odds | None,
    keeps_duration: bool = False,
    until: float = math.inf,
    law: bool = False,
    fresh: Odds | None = None,
) -> PlannedMotion[str]:
    """Return what becomes of a motion of 2 s with such odds, and with these in the best other duration, 1 s.

    With `law` it is another time law that is best in that duration. Of the robots that had no part in accepting any
    motion `fresh` make it, by default as many as of those that decide about the first one.
    """
    try_with(monkeypatch, trying(first, fresh))
    monkeypatch.setattr(likely, "most_relieved", lambda *arguments: "with a level base 24 of 24 would")

    def choose(motions: list[PlannedMotion[str]], others: Alternatives[str], *more: object) -> Choice[str] | None:
        chosen = next((one for one in motions if one.motion == "1 s"), None)
        if best is None or chosen is None:
            return None
        if not law:
            return Choice(chosen, best)
        return Choice(next(others.beside(chosen, until)), best)

    monkeypatch.setattr(alternatives, "best_of_all", choose)
    return likely_motion(in_seconds(2.0), OTHERS, keeps_duration, until)


def test_a_likely_motion_is_made_and_an_unlikely_one_in_the_duration_with_the_best_odds(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert found_with(monkeypatch, Odds(22, 24), None).motion == "2 s"
    found = found_with(monkeypatch, Odds(21, 24), Odds(23, 24), fresh=Odds(20, 24))
    assert (found.motion, found.odds, found.better, found.likely) == ("1 s", Odds(20, 24), None, True)
    assert found.scenario.durations() == (1.0,)
    with pytest.raises(InputError, match=r"at best, in 1 s, 20 of 24 .*; with a level base 24 of 24"):
        found_with(monkeypatch, Odds(8, 24), Odds(20, 24))


def test_the_odds_of_an_accepted_motion_are_those_of_other_robots_than_have_accepted_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found = found_with(monkeypatch, Odds(24, 24), None, fresh=Odds(21, 24))
    assert (found.motion, found.odds) == ("2 s", Odds(21, 24))


def test_a_refusal_says_how_the_robots_fail_and_what_to_type_next(monkeypatch: pytest.MonkeyPatch) -> None:
    failed = {24: "fault state_stale", 25: "peak error 3.12 mm", 26: "peak error 2.5 mm", 27: "final error 1.4 mm"}
    try_with(monkeypatch, trying(Odds(8, 24)))
    monkeypatch.setattr(likely, "most_relieved", lambda *arguments: "")
    monkeypatch.setattr(
        alternatives, "best_of_all", lambda motions, *more: Choice(motions[0], Odds(20, 24), range(24, 48), failed)
    )
    with pytest.raises(InputError) as refusal:
        likely_motion(in_seconds(2.0), OTHERS, keeps_duration=False)
    assert str(refusal.value).endswith(
        "failed: 2 with a peak error of up to 3.12 mm (limit 2.00 mm), 1 with fault state_stale, 1 with a final error"
        " of up to 1.4 mm (limit 1.00 mm); nothing alone raises that; more: fivebar assess dextar"
    )


def test_a_duration_that_is_given_is_kept_and_a_better_one_named(monkeypatch: pytest.MonkeyPatch) -> None:
    found = found_with(monkeypatch, Odds(8, 24), Odds(23, 24), keeps_duration=True)
    assert (found.motion, found.odds, found.likely) == ("2 s", Odds(8, 24), False)
    assert found.better is not None
    assert (found.better.motion, found.better.odds, found.better.chosen) == ("1 s", Odds(23, 24), "")
    assert found_with(monkeypatch, Odds(8, 24), Odds(8, 24), keeps_duration=True).better is None


def test_what_was_chosen_in_place_of_the_first_motion_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    assert found_with(monkeypatch, Odds(22, 24), None).chosen == ""
    assert found_with(monkeypatch, Odds(8, 24), Odds(23, 24)).chosen == "1 s, not 2 s"
    assert found_with(monkeypatch, Odds(8, 24), Odds(23, 24), law=True).chosen == "1 s by time law septic, not 2 s"
    better = found_with(monkeypatch, Odds(8, 24), Odds(23, 24), keeps_duration=True, law=True).better
    assert better is not None
    assert (better.duration, better.odds, better.chosen) == (1.0, Odds(23, 24), " by time law septic")
    with pytest.raises(InputError, match=r"at best, in 1 s by time law septic, 20 of 24"):
        found_with(monkeypatch, Odds(8, 24), Odds(20, 24), law=True)


def test_the_first_motion_is_not_said_to_be_chosen_in_place_of_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    def chosen_of(best: Callable[[list[PlannedMotion[str]]], PlannedMotion[str]]) -> str:
        try_with(monkeypatch, trying(Odds(21, 24)))
        monkeypatch.setattr(alternatives, "best_of_all", lambda motions, *more: Choice(best(motions), Odds(23, 24)))
        return likely_motion(in_seconds(2.0), OTHERS, keeps_duration=False).chosen

    assert chosen_of(lambda motions: motions[0]) == ""
    assert chosen_of(lambda motions: next(OTHERS.beside(motions[0], math.inf))) == "2 s by time law septic"


def test_a_search_that_the_clock_cuts_short_does_not_name_the_best(monkeypatch: pytest.MonkeyPatch) -> None:
    try_with(monkeypatch, trying(Odds(8, 24)))
    monkeypatch.setattr(alternatives, "best_of_all", lambda motions, *more: Choice(motions[0], Odds(20, 24)))
    monkeypatch.setattr(likely, "most_relieved", lambda *arguments: "")
    cut_short = r"20 of 24 .* \(risk.success\).*, and no time was left to try more \(risk.odds_time\)$"
    with pytest.raises(InputError, match=cut_short):
        likely_motion(in_seconds(2.0), OTHERS, keeps_duration=False, until=time.monotonic())
    with pytest.raises(InputError, match=r"20 of 24 .* \(risk.success\)(?!.*no time)"):
        likely_motion(in_seconds(2.0), OTHERS, keeps_duration=False, until=time.monotonic() + 1e6)


def test_with_too_little_time_nothing_is_decided_but_what_cannot_become_likely(monkeypatch: pytest.MonkeyPatch) -> None:
    now = time.monotonic()
    found = found_with(monkeypatch, Odds(9, 10), None, until=now)
    assert (found.motion, found.odds, found.likely) == ("2 s", Odds(9, 10), True)
    # 3 failures of 24 are too many, whatever the other robots do
    with pytest.raises(InputError, match=r"in 2 s 7 of 10 drawn robots succeed.*no time was left"):
        found_with(monkeypatch, Odds(7, 10), Odds(24, 24), until=now)


def test_no_robot_is_tried_when_the_time_is_over() -> None:
    found = likely_motion(in_seconds(2.0), OTHERS, keeps_duration=False, until=time.monotonic())
    assert (found.odds, found.likely) == (Odds(), True)


def test_what_a_status_tells_is_said_in_words() -> None:
    told = {**Odds(8, 24).as_dict(), "better": {"duration_s": 0.5, **Odds(24, 24).as_dict()}}
    assert told_odds(told, short=True) == "8 of 24; better in 0.5 s: 24 of 24"
    assert told_odds(told).startswith("8 of 24 drawn robots succeed: 33%, with 95 % confidence")
    assert told_odds({"unknown": "no time"}) == "not known: no time"
