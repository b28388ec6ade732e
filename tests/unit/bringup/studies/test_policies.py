# SPDX-License-Identifier: Apache-2.0
"""Policies in the benchmark: laws as policies score as the laws do, and what is no policy is refused by name."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from fivebar_bringup.cli.main import app
from fivebar_bringup.simulation.observation import Observation
from fivebar_description.strict_yaml import InputError
from fivebar_studies.benchmark.crossings import benchmark
from fivebar_studies.benchmark.running import POLICY_FAILED, BenchmarkSettings
from fivebar_studies.benchmark.scoring import Result, success
from fivebar_studies.benchmark.study import BENCHMARK, command_of

CTC_FAILS = (1, 14, 20)
"""Crossings of half a second on which computed torque control asks for too much."""


def settings_of(policy: str, **more: object) -> BenchmarkSettings:
    given = {"controllers": (), "policy": f"law_policies:{policy}", **more}
    return BenchmarkSettings(**given)  # type: ignore[arg-type]


def result_of(policy: str, number: int = 1, **more: object) -> Result:
    (result,) = BENCHMARK.run(settings_of(policy, **more), number)
    return result


@pytest.mark.parametrize(("policy", "law", "fault"), [("Unified", "unified", ""), ("ctc", "ctc", "torque_excessive")])
def test_a_law_as_a_policy_scores_as_the_law_does(policy: str, law: str, fault: str) -> None:
    """Also where it fails; `Unified` is a class, whose memory begins anew with each crossing."""
    settings = settings_of(policy, controllers=(law,))
    for number in CTC_FAILS:
        by_law, by_policy = BENCHMARK.run(settings, number)
        assert by_policy._replace(controller=law)[:5] == by_law[:5] == (number, "ideal", law, fault, 1)
        assert by_policy[5:] == pytest.approx(by_law[5:], rel=1e-6, abs=1e-9)
        assert success(by_policy, benchmark()[number]) == (fault == "")


def test_a_policy_that_sees_the_motors_alone_has_four_values_less() -> None:
    """`ctc` takes its joints from a whole observation, and fails on another one; once, for each rig and crossing."""
    rows = BENCHMARK.run(settings_of("ctc", rigs=("ideal", "encoders"), observation=Observation.ENCODERS), 1)
    assert [row.fault for row in rows] == [POLICY_FAILED] * 2
    assert result_of("counting", rigs=("encoders",), observation=Observation.ENCODERS).torque == 0.016
    assert result_of("counting").torque == 0.019


@pytest.mark.parametrize(("policy", "fault"), [("undefined", "torque_undefined"), ("raising_later", POLICY_FAILED)])
def test_a_policy_that_fails_on_its_way_is_named_in_its_row(policy: str, fault: str) -> None:
    result = result_of(policy)
    assert (result.controller, result.fault) == (f"law_policies:{policy}", fault)
    assert not success(result, benchmark()[1])


NO_POLICY = {
    "law_policies": "'law_policies': expected MODULE:NAME",
    "law_policies:nobody": "law_policies:nobody: cannot be loaded: module 'law_policies' has no attribute 'nobody'",
    "law_missing:policy": "law_missing:policy: cannot be loaded: No module named 'law_missing'",
    "law_policies:NUMBER": "law_policies:NUMBER: is of type int: expected a function, or a class",
    "law_policies:silent": "law_policies:silent: returned None: expected two torques (Nm)",
    "law_policies:words": "law_policies:words: returned 'left': expected two torques (Nm)",
    "law_policies:three": "law_policies:three: returned [0.0, 0.0, 0.0]: expected two torques (Nm)",
    "law_policies:raising": "law_policies:raising: IndexError: list index out of range (law_policies.py, line ",
    "law_policies:Unmade": "law_policies:Unmade: TypeError: Unmade.__init__() missing 1 required positional argument:",
}


@pytest.mark.parametrize(("policy", "words"), NO_POLICY.items())
def test_no_policy_is_refused_in_a_line(
    policy: str, words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    called = CliRunner().invoke(app, ["benchmark", "--policy", policy, "--controllers", "ctc"])
    assert (called.exit_code, called.stderr.count("\n")) == (2, 1), called.output
    assert called.stderr.startswith(f"fivebar: --policy: {words}")
    assert not list(tmp_path.iterdir()), "what is refused leaves no directory"


def test_its_scores_stand_beside_those_of_the_laws(tmp_path: Path) -> None:
    words = ["--policy", "law_policies:Unified", "--controllers", "ctc", "--cases", "2", "--jobs", "1"]
    called = CliRunner().invoke(app, ["benchmark", *words, "--out", str(tmp_path / "out"), "--json"])
    assert called.exit_code == 0, called.output
    found = {score["controller"]: score["successes"] for score in json.loads(called.stdout)["scores"]}
    assert found == {"ctc": 1, "law_policies:Unified": 2}


def test_a_policy_decides_the_rows_and_is_in_the_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Rows of one policy are not resumed with another version of its module, nor without that."""
    settings = settings_of("ctc", controllers=("ctc",), cases=9)
    assert command_of(settings) == (
        "fivebar benchmark --rig ideal --controllers ctc --policy law_policies:ctc --observation all --cases 9"
    )
    without = settings.model_copy(update={"policy": ""})
    assert BENCHMARK.program(settings) != BENCHMARK.program(without)
    module = tmp_path / "changing_policy.py"
    monkeypatch.syspath_prepend(tmp_path)
    changing, digests = settings.model_copy(update={"policy": "changing_policy:policy"}), []
    for torque in ("0.0", "0.1"):
        module.write_text(f"def policy(seen):\n    return {torque}, 0.0\n", encoding="utf-8")
        digests.append(BENCHMARK.program(changing))
    assert digests[0] != digests[1]
    missing = settings.model_copy(update={"policy": "missing_policy:policy"})
    with pytest.raises(InputError, match="missing_policy: cannot be loaded: No module named 'missing_policy'"):
        BENCHMARK.program(missing)
