"""By what the node that takes requests, and whoever plans the same ones, judges them."""

from __future__ import annotations

from typing import Any

import pytest
from generator_parameters import generator_parameters

from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_control.laws.unified import UnifiedSettings
from fivebar_control.safety.stages import EVERYWHERE, Area
from fivebar_control.scenario.goal_conditions import conditions_of
from fivebar_control.scenario.keys import scenario_of
from fivebar_description.loads import Loads
from fivebar_description.passive_encoder import PassiveEncoder, Sensors
from fivebar_description.robot_file import read_robot
from fivebar_description.scenario_file import shipped_scenarios
from fivebar_description.tolerances import Tolerances


def test_they_are_what_the_scenario_declares() -> None:
    scenario = load_scenario("unified_middle").model_copy(
        update={
            "estimator": "ekf",
            "sensors": Sensors(PassiveEncoder(leg=2, counts=4000)),
            "loads": Loads(tilt=0.02, push=0.3),
            "tolerances": Tolerances(length=2e-5),
        }
    )
    conditions = conditions_of(scenario)
    assert (conditions.robot, conditions.rate_hz) == (scenario.robot, scenario.rate_hz)
    assert conditions.error_tolerance == scenario.error_tolerance
    assert conditions.loads == Loads(tilt=0.02, push=0.3)
    assert conditions.sensing == scenario.sensing()


def test_they_hold_what_stops_the_robot() -> None:
    scenario = load_scenario("unified_middle")
    usual = conditions_of(scenario)
    assert (usual.workspace, usual.forbidden) == (EVERYWHERE, ())
    area, strip = Area(-0.1, 0.1, 0.0, 0.2), (-0.1, 0.1, 0.0, 0.01, -3.0, 3.0, -3.0, 3.0)
    safety = scenario.safety._replace(workspace=area, forbidden=strip)
    kept = conditions_of(scenario.model_copy(update={"safety": safety, "tracking_error_limit": 0.003}))
    assert (kept.workspace, kept.forbidden, kept.tracking_error_limit) == (area, strip, 0.003)


@pytest.mark.parametrize(
    ("controller", "changed"),
    [("unified", {"unified": UnifiedSettings(kp=900.0, kd=60.0)}), ("mpc", {"law": {"horizon": 31}})],
)
def test_they_have_the_controller_of_the_run(controller: str, changed: dict[str, Any]) -> None:
    scenario = load_scenario("unified_middle").model_copy(update={"controller": controller, **changed})
    conditions = conditions_of(scenario)
    assert conditions.follower(read_robot(scenario.robot)) == scenario.tuned()


@pytest.mark.parametrize("name", shipped_scenarios())
def test_whoever_asks_the_node_for_its_parameters_judges_as_it_does(name: str) -> None:
    """As the live page does, which shows what would become of a request."""
    scenario = load_scenario(name)
    values = {"scenario": name, "mode": "lockstep", **generator_parameters(scenario)}
    assert all(isinstance(value, str | bool | int | float | list) and value != [] for value in values.values())
    again = scenario_of(values)
    assert conditions_of(again) == conditions_of(scenario)
    assert again.plan() == scenario.plan()
