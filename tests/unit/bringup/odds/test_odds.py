# SPDX-License-Identifier: Apache-2.0
"""The odds of a motion: robots are drawn within what is declared, and how many of them make it decides."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from fivebar_bringup.cli.main import app
from fivebar_bringup.cli.odds import Distribution
from fivebar_bringup.odds import choice, relief
from fivebar_bringup.odds.choice import likeliest
from fivebar_bringup.odds.misfit_limits import sound_maxima
from fivebar_bringup.odds.odds import Odds
from fivebar_bringup.odds.planned_motion import PlannedMotion
from fivebar_bringup.odds.relief import most_relieved, reliefs
from fivebar_bringup.odds.robot_errors import (
    ASSUMED,
    NO_ERRORS,
    NORMAL,
    UNIFORM,
    RobotErrors,
    declared_errors,
    has_odds,
    with_drawn_robot,
)
from fivebar_bringup.odds.trials import ROBOTS, Trials, deciding_trials, trials_of
from fivebar_bringup.runs.admission import refuse_unfit
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_control.trajectory.planner import PlanRefused
from fivebar_description.robot_file import read_robot, robot_path
from fivebar_description.strict_yaml import validate, yaml_text

LOADS = {"tilt": 0.02, "push": 2.0, "push_length": 0.05, "passive": 0.005}


def slow(**changes: object) -> Scenario:
    """A crossing that is slow enough for a push of 2 N to move some robots too far."""
    content = {
        "name": "slow",
        "controller": "unified",
        "waypoints": ((0.0, 0.15), (0.0, 0.02)),
        "segment_duration": 2.0,
        "plant": {"torque_limit": 2.0},
        "loads": LOADS,
    }
    return Scenario.model_validate(content | changes)


def test_odds_say_how_sure_they_are() -> None:
    odds = Odds(18, 24)
    assert odds.share == 0.75
    # Clopper and Pearson's interval: each tail of the binomial distribution has 2.5 % there
    for bound, counts in ((odds.interval.low, range(18, 25)), (odds.interval.high, range(19))):
        tail = sum(math.comb(24, k) * bound**k * (1.0 - bound) ** (24 - k) for k in counts)
        assert tail == pytest.approx(0.025, rel=1e-6)
    assert Odds(3, 4) + Odds(1, 4) == Odds(4, 8)
    assert "18 of 24 drawn robots succeed: 75%" in str(odds)
    nothing = Odds()
    assert (nothing.share, nothing.interval, str(nothing)) == (0.0, (0.0, 1.0), "not known: no robots were drawn")


def test_robots_are_drawn_within_what_is_declared_whatever_the_simulated_one_is() -> None:
    errors = RobotErrors(
        mass_and_inertia=0.1, length=1e-3, base=2e-3, zero=0.01, torque_constant=0.2, tilt=0.1, push=3.0
    )
    plant = {"mass_scale": 1.7, "links": {"l_11": 4e-3}, "transmission": {"frequency": 60.0}, "tilt": {"angle": 0.3}}
    drawn = [with_drawn_robot(slow(plant=plant), errors, 1, number, 1.0).plant for number in range(200)]
    lengths = np.array([robot.links[:4] for robot in drawn])
    bases = np.array([robot.links[4:6] for robot in drawn])
    for values, bound in (
        (lengths, 1e-3),
        (bases, 2e-3),
        (np.array([robot.encoders[:2] for robot in drawn]), 0.01),
        (np.array([robot.mass_scale for robot in drawn]) - 1.0, 0.1),
        (np.array([robot.motors.constant_1 for robot in drawn]), 0.2),
    ):
        assert 0.9 * bound < np.abs(values).max() <= bound
        # uniform: the mean square is a third of the bound's
        assert np.mean(values**2) == pytest.approx(bound**2 / 3.0, rel=0.25)
    assert max(robot.push.force for robot in drawn) <= 3.0
    assert all(1.0 - 0.05 <= robot.push.start <= 1.0 and robot.push.length == 0.05 for robot in drawn)
    assert all(robot.tilt.angle <= 0.1 for robot in drawn)
    # of normally distributed ones 95 % keep the bounds, loads are as before
    normal = [
        with_drawn_robot(slow(), errors._replace(distribution=NORMAL), 1, number, 1.0).plant for number in range(200)
    ]
    others = np.array([robot.links[:4] for robot in normal]) / 1e-3
    assert np.mean(others**2) == pytest.approx(0.25, rel=0.15)
    assert np.mean(np.abs(others) <= 1.0) == pytest.approx(0.954, abs=0.03)
    assert np.abs(others).max() > 1.05
    assert [robot.push for robot in normal] == [robot.push for robot in drawn]
    # the worse of two robots is so by either distribution
    assert np.all(np.argsort(others[:, 0]) == np.argsort(lengths[:, 0]))
    # what all robots have in common, and the friction that is declared as a load
    assert all(robot.transmission.frequency == 60.0 and robot.friction.passive == 0.005 for robot in drawn)
    # the robot that is simulated has no part in it
    assert drawn[7] == with_drawn_robot(slow(plant={"transmission": {"frequency": 60.0}}), errors, 1, 7, 1.0).plant
    assert drawn[7] != drawn[8] != with_drawn_robot(slow(plant=plant), errors, 2, 8, 1.0).plant


def test_bounds_are_those_that_the_scenario_declares() -> None:
    known = slow(tolerances={"length": 2e-4, "base": 1e-4, "zero": 3e-3})
    assert declared_errors(known) == ASSUMED._replace(
        length=2e-4, base=1e-4, zero=3e-3, tilt=0.02, push=2.0, push_length=0.05
    )
    assert has_odds(known)
    assert not has_odds(slow(loads={}))
    assert not has_odds(slow(plant={"engine": "mujoco"}))


@pytest.mark.extra
def test_a_sound_robot_that_bears_the_heavy_loads_of_its_file_keeps_the_limits_of_the_watch(tmp_path: Path) -> None:
    """The estimator expects the force that they come to; without it the innovations are beyond the limit of 50."""
    loads = {"tilt": 0.07, "push": 2.0, "passive": 0.01}
    file = tmp_path / "heavy.yaml"
    file.write_text(
        yaml_text({**read_robot("dextar").model_dump(mode="json", exclude_none=True), "loads": loads}), encoding="utf-8"
    )
    given = load_scenario("gyro_middle").model_dump()
    plant = {name: given["plant"][name] for name in ("torque_quantum", "encoder_counts", "delay_samples")}
    del given["ekf"], given["loads"]
    worst = []
    for force in ({}, {"force_deviation": 0.0}):
        ekf = {"gyro": True, "disturbance_rate": 0.1, **force}
        heavy = validate({**given, "robot": str(file), "plant": plant, "ekf": ekf}, Scenario, "heavy")
        assert heavy.to_bear().push == 2.0
        worst.append([one.misfit_limit for one in sound_maxima(heavy, declared_errors(heavy), 77, (7, 11, 23))])
    expected, unexpected = worst
    assert len(expected) == len(unexpected) == 3
    assert max(expected) < 2.0 < 50.0 < min(unexpected)


@pytest.mark.extra
def test_the_odds_follow_the_errors() -> None:
    scenario = slow()
    exact = trials_of(scenario, NO_ERRORS, 3, range(2)).odds
    pushed = trials_of(scenario, NO_ERRORS._replace(push=2.0), 3, range(ROBOTS)).odds
    assert exact == Odds(2, 2)
    assert 6 <= pushed.successes <= 22
    # nearer to the reference is more promising, though as many robots make it
    quick = trials_of(slow(segment_duration=0.6), NO_ERRORS._replace(push=0.2), 3, range(4))
    slower = trials_of(slow(), NO_ERRORS._replace(push=0.2), 3, range(4))
    assert quick.odds == slower.odds == Odds(4, 4)
    assert slower.promise < quick.promise < 4.0
    # the same robots, whoever asks
    halves = [
        trials_of(scenario, NO_ERRORS._replace(push=2.0), 3, half).odds for half in (range(12), range(12, ROBOTS))
    ]
    assert halves[0] + halves[1] == pushed
    best = reliefs(scenario, declared_errors(scenario), 3, range(ROBOTS))[0]
    assert best.words == "no push"
    assert best.odds == Odds(ROBOTS, ROBOTS)


def test_a_motion_that_the_formula_for_loads_refuses_is_admitted_where_nine_of_ten_robots_make_it() -> None:
    refuse_unfit(slow(loads=LOADS | {"push": 0.8}))
    with pytest.raises(PlanRefused) as refusal:
        refuse_unfit(slow())
    found = re.search(r"; (\d+) of 24 drawn robots succeed: .* expected are at least 90%", str(refusal.value))
    assert found is not None
    decided = deciding_trials(slow())
    assert Odds(int(found[1]), 24) == decided.odds and len(decided.failed) == 24 - decided.odds.successes
    assert "failed: " in str(refusal.value)
    refuse_unfit(slow(risk={"success": 0.5}))


def test_the_likeliest_motion_is_found_and_judged_by_robots_that_had_no_part_in_its_choice(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Motions are durations here; the robot of a number makes those of which its own threshold is the shorter one."""
    tried: list[tuple[float, list[int]]] = []

    def trials_of(scenario: Scenario, errors: RobotErrors, seed: int, robots: Iterable[int], until: float) -> Trials:
        numbers = list(robots)
        (duration,) = scenario.durations()
        tried.append((duration, numbers))
        made = sum(number % 10 < duration for number in numbers)
        return Trials(Odds(made, len(numbers)), made * duration)

    monkeypatch.setattr(choice, "trials_of", trials_of)
    motions = [PlannedMotion(duration, slow(segment_duration=float(duration))) for duration in (2, 5, 9, 8, 1, 4)]
    found = likeliest(motions, NO_ERRORS, 1)
    assert found is not None
    assert found.motion is motions[2]
    assert tried[-1] == (9.0, list(range(ROBOTS, 2 * ROBOTS)))
    assert found.odds == Odds(22, 24)
    # those that can be told to be worse by few robots are tried on few
    of_the_worst = [number for duration, numbers in tried if duration == 1.0 for number in numbers]
    assert len(of_the_worst) == choice.FIRST_ROBOTS
    assert likeliest([], NO_ERRORS, 1) is None


@pytest.mark.parametrize("failed", [range(24, 33), range(39, 48)])
def test_what_relieves_most_is_found_with_no_more_robots_than_decide(
    failed: range, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nine of 24 robots fail; a level base mends one of them, no push seven, and exact lengths none."""
    asked = []

    def tried(
        scenario: Scenario, errors: RobotErrors, seed: int, robots: list[int], failures: float = math.inf
    ) -> Trials:
        mended = 7 if errors.push == 0.0 else 1 if errors.tilt == 0.0 else 0
        count = missed = 0
        for number in robots:
            count, missed = count + 1, missed + (number in failed[mended:])
            if missed > failures:
                break
        asked.append(count)
        return Trials(Odds(count - missed, count))

    monkeypatch.setattr(relief, "trials_of", tried)
    errors = NO_ERRORS._replace(length=1e-4, tilt=0.1, push=2.0)
    first = sorted(range(24, 48), key=lambda robot: robot not in failed)
    found = most_relieved(slow(), errors, 1, Odds(15, 24), first)
    assert found == "with no push 22 of 24 would succeed"
    # eight failures leave fewer than two robots more; frictionless passive joints, tried last, mend none
    assert asked == [8, 9, 24, 2]
    assert most_relieved(slow(), errors._replace(push=0.0), 1, Odds(22, 24), first) == ""


def robot_file(directory: Path, more: str) -> str:
    path = directory / "robot.yaml"
    path.write_text(robot_path("dextar").read_text(encoding="utf-8") + more, encoding="utf-8")
    return str(path)


@pytest.mark.extra
def test_goto_chooses_a_duration_with_good_odds_and_keeps_one_that_is_given(tmp_path: Path) -> None:
    robot = robot_file(tmp_path, "loads: {tilt: 0.02, push: 2.0, passive: 0.005}\n")
    command = ["goto", "0", "0.02", "--mode", "-", "--robot", robot, "--plan-only", "--json"]
    chosen = json.loads(CliRunner().invoke(app, command).stdout)["plan"]
    assert chosen["odds"]["share"] >= 0.9
    done = CliRunner().invoke(app, [*command[:-1], "--duration", "2.0"])
    assert done.exit_code == 0
    kept = re.search(r"odds: (\d+) of 24 drawn robots succeed", done.stdout)
    better = re.search(r"better: in ([\d.]+) s (\d+) of 24", done.stdout)
    assert kept is not None
    assert better is not None
    assert int(kept[1]) < 0.9 * ROBOTS <= int(better[2])
    assert float(better[1]) < 2.0


@pytest.mark.extra
def test_a_run_keeps_its_odds(tmp_path: Path) -> None:
    robot = robot_file(tmp_path, "loads: {push: 0.5}\n")
    command = ["goto", "0", "0.02", "--mode", "-", "--robot", robot, "--out", str(tmp_path / "run")]
    done = CliRunner().invoke(app, command)
    assert done.exit_code == 0
    summary = json.loads((tmp_path / "run" / "summary.json").read_text(encoding="utf-8"))
    assert summary["odds"]["robots"] == ROBOTS
    assert summary["odds"]["successes"] == ROBOTS
    assert "24 of 24 drawn robots succeed: 100%" in done.stdout.partition("error")[2]
    (tmp_path / "run" / "odds.json").write_text('{"successes": -1}', encoding="utf-8")
    refused = CliRunner().invoke(app, ["report", str(tmp_path / "run")])
    assert refused.exit_code == 2
    assert "odds.json: successes: -1" in refused.stderr


@pytest.mark.extra
def test_the_odds_of_a_robot_of_which_nothing_is_declared_say_what_is_assumed() -> None:
    done = CliRunner().invoke(app, ["odds", "unified_middle", "--robots", "3"])
    assert done.exit_code == 0
    assert done.stdout.startswith("dextar declares no errors; assumed: masses and inertias ±5 %, friction ±15 %")
    assert "3 of 3 drawn robots succeed" in done.stdout


def test_a_scenario_for_which_no_robots_can_be_drawn_is_refused_by_the_key_that_forbids_it(tmp_path: Path) -> None:
    file = tmp_path / "mujoco.yaml"
    file.write_text("name: m\nwaypoints: [[0, 0.15], [0, 0.02]]\nplant: {engine: mujoco}\n", encoding="utf-8")
    done = CliRunner().invoke(app, ["odds", str(file)])
    assert (done.exit_code, done.stderr.count("\n")) == (2, 1)
    assert "plant.engine: mujoco: drawn robots are simulated by the engine pinocchio alone" in done.stderr


def test_the_command_offers_the_distributions_of_drawn_errors() -> None:
    """It says them anew, so that `--help` loads nothing of what draws robots."""
    assert [one.value for one in Distribution] == [UNIFORM, NORMAL]
    assert Distribution(RobotErrors().distribution) is Distribution.UNIFORM
