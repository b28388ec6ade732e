"""`fivebar estimate`: the recorded settings give the recorded estimate bit for bit, others what they are."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from fivebar_bringup.cli.main import app
from fivebar_bringup.runs.run_directory import RunDirectory, new_run_directory
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenario_files import load_scenario
from fivebar_bringup.simulation.offline import simulate, write_bag
from fivebar_bringup.studies.estimate.changes import changed_scenario
from fivebar_bringup.studies.estimate.estimate import SETTINGS_FILE, estimate_bag


def recorded(path: Path) -> RunDirectory:
    """A crossing with a late gyroscope and a sample of delay."""
    content = load_scenario("gyro_middle").model_dump(mode="json")
    content |= {"waypoints": [[0.0, 0.15], [0.0, 0.02]], "segment_duration": 0.5, "rate_hz": 250}
    scenario = Scenario.model_validate(content)
    run = new_run_directory(path, scenario)
    write_bag(simulate(scenario), scenario, run.bag)
    return run


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> RunDirectory:
    return recorded(tmp_path_factory.mktemp("estimate") / "run")


def test_recorded_settings_give_the_recorded_estimate(run: RunDirectory) -> None:
    replay = estimate_bag(run.path, None, ()).after
    assert replay.same
    figures = replay.as_json()
    assert figures["difference_max_m"] == 0.0
    assert figures["samples"] == 126
    assert figures["fault"] == ""
    assert figures["nees_position"] is not None
    assert figures["innovations_gyro"] is not None


def test_other_settings_are_compared(run: RunDirectory, tmp_path: Path) -> None:
    out = tmp_path / "out"
    arguments = ["estimate", str(run.path), "--set", "ekf.gyro=false", "--set", "tolerances.length=0", "--json"]
    result = CliRunner().invoke(app, [*arguments, "--out", str(out)])
    assert result.exit_code == 0
    content = json.loads(result.stdout)
    assert set(content["changes"]) == {"ekf.gyro", "tolerances.length"}
    assert content["recorded"]["identical"]
    assert not content["changed"]["identical"]
    assert content["changed"]["difference_max_m"] > 1e-4
    assert content["changed"]["innovations_gyro"] is None
    assert "estimated again" in (out / "estimation.html").read_text(encoding="utf-8")
    again = changed_scenario(run.read_scenario(), out / SETTINGS_FILE, ())
    assert not again.ekf.gyro
    assert again.tolerances.length == 0.0


@pytest.mark.parametrize(
    ("arguments", "what"),
    [
        (["--set", "ekf.gyro_noise"], "expected SECTION.NAME=VALUE"),
        (["--set", "gains.kp=1"], "expected SECTION.NAME=VALUE"),
        (["--set", "ekf.gyro_noise=loud"], "expected a number"),
        (["--set", "ekf.loudness=1"], "ekf.loudness: unknown key"),
        (["--set", "ekf.gyro_noise=-1"], "ekf.gyro_noise"),
    ],
)
def test_a_wrong_setting_is_named(run: RunDirectory, tmp_path: Path, arguments: list[str], what: str) -> None:
    result = CliRunner().invoke(app, ["estimate", str(run.path), "--out", str(tmp_path / "out"), *arguments])
    assert result.exit_code == 2
    assert what in result.stderr
    assert not (tmp_path / "out").exists()
