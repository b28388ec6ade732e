# SPDX-License-Identifier: Apache-2.0
"""Files that a file names are found beside it, whatever the working directory, and a saved run keeps them."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
import yaml

from fivebar_bringup.motions.program import scenario_of_program
from fivebar_bringup.recorded.run_directory import RunDirectory, new_run_directory
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_control.planning.program import load_program, with_files
from fivebar_description.camera import CameraSettings
from fivebar_description.errors import InputError
from fivebar_description.files import placed_beside
from fivebar_description.robot_file import robot_path
from fivebar_motkin.board_file import board_path, load_board
from fivebar_optics.camera_model import nominal_optics
from fivebar_vision.camera_file import CameraCalibration, calibration_text

CAMERA = {"on": True, "calibration": "mycam.yaml"}
SCENARIO = {"name": "s", "controller": "unified", "waypoints": [[0.0, 0.15], [0.0, 0.1]], "robot": "sub/mine.yaml"}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder, not the working directory, with a robot, a calibration, a scenario, a program and a board."""
    (tmp_path / "sub").mkdir()
    shutil.copy(robot_path("dextar"), tmp_path / "sub" / "mine.yaml")
    optics = nominal_optics(CameraSettings())
    calibration = calibration_text(CameraCalibration(1280, 960, optics, 0.1, 9))
    (tmp_path / "mycam.yaml").write_text(calibration, encoding="utf-8")
    files = {
        "scenario": {**SCENARIO, "estimator": "ekf", "plant": {"encoder_counts": 20000}, "camera": CAMERA},
        "program": {
            "name": "p",
            "scenario": {"robot": "sub/mine.yaml", "camera": CAMERA},
            "steps": [{"move": [0.02, 0.13]}],
        },
        "board": yaml.safe_load(board_path("motkin").read_text(encoding="utf-8"))
        | {"inner_loop": {"robot": "sub/mine.yaml"}},
    }
    for name, content in files.items():
        (tmp_path / f"{name}.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
    return tmp_path


def test_files_are_found_beside_the_file_that_names_them(folder: Path) -> None:
    robot, camera = str(folder / "sub" / "mine.yaml"), str(folder / "mycam.yaml")
    scenario = load_scenario(str(folder / "scenario.yaml"))
    assert (scenario.robot, scenario.camera.calibration) == (robot, camera)
    path = folder / "program.yaml"
    within = scenario_of_program(load_program(path), str(path))
    assert (within.robot, within.camera.calibration) == (robot, camera)
    assert load_board(str(folder / "board.yaml")).inner_loop.robot == robot


def test_names_that_lie_elsewhere_stay_as_they_are(tmp_path: Path) -> None:
    content = {"robot": "dextar", "camera": {"calibration": "nowhere.yaml"}, "other": [1]}
    places = ("robot",), ("camera", "calibration"), ("absent", "key"), ("other", "key")
    assert placed_beside(tmp_path, content, *places) == content
    assert placed_beside(tmp_path, [1], *places) == [1]
    long = {"robot": "n" * 300 + ".yaml"}
    assert placed_beside(tmp_path, long, *places) == long


def test_a_saved_run_is_read_where_it_is_moved_to(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    run = new_run_directory(folder / "run", load_scenario(str(folder / "scenario.yaml")))
    moved = tmp_path_factory.mktemp("elsewhere") / "run"
    run.path.rename(moved)
    shutil.rmtree(folder)
    scenario = RunDirectory(moved).read_scenario()
    assert (scenario.robot, scenario.camera.calibration) == (str(moved / "robot.yaml"), str(moved / "camera.yaml"))


def test_a_program_that_is_kept_with_its_run_names_the_files_there(folder: Path) -> None:
    loaded = load_program(folder / "program.yaml")
    scenario = scenario_of_program(loaded, "program")
    run = new_run_directory(folder / "run", scenario)
    kept = run.path / "program.yaml"
    kept.write_text(with_files(loaded.text, run.files_of(scenario)), encoding="utf-8")
    (folder / "sub" / "mine.yaml").unlink()
    (folder / "mycam.yaml").unlink()
    found = scenario_of_program(load_program(kept), "program")
    assert (found.robot, found.camera.calibration) == (str(run.robot), str(run.path / "camera.yaml"))
    assert with_files(loaded.text, {}) == loaded.text


def test_a_missing_calibration_is_refused_before_anything_is_made(folder: Path) -> None:
    scenario = load_scenario(str(folder / "scenario.yaml"))
    (folder / "mycam.yaml").unlink()
    with pytest.raises(InputError, match=r"mycam\.yaml: cannot be read: No such file or directory$"):
        new_run_directory(folder / "run", scenario)
    assert not (folder / "run").exists()
