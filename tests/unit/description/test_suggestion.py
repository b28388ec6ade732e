# SPDX-License-Identifier: Apache-2.0
"""Names that may be meant by ones that do not exist, in options, keys, choices and names of files."""

from __future__ import annotations

from pathlib import Path

import pytest

from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_control.laws.registry import controller_problem
from fivebar_control.planning.program import load_program
from fivebar_description.errors import InputError
from fivebar_description.robot_file import read_robot
from fivebar_description.scenario_file import scenario_path
from fivebar_description.suggestion import did_you_mean, keys_at

GOOD = "name: mine\nwaypoints: [[0.0, 0.15], [0.0, 0.02]]\nsegment_duration: 1.0\n"


@pytest.mark.parametrize(
    ("name", "found"), [("lenght", "length"), ("MASS", "mass"), ("mas", "mass"), ("nothing", ""), ("", ""), (3, "")]
)
def test_a_name_is_proposed_only_where_one_is_like_it(name: object, found: str) -> None:
    assert did_you_mean(name, ["length", "mass"]) == (f" (did you mean {found}?)" if found else "")


def test_keys_are_found_through_references_lists_and_alternatives() -> None:
    schema = {
        "properties": {"one": {"$ref": "#/$defs/One"}, "many": {"type": "array", "items": {"$ref": "#/$defs/One"}}},
        "$defs": {"One": {"anyOf": [{"properties": {"a": {}}}, {"properties": {"b": {}}}, {"type": "null"}]}},
    }
    assert keys_at(schema, []) == {"one", "many"}
    assert keys_at(schema, ["one"]) == keys_at(schema, ["many", "3"]) == {"a", "b"}
    assert keys_at(schema, ["one", "a"]) == keys_at(schema, ["none"]) == set()


@pytest.mark.parametrize(
    ("line", "meant"),
    [
        ("wapoints: []", "waypoints"),
        ("plant: {mass_scal: 1.0}", "mass_scale"),
        ("safety: {torque_limt: 1.0}", "torque_limit"),
        ("time_law: quintik", "quintic"),
        ("zone: {rule: fixd}", "fixed"),
        ("controller: unifid", "unified"),
        ("robot: dextr", "dextar"),
    ],
)
def test_a_slip_in_a_scenario_is_answered_with_what_is_meant(line: str, meant: str, tmp_path: Path) -> None:
    file = tmp_path / "mine.yaml"
    file.write_text(GOOD + line, encoding="utf-8")
    with pytest.raises(InputError, match=rf"did you mean {meant}\?"):
        load_scenario(str(file)).five_bar()


def test_a_slip_in_the_name_of_a_file_or_a_key_of_another_file_is_too(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"did you mean middle\?"):
        scenario_path("midle")
    with pytest.raises(InputError, match=r"did you mean unequal\?"):
        read_robot("unequel")
    assert "did you mean multi_joint?" in str(controller_problem("multi_joints"))
    file = tmp_path / "program.yaml"
    file.write_text("name: mine\nsteps: [{move: [0.0, 0.1], duraton: 1.0}]\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"did you mean duration\?"):
        load_program(file)
