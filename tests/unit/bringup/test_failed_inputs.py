# SPDX-License-Identifier: Apache-2.0
"""Inputs that the command once failed on, in tests/data: each has its right value, whatever the working directory.

Two have no file here: a bag with another robot beside ours is made in `test_bag.py`, since a few messages show
what differs; and a driver with the profile of sensor data publishes in `tests/ros/test_subscriptions.py`.
"""

from __future__ import annotations

import io
import json
import sys
from pathlib import Path

import pytest
from typer.main import get_group
from typer.testing import CliRunner, Result

from fivebar_bringup.cli import main as command
from fivebar_bringup.cli.main import app

DATA = Path(__file__).parents[2] / "data"
CAMERA = DATA / "camera_resolution"
ON_DRIVES = DATA / "domain_id_word" / "mr500.yaml"


@pytest.fixture(autouse=True)
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working directory, in which none of the files is."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def fivebar(*words: str | Path) -> Result:
    return CliRunner().invoke(app, list(map(str, words)))


def camera_scenario(folder: Path, calibration: str) -> Path:
    """Write the scenario with another calibration, beside it."""
    scenario = folder / "scenario.yaml"
    text = (CAMERA / "scenario.yaml").read_text(encoding="utf-8")
    scenario.write_text(text.replace("half.yaml", calibration), encoding="utf-8")
    (folder / calibration).write_bytes((CAMERA / calibration).read_bytes())
    return scenario


@pytest.mark.parametrize("calibration", ["half.yaml", pytest.param("double.yaml", marks=pytest.mark.extra)])
def test_a_calibration_of_smaller_or_larger_pictures_is_scaled(elsewhere: Path, calibration: str) -> None:
    """It was 10 mm off, as it stood."""
    scenario = CAMERA / "scenario.yaml" if calibration == "half.yaml" else camera_scenario(elsewhere, calibration)
    done = fivebar("simulate", scenario, "--no-page", "--json", "--out", "o")
    assert done.exit_code == 0, done.stderr
    assert json.loads(done.stdout)["vision_error_max_m"] < 1e-4


def test_a_calibration_of_another_shape_is_refused_with_both_sizes(elsewhere: Path) -> None:
    done = fivebar("simulate", camera_scenario(elsewhere, "fullhd.yaml"), "--no-page", "--out", "o")
    assert done.exit_code == 2
    (line,) = done.stderr.splitlines()
    assert "fullhd.yaml: calibration of pictures of 1920 x 1080 px: expected one of the camera's 1280 x 960 px" in line


@pytest.mark.extra
@pytest.mark.parametrize(
    "words",
    [
        ("simulate", DATA / "relative_paths" / "rel.yaml", "--no-page", "--out", "o"),
        ("program", DATA / "relative_paths" / "prog.yaml", "--dry-run"),
    ],
    ids=["simulate", "program"],
)
def test_files_beside_the_file_that_names_them_are_found(words: tuple[str | Path, ...]) -> None:
    done = fivebar(*words)
    assert (done.exit_code, done.stderr) == (0, "")


@pytest.mark.parametrize(
    ("words", "domain"),
    [
        (("run", ON_DRIVES, "--hardware", "socketcan", "--drives", "dextar_socketcan"), "banana"),
        (("status",), "300"),
        (("view",), "-1"),
        (("stand",), "0x7"),
    ],
    ids=lambda value: value if isinstance(value, str) else value[0],
)
def test_a_domain_that_is_none_is_one_line(
    words: tuple[str | Path, ...], domain: str, elsewhere: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", domain)
    done = fivebar(*words)
    expected = f"fivebar: ROS_DOMAIN_ID: '{domain}': expected a number from 0 to 101\n"
    assert (done.exit_code, done.stderr) == (2, expected)
    assert not list(elsewhere.iterdir())


def test_a_middleware_that_is_missing_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RMW_IMPLEMENTATION", "rmw_cyclonedds_cpp")
    done = fivebar("status")
    assert done.exit_code == 2
    (line,) = done.stderr.splitlines()
    assert line.startswith("fivebar: RMW_IMPLEMENTATION: 'rmw_cyclonedds_cpp': no such ROS middleware is installed")
    assert line.endswith("`unset RMW_IMPLEMENTATION`")


def test_a_byte_order_mark_changes_no_score() -> None:
    plain, marked = (fivebar("benchmark", "--score", DATA / "csv_bom" / name) for name in ("plain.csv", "bom.csv"))
    assert (marked.exit_code, marked.stderr) == (0, "")
    assert marked.stdout == plain.stdout
    assert "3/1000" in marked.stdout


COMMANDS = sorted(get_group(app).list_commands(None))


@pytest.mark.parametrize("encoding", ["ascii", pytest.param("latin-1", marks=pytest.mark.extra)])
def test_every_help_and_a_posture_are_printed_in_any_encoding(encoding: str, monkeypatch: pytest.MonkeyPatch) -> None:
    calls = [["--help"], ["posture", "1.2", "1.9"], *([name, "--help"] for name in COMMANDS)]
    for words in calls:
        written = io.BytesIO()
        monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(written, encoding=encoding))
        monkeypatch.setattr(sys, "argv", ["fivebar", *words])
        with pytest.raises(SystemExit) as ended:
            command.main()
        assert not ended.value.code, words
        assert len(written.getvalue()) > 100, words
