# SPDX-License-Identifier: Apache-2.0
"""By what the node that takes requests, and whoever plans the same ones, judges them."""

from __future__ import annotations

from typing import Any

import pytest
from generator_parameters import generator_parameters

from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_control.laws.gains import UnifiedSettings
from fivebar_control.planning.order_planning import follower_of, task_of
from fivebar_control.planning.orders import PlanningRequest
from fivebar_control.safety.settings import EVERYWHERE, Area
from fivebar_control.scenario.goal_conditions import conditions_of
from fivebar_control.scenario.guard_settings import forbidden_postures
from fivebar_control.scenario.law_settings import tuned_controller
from fivebar_control.scenario.motion_limits import scenario_limits
from fivebar_control.scenario.parameters import scenario_of
from fivebar_control.scenario.sensors import sensing_if_estimated
from fivebar_control.trajectory.path_distance import PATH
from fivebar_description.loads import Loads
from fivebar_description.robot_file import read_robot
from fivebar_description.scenario_file import shipped_scenarios
from fivebar_description.sensors import PassiveEncoder, Sensors
from fivebar_description.tolerances import Tolerances
from fivebar_studies.sweep.drawing import draw
from fivebar_studies.sweep.planning import limits_for


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
    assert conditions.sensing == sensing_if_estimated(scenario)


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
    assert follower_of(conditions, read_robot(scenario.robot)) == tuned_controller(scenario)


@pytest.mark.extra
@pytest.mark.parametrize("name", shipped_scenarios())
def test_whoever_asks_the_node_for_its_parameters_judges_as_it_does(name: str) -> None:
    """As the live page does, which shows what would become of a request."""
    scenario = load_scenario(name)
    values = {"scenario": name, "mode": "lockstep", **generator_parameters(scenario)}
    assert all(isinstance(value, str | bool | int | float | list) and value != [] for value in values.values())
    again = scenario_of(values)
    assert conditions_of(again) == conditions_of(scenario)
    assert again.plan() == scenario.plan()


def test_every_planner_has_the_limits_of_its_scenario() -> None:
    """Goals, given motions, cases of a sweep, requests: what judges, loads, forbidden postures, workspace in all."""
    area, strip = Area(-0.1, 0.1, 0.0, 0.2), (-0.1, 0.1, 0.0, 0.01, -3.0, 3.0, -3.0, 3.0)
    scenario = load_scenario("unified_middle")
    safety = scenario.safety._replace(workspace=area, forbidden=strip, joint_speed_limit=20.0)
    scenario = scenario.model_copy(
        update={
            "safety": safety,
            "loads": Loads(push=0.3),
            "tracking_error_limit": 3e-4,
            "error_tolerance": 0.004,
            "judge": PATH,
        }
    )
    case = draw(1, 0, "ideal")
    requested = task_of(conditions_of(scenario), PlanningRequest((0.0, 0.15), (1, -1), (0.0, 0.12), 0, 0.0))
    for limits in (
        requested.limits,
        scenario_limits(scenario),
        scenario_limits(scenario, scenario.plan()),
        limits_for(case, scenario),
        limits_for(case._replace(encoder_counts=20_000), scenario),
    ):
        assert (limits.workspace, limits.forbidden) == (area, forbidden_postures(scenario))
        assert (limits.loads, limits.motor_speed) == (Loads(push=0.3), 20.0)
        assert (limits.predicted_error, limits.tracking_error, limits.error_tolerance) == (3e-4, 3e-4, 0.004)
        assert limits.judge == PATH
    assert len(forbidden_postures(scenario)) == 1


def test_a_given_motion_that_cannot_be_predicted_keeps_the_limits_of_a_chosen_one() -> None:
    scenario = load_scenario("type1_boundary")
    plan = scenario.plan()
    assert plan.modes and scenario_limits(scenario, plan) == scenario_limits(scenario)
