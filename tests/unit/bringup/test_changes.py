# SPDX-License-Identifier: Apache-2.0
"""Keys of a scenario that a command changes."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
import yaml
from typer.testing import CliRunner

from fivebar_bringup.cli.main import app
from fivebar_bringup.scenarios.changes import read_changes
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_description.errors import InputError
from fivebar_studies.compare.cases import ComparisonCase
from fivebar_studies.rigs.named import find_rig
from fivebar_studies.rigs.rig import SET
from fivebar_studies.sweep.drawing import draw


def refusal(*words: str) -> str:
    done = CliRunner().invoke(app, list(words))
    assert (done.exit_code, done.stderr.count("\n")) == (2, 1), done.output
    return str(done.stderr)


def test_values_are_read_as_in_a_file() -> None:
    words = [
        "unified.kp=4e2",
        "waypoints=[[0, 0.1], [0, 0.2]]",
        "safety.torque_limit=null",
        "ekf.gyro=true",
        "name=a=b",
    ]
    assert read_changes(words) == {
        "unified.kp": 400.0,
        "waypoints": [[0, 0.1], [0, 0.2]],
        "safety.torque_limit": None,
        "ekf.gyro": True,
        "name": "a=b",
    }


def test_keys_of_a_robot_file_change_what_a_scenario_has_in_their_place() -> None:
    words = ["drives.torque_limit=3", "transmission.frequency=60", "passive_encoder.leg=2", "tolerances.length=1e-4"]
    assert list(read_changes(words)) == [
        "plant.torque_limit",
        "plant.transmission.frequency",
        "sensors.passive_encoder.leg",
        "tolerances.length",
    ]


@pytest.mark.parametrize(
    ("word", "words"),
    [
        ("unified", "expected KEY=VALUE, such as unified.kp=900"),
        ("=3", "expected KEY=VALUE"),
        ("unified..kp=3", "expected KEY=VALUE"),
        ("lengths_m.a=0.1", "--set lengths_m.a: is a key of the robot's file"),
        ("name.x=1", "--set name.x: name is no section"),
        ("gain.kp=1", "--set: gain: unknown key (did you mean gains?)"),
        ("kp=1", "--set: kp: unknown key (did you mean gains.kp or unified.kp?)"),
        ("ekf.mass_scale=1", "--set: ekf.mass_scale: unknown key (did you mean plant.mass_scale?)"),
        ("unified.kp=fast", "--set: unified.kp: 'fast': expected a number"),
        ("unified.kp=-1", "--set: unified.kp: -1: expected at least 0"),
        ("unified.kp=[", "--set unified.kp: is not valid YAML"),
        ("gains.kp=100", "--set gains.kp: does not apply to `unified`; use `unified:`"),
        ("plant.push.heading=1", "--set plant.push.heading: has no effect while `plant.push.force` is off"),
    ],
)
def test_a_change_is_checked_as_in_a_file(word: str, words: str) -> None:
    assert words in refusal("simulate", "unified_middle", "--set", word)


def test_a_key_is_changed_once() -> None:
    with pytest.raises(InputError, match="given twice"):
        read_changes(["unified.kp=1", "unified.kp=2"])


@pytest.mark.parametrize("command", ["simulate", "run", "odds"])
def test_a_scenario_is_loaded_with_the_change(command: str) -> None:
    assert "gains.kp: does not apply" in refusal(command, "unified_middle", "--set", "gains.kp=1")


def test_a_change_reaches_the_run(tmp_path: Path) -> None:
    words = ["simulate", "unified_middle", "--set", "unified.kp=400", "--set", "waypoints=[[0,0.15],[0,0.12]]"]
    done = CliRunner().invoke(app, [*words, "--no-page", "--json", "--out", str(tmp_path / "run")])
    assert done.exit_code == 0, done.stderr
    kept = load_scenario(str(tmp_path / "run" / "scenario.yaml"))
    assert kept.unified.kp == 400.0 and kept.waypoints == ((0.0, 0.15), (0.0, 0.12))


def test_a_controller_and_its_settings_are_changed_together() -> None:
    changes = read_changes(["controller=unified", "unified.kp=400"])
    changed = load_scenario("middle", changes=changes)
    assert (changed.controller, changed.unified.kp) == ("unified", 400.0)


def test_a_motion_on_request_takes_changes_but_what_it_decides(tmp_path: Path) -> None:
    goto = ["goto", "0", "0.12", "--no-page", "--json", "--out", str(tmp_path / "run")]
    done = CliRunner().invoke(app, [*goto, "--set", "unified.kp=400", "--set", "plant.mass_scale=1.2"])
    assert done.exit_code == 0, done.stderr
    kept = load_scenario(str(tmp_path / "run" / "scenario.yaml"))
    assert (kept.unified.kp, kept.plant.mass_scale) == (400.0, 1.2)
    assert json.loads(done.stdout)["summary"]["outcome"] == "succeeded"
    for word, option in (
        ("drives.torque_limit=1", "--torque-limit"),
        ("waypoints=[]", "--via"),
        ("robot=a", "--robot"),
    ):
        assert option in refusal(*goto, "--set", word)


def test_a_comparison_changes_what_its_laws_have() -> None:
    given = load_scenario("middle")
    changes = ("unified.kp=400", "plant.mass_scale=1.5")
    one, other = (ComparisonCase(given, name, 1.0, "ideal", None, changes).scenario() for name in ("unified", "ctc"))
    assert (one.unified.kp, one.plant.mass_scale, other.plant.mass_scale) == (400.0, 1.5, 1.5)
    compare = ("compare", "--quick", "--rig", "ideal", "--controllers", "unified", "--set")
    assert "use `unified:`" in refusal(*compare, "gains.kp=3")
    assert "--durations" in refusal(*compare, "segment_duration=3")


def test_a_sweep_changes_the_scenarios_of_its_rig() -> None:
    name = SET.join(("ideal", "unified.kp=400", "error_tolerance=0.005"))
    changed, usual = (draw(1, 3, rig).scenario("unified") for rig in (name, "ideal"))
    expected: dict[str, Any] = usual.model_dump() | {"error_tolerance": 0.005}
    expected["unified"]["kp"] = 400.0
    assert changed.model_dump() == expected
    assert find_rig("ideal").content(usual, "unified")["unified"]["kp"] != 400.0
    sweep = ("sweep", "--case", "3", "--controllers", "unified")
    assert "expected with --rig" in refusal(*sweep, "--set", "unified.kp=3")
    assert "use `unified:`" in refusal(*sweep, "--rig", "ideal", "--set", "gains.kp=3")
    assert "plans its motions at 500 Hz" in refusal(*sweep, "--rig", "ideal", "--set", "rate_hz=100")
    assert "--set unified.kpp: unknown key (did you mean kp?)" in refusal(
        *sweep, "--rig", "ideal", "--set", "unified.kpp=3"
    )


@pytest.mark.parametrize(
    ("words", "refused"),
    [
        ("sweep --case 3 --jobs 2", "--jobs: has no effect with --case"),
        ("sweep --case 3 --quick", "--quick: has no effect with --case"),
        ("sweep --scheduler tcp://a:1 --jobs 2", "--jobs: has no effect with --scheduler"),
        ("benchmark --score a.csv --out b", "--out: has no effect with --score"),
        ("program pick_and_place --dry-run --no-page", "--no-page: has no effect with --dry-run"),
        ("goto 0 0.1 --plan-only --ros", "--ros: has no effect with --plan-only"),
        ("camera-calibrate --board a.png --simulate camera_slow", "--simulate: has no effect with --board"),
        ("run middle --priority 10", "--priority: expected with --realtime or --hardware"),
        ("report a b --namespace c", "--namespace"),
    ],
)
def test_an_option_without_effect_is_refused(words: str, refused: str) -> None:
    assert refused in refusal(*words.split())


def test_the_settings_of_a_scenario_are_printed_with_changes() -> None:
    done = CliRunner().invoke(app, ["settings", "middle", "--set", "gains.kp=900"])
    assert done.exit_code == 0
    kept = yaml.safe_load(done.stdout)
    assert (kept["name"], kept["gains"]["kp"]) == ("middle", 900.0)
    assert kept == yaml.safe_load(load_scenario("middle", changes={"gains.kp": 900.0}).to_yaml())
    assert "expected with SCENARIO" in refusal("settings", "--set", "gains.kp=900")
