# SPDX-License-Identifier: Apache-2.0
"""A scenario is checked as a whole when it is loaded, before any process is started: the plant, too."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
import yaml

from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_description.robot_file import load_robot, read_robot, robot_path
from fivebar_description.scenario_file import read_content
from fivebar_description.strict_yaml import InputError


def loaded(folder: Path, **sections: Any) -> None:
    """Load a crossing with these sections."""
    content = {"name": "any", "controller": "unified", "waypoints": [[0.0, 0.1], [0.0, 0.02]], **sections}
    path = folder / "any.yaml"
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    load_scenario(str(path))


@pytest.mark.parametrize("engine", ["pinocchio", "mujoco"])
@pytest.mark.parametrize(
    ("effects", "refusal"),
    [
        (
            {"transmission": {"backlash": 1e-3}},
            "plant.transmission.backlash: 1 mrad: backlash needs a transmission frequency: expected"
            " plant.transmission.frequency above 0, say 300 (Hz)",
        ),
        ({"links": {"distal_inertia": -0.1}}, "plant.links.distal_inertia: -0.1 kg m^2 leaves a leg without positive"),
        (
            {"links": {"l_12": -0.01, "l_22": -0.01}},
            "with the actual lengths the legs do not meet where the motors are: expected smaller errors in plant.links,"
            " or a start farther from the Type 2 locus",
        ),
    ],
)
def test_a_plant_that_cannot_be_is_refused_by_file_and_key(
    tmp_path: Path, engine: str, effects: dict[str, Any], refusal: str
) -> None:
    with pytest.raises(InputError) as refused:
        loaded(tmp_path, plant={"engine": engine, **effects})
    assert str(refused.value).startswith(f"{tmp_path / 'any.yaml'}: ")
    assert refusal in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_joint_with_clearance_needs_a_stiffness(tmp_path: Path) -> None:
    """MuJoCo's robot has no clearance at all."""
    joint = {"clearance": 1e-5}
    with pytest.raises(InputError, match=r"plant\.platform_joint\.clearance: 1e-05: a joint that touches needs a"):
        loaded(tmp_path, plant={"platform_joint": joint})
    loaded(tmp_path, plant={"platform_joint": {**joint, "stiffness": 1e6}})
    with pytest.raises(InputError, match=r"plant\.platform_joint\.clearance: 1e-05: MuJoCo's robot does not have this"):
        loaded(tmp_path, plant={"platform_joint": {**joint, "stiffness": 1e6}, "engine": "mujoco"})


def test_a_platform_too_light_for_its_links_is_refused(tmp_path: Path) -> None:
    """The distal links of the bench have less inertia than two point masses: some of its platform's mass is theirs."""
    bench = {"robot": "motkin", "waypoints": [[0.0, 0.12], [0.0, 0.0]]}
    with pytest.raises(
        InputError, match=r"plant\.mass_scale: 0\.1, plant\.inertia_scale: 1: .*no bodies have these param"
    ):
        loaded(tmp_path, **bench, plant={"mass_scale": 0.1})
    loaded(tmp_path, **bench, plant={"mass_scale": 0.5})


@pytest.mark.parametrize(
    ("sections", "refusal"),
    [
        ({"segment_duration": 5e-324}, "segment_duration: 5e-324: expected at least 0.0001"),
        ({"segment_duration": [1e-300]}, "segment_duration.0: 1e-300: expected at least 0.0001"),
        ({"segment_duration": "1,5"}, "segment_duration: '1,5': expected a number or a list, with a point in place of"),
        ({"plant": {"friction": {"presliding": 5e-324}}}, "presliding: 5e-324: expected 0, or at least 1e-09 rad"),
    ],
)
def test_numbers_at_the_edge_of_what_floats_hold_are_refused(
    tmp_path: Path, sections: dict[str, Any], refusal: str
) -> None:
    with pytest.raises(InputError, match=re.escape(refusal)):
        loaded(tmp_path, **sections)


def test_a_robot_file_and_a_scenario_in_place_of_each_other_are_told_apart(tmp_path: Path) -> None:
    robot, scenario = tmp_path / "arm.yaml", tmp_path / "motion.yaml"
    robot.write_text(robot_path("dextar").read_text(encoding="utf-8"), encoding="utf-8")
    scenario.write_text("name: motion\nrobot: arm.yaml\nwaypoints: [[0.0, 0.15], [0.0, 0.1]]\n", encoding="utf-8")
    for read in (load_scenario, lambda path: read_content(Path(path))):
        with pytest.raises(InputError) as refused:
            read(str(robot))
        assert str(refused.value) == (
            f"{robot}: is a robot file: expected a scenario; `fivebar goto X Y --robot {robot}` makes one of a motion"
        )
    with pytest.raises(InputError) as refused:
        read_robot(str(scenario))
    assert str(refused.value) == f"{scenario}: is a scenario: expected a robot file; arm.yaml is the scenario's robot"
    assert load_scenario(str(scenario)).five_bar() == load_robot("dextar")
