# SPDX-License-Identifier: Apache-2.0
"""A run's directory: what it keeps so that the run stays what it was."""

from __future__ import annotations

from pathlib import Path

import pytest

from fivebar_bringup.recorded.run_directory import RunDirectory, new_run_directory
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_description.robot_file import load_robot, robot_path

SCENARIO = "{name: short, robot: ROBOT, waypoints: [[0.0, 0.15], [0.0, 0.12]]}"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a robot file and a scenario beside it that names it."""
    made = tmp_path / "bench"
    made.mkdir()
    (made / "mine.yaml").write_text(robot_path("dextar").read_text())
    (made / "short.yaml").write_text(SCENARIO.replace("ROBOT", "mine.yaml"))
    return made


def test_a_robot_file_is_looked_for_beside_its_scenario(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir("/")
    assert load_scenario(str(folder / "short.yaml")).robot == str(folder / "mine.yaml")


def test_a_robot_file_that_is_not_beside_it_is_one_of_the_working_directory(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scenario = tmp_path / "short.yaml"
    scenario.write_text(SCENARIO.replace("ROBOT", "mine.yaml"))
    monkeypatch.chdir(folder)
    assert load_scenario(str(scenario)).robot == "mine.yaml"


def test_a_run_keeps_its_robot_whatever_becomes_of_the_file(folder: Path, tmp_path: Path) -> None:
    run = new_run_directory(tmp_path / "run", load_scenario(str(folder / "short.yaml")))
    text = (folder / "mine.yaml").read_text()
    (folder / "mine.yaml").write_text(text.replace("l_11: 0.09", "l_11: 0.08"))
    assert load_robot(str(folder / "mine.yaml")) != load_robot("dextar")
    moved = run.path.rename(tmp_path / "elsewhere")
    assert RunDirectory(moved).read_scenario().five_bar() == load_robot("dextar")


def test_a_run_of_a_shipped_robot_names_it(tmp_path: Path) -> None:
    run = new_run_directory(tmp_path / "run", load_scenario("middle"))
    assert run.read_scenario() == load_scenario("middle")
    assert not run.robot.exists()
