"""Versions of file formats: newer ones are refused in one line, older ones migrated with their comments."""

from __future__ import annotations

import json
import logging
import math
from pathlib import Path

import pytest
from typer.testing import CliRunner

from fivebar_bringup.cli.app import BAD_INPUT
from fivebar_bringup.cli.main import app
from fivebar_bringup.file_schemas import schemas
from fivebar_bringup.scenario_files import load_scenario, scenario_directory
from fivebar_description.file_format import NEWEST
from fivebar_description.robot_file import load_robot, read_robot, robot_path
from fivebar_description.share import share_file
from fivebar_description.strict_yaml import InputError, load_yaml
from fivebar_sim.effects.mechanism import mechanism_of

REFERENCE = Path(__file__).parents[3] / "docs" / "reference"

OLD_FREQUENCY, OLD_DAMPING, ROTOR_SHARE = 80.0, 0.05, 0.64

FORMAT_0 = """\
# A belt between motor and link, written before formats had numbers.
name: elastic      # not as stiff as it looks
controller: multi_joint
waypoints: [[0.0, 0.15], [0.0, 0.02]]
adaptive_gain: {enabled: yes, keep_damping: off}   # words that YAML 1.1 takes for truth values
plant:
  seed: 017        # octal to YAML 1.1
  torque_limit: ~
  transmission:
    # of the link against its locked rotor, as that release had it
    frequency: 80.0
    damping: 0.05
    rotor_share: 0.64
"""

FORMAT_1 = """\
# A belt between motor and link, written before formats had numbers.
format: 1
name: elastic      # not as stiff as it looks
controller: multi_joint
waypoints: [[0.0, 0.15], [0.0, 0.02]]
adaptive_gain: {enabled: true, keep_damping: false}   # words that YAML 1.1 takes for truth values
plant:
  seed: 15        # octal to YAML 1.1
  torque_limit: ~
  transmission:
    # of the link against its locked rotor, as that release had it
    frequency: 48.0
    damping: 0.03
    rotor_share: 0.64
"""


def fivebar_command(*words: object) -> tuple[int, str, str]:
    result = CliRunner().invoke(app, [str(word) for word in words])
    return result.exit_code, result.stdout, result.stderr


@pytest.fixture
def old(tmp_path: Path) -> Path:
    path = tmp_path / "elastic.yaml"
    path.write_text(FORMAT_0, encoding="utf-8")
    return path


def test_migrate_rewrites_values_and_keeps_comments(old: Path) -> None:
    status, printed, _ = fivebar_command("migrate", old, "--from", 0)
    assert (status, old.read_text(encoding="utf-8")) == (0, FORMAT_1)
    assert printed.count("is now") == 5
    assert fivebar_command("migrate", old)[:2] == (0, f"{old}: is in format 1\n")


def test_migrate_adds_what_was_a_default_and_takes_a_section_in_one_line(tmp_path: Path) -> None:
    path = tmp_path / "short.yaml"
    path.write_text("{name: a, waypoints: [[0, 0.15], [0, 0.02]], plant: {transmission: {frequency: 80}}}\n")
    assert fivebar_command("migrate", path, "--from", 0)[0] == 0
    assert path.read_text().startswith("{format: 1, name: a, ")
    transmission = load_scenario(str(path)).plant.transmission
    assert transmission[:2] == pytest.approx((80.0 * math.sqrt(0.3), 0.04 * math.sqrt(0.3)), abs=1e-8)


def test_a_migrated_transmission_has_the_stiffness_and_damper_of_before(old: Path) -> None:
    fivebar_command("migrate", old, "--from", 0)
    scenario, robot = load_scenario(str(old)), load_robot("dextar")
    mechanism = mechanism_of(robot, scenario.plant, scenario.rate_hz)
    pulsation = 2.0 * math.pi * OLD_FREQUENCY
    for leg, whole in ((mechanism.leg1, robot.leg1.inertia), (mechanism.leg2, robot.leg2.inertia)):
        link = (1.0 - ROTOR_SHARE) * whole
        assert leg.stiffness == pytest.approx(link * pulsation**2, rel=1e-12)
        assert leg.damping == pytest.approx(2.0 * OLD_DAMPING * link * pulsation, rel=1e-12)


def test_an_older_file_is_read_as_migrated_with_a_message(old: Path, caplog: pytest.LogCaptureFixture) -> None:
    old.write_text("format: 0\n" + FORMAT_0, encoding="utf-8")
    with caplog.at_level(logging.WARNING, "fivebar"):
        scenario = load_scenario(str(old))
        load_scenario(str(old))
    (message,) = caplog.messages
    assert message.startswith(f"{old}: format 0 is read as format 1 (line 6: yes is now true;")
    assert message.endswith(f"fivebar migrate {old} writes it so")
    assert fivebar_command("migrate", old)[0] == 0
    assert load_scenario(str(old)) == scenario


def test_a_file_without_a_number_has_format_1_and_forms_of_format_0_are_named(old: Path) -> None:
    with pytest.raises(InputError, match=rf"adaptive_gain.enabled: 'yes': .*; .*: fivebar migrate --from 0 {old}$"):
        load_scenario(str(old))
    plain = FORMAT_1.replace("format: 1\n", "")
    old.write_text(plain, encoding="utf-8")
    assert load_scenario(str(old)).plant.transmission.frequency == 48.0
    assert fivebar_command("migrate", old)[0] == 0
    assert old.read_text(encoding="utf-8") == FORMAT_1


@pytest.mark.parametrize(
    ("number", "understood"),
    [
        ("2", "this release understands formats 0 to 1; a newer release of fivebar reads this file"),
        ("-1", "this release understands formats 0 to 1"),
        ("'1'", "this release understands formats 0 to 1"),
    ],
)
@pytest.mark.parametrize("kind", ["scenario", "robot"])
def test_an_unknown_number_is_refused_in_one_line(kind: str, number: str, understood: str, tmp_path: Path) -> None:
    path = tmp_path / "newer.yaml"
    shipped = scenario_directory() / "middle.yaml" if kind == "scenario" else robot_path("dextar")
    # before anything else in the file, which a newer release may have changed altogether
    path.write_text(shipped.read_text().replace("format: 1", f"format: {number}\nheadings: {{}}"), encoding="utf-8")
    for command in (("map", path) if kind == "robot" else ("simulate", path), ("migrate", path)):
        if command[0] == "migrate":
            path.write_text(path.read_text(encoding="utf-8") + "\n", encoding="utf-8")
        before = path.read_bytes()
        assert fivebar_command(*command) == (BAD_INPUT, "", f"fivebar: {path}: format: {number}: {understood}\n")
        assert path.read_bytes() == before


def test_migrate_leaves_alone_what_it_does_not_understand(old: Path) -> None:
    for text, words in (
        (
            "a: 1\n",
            "expected a scenario, which has waypoints, a robot file, which has lengths_m, or a program with steps",
        ),
        (FORMAT_0.replace("seed", "sead"), "plant.sead: unknown key"),
        (FORMAT_1, "format: 1: --from 0 says otherwise"),
    ):
        old.write_text(text, encoding="utf-8")
        status, _, error = fivebar_command("migrate", old, "--from", 0)
        assert (status, error) == (BAD_INPUT, f"fivebar: {old}: {words}\n")
        assert old.read_text(encoding="utf-8") == text


def test_a_robot_file_is_migrated_too(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text(robot_path("dextar").read_text().replace("format: 1\n", "").replace("l_11: 0.09 ", "l_11: 1_0e-2 "))
    before = path.read_text()
    assert fivebar_command("migrate", path, "--from", 0)[0] == BAD_INPUT
    assert path.read_text() == before
    path.write_text(robot_path("dextar").read_text().replace("format: 1", "format: 0"))
    assert fivebar_command("migrate", path)[0] == 0
    assert path.read_text() == robot_path("dextar").read_text()


def test_a_program_is_migrated_too(tmp_path: Path) -> None:
    path = tmp_path / "work.yaml"
    path.write_text("# what to do\nname: work\nsteps:\n- dwell: 1.0   # s\n", encoding="utf-8")
    assert fivebar_command("migrate", path)[0] == 0
    assert path.read_text() == "# what to do\nformat: 1\nname: work\nsteps:\n- dwell: 1.0   # s\n"


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
    """As runs before format 1 saved it: with every default written out, and no number."""
    saved, scenario = tmp_path / "scenario.yaml", load_scenario("gyro_middle")
    saved.write_text(scenario.to_yaml().replace("format: 1\n", "", 1), encoding="utf-8")
    assert load_scenario(str(saved)) == scenario


@pytest.mark.parametrize("name", ["scenario.schema.json", "robot.schema.json", "program.schema.json"])
def test_the_published_schemas_are_those_of_the_models(name: str) -> None:
    text = (REFERENCE / name).read_text(encoding="utf-8")
    assert text == schemas()[name], "stale: .venv/bin/python -m fivebar_bringup.file_schemas docs/reference"
    assert json.loads(text)["properties"]["format"]["const"] == NEWEST
