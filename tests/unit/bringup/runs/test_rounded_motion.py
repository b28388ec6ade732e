# SPDX-License-Identifier: Apache-2.0
"""A path with rounded corners as the nodes get it: the plan of the scenario."""

from __future__ import annotations

import pytest
from generator_parameters import generator_parameters

from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_control.scenario.parameters import scenario_of
from fivebar_description.strict_yaml import InputError, validate


@pytest.mark.parametrize("radius", [0.02, [0.0, 0.01]])
def test_the_nodes_plan_the_path_of_the_scenario(radius: float | list[float]) -> None:
    path = {"waypoints": [[0.0, 0.15], [-0.03, 0.02], [0.03, 0.02], [0.0, 0.15]], "blend_radius": radius}
    scenario = Scenario.model_validate({"name": "vias", "controller": "unified", **path})
    planned = scenario_of(generator_parameters(scenario)).plan()
    assert planned.crossings == scenario.plan().crossings
    assert len(planned.path.segments) == (1 if radius == 0.02 else 2)


@pytest.mark.parametrize("radius", [-0.01, 0.0005, [0.02, 1e9, -1.0], []])
def test_an_impossible_radius_is_refused_with_its_key(radius: float | list[float]) -> None:
    content = load_scenario("multiple").model_dump(mode="json") | {"blend_radius": radius}
    with pytest.raises(InputError, match=r"blend_radius.*expected 0 for a rest, or at least 0\.001 m"):
        validate(content, Scenario, "file.yaml")


def test_a_motion_that_may_meet_type_1_rests_at_each_waypoint() -> None:
    content = load_scenario("type1_working_mode").model_dump(mode="json") | {"blend_radius": 0.01}
    with pytest.raises(InputError, match="blend_radius: a motion with working_modes rests at each waypoint"):
        validate(content, Scenario, "file.yaml")
