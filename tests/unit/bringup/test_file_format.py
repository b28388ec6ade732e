# SPDX-License-Identifier: Apache-2.0
"""Versions of file formats: others are refused in one line, and a file that names none has format 1."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import yaml
from typer.testing import CliRunner

from fivebar_bringup.cli.app import BAD_INPUT
from fivebar_bringup.cli.main import app
from fivebar_bringup.reference.file_schemas import schemas
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_description.files import share_file
from fivebar_description.robot_file import read_robot, robot_path
from fivebar_description.scenario_file import scenario_directory
from fivebar_description.strict_yaml import NEWEST, load_yaml

REFERENCE = Path(__file__).parents[3] / "docs" / "reference"


def fivebar_command(*words: object) -> tuple[int, str, str]:
    result = CliRunner().invoke(app, [str(word) for word in words])
    return result.exit_code, result.stdout, result.stderr


@pytest.mark.parametrize(
    ("number", "advice"),
    [
        ("2", "; a newer release of fivebar reads this file"),
        ("0", "; fivebar 1.0.0 brings a file of format 0 up to date: fivebar migrate"),
        ("-1", ""),
        ("'1'", ""),
        ("true", ""),
    ],
)
@pytest.mark.parametrize("kind", ["scenario", "robot", "program"])
def test_another_format_is_refused_in_one_line(kind: str, number: str, advice: str, tmp_path: Path) -> None:
    path = tmp_path / "other.yaml"
    shipped, command = {
        "scenario": (scenario_directory() / "middle.yaml", "simulate"),
        "robot": (robot_path("dextar"), "map"),
        "program": (share_file("fivebar_bringup", "config", "programs", "pick_and_place.yaml"), "program"),
    }[kind]
    # before anything else in the file, which another release may have changed altogether
    path.write_text(shipped.read_text().replace("format: 1", f"format: {number}\nheadings: {{}}"), encoding="utf-8")
    shown = repr(yaml.safe_load(number))
    refusal = f"fivebar: {path}: format: {shown}: this release understands format 1{advice}\n"
    assert fivebar_command(command, path) == (BAD_INPUT, "", refusal)


def test_every_shipped_file_names_its_format_and_so_do_saved_ones(tmp_path: Path) -> None:
    programs = share_file("fivebar_bringup", "config", "programs")
    shipped = [*scenario_directory().glob("*.yaml"), *robot_path("dextar").parent.glob("*.yaml"), *programs.iterdir()]
    for path in shipped:
        content = load_yaml(path)
        assert isinstance(content, dict)
        assert content["format"] == NEWEST, path
    assert load_scenario("middle").to_yaml().startswith("format: 1\n")
    assert read_robot("dextar").model_dump()["format"] == NEWEST


def test_a_scenario_that_a_run_saved_without_a_number_is_read(tmp_path: Path) -> None:
    """With every default written out, and no number."""
    saved, scenario = tmp_path / "scenario.yaml", load_scenario("gyro_middle")
    saved.write_text(scenario.to_yaml().replace("format: 1\n", "", 1), encoding="utf-8")
    assert load_scenario(str(saved)) == scenario


@pytest.mark.parametrize("name", ["scenario.schema.json", "robot.schema.json", "program.schema.json"])
def test_the_published_schemas_are_those_of_the_models(name: str) -> None:
    text = (REFERENCE / name).read_text(encoding="utf-8")
    assert text == schemas()[name], "stale: .venv/bin/python -m fivebar_bringup.reference.file_schemas docs/reference"
    assert json.loads(text)["properties"]["format"]["const"] == NEWEST
