"""By what the node that takes requests, and whoever plans the same ones, judges them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from fivebar_bringup.graph.crossing_graph import crossing_graph
from fivebar_bringup.graph.node_spec import Mode
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_control.laws.unified import UnifiedSettings
from fivebar_control.planning.planning_process import Conditions
from fivebar_control.ros.goal_conditions import conditions_of
from fivebar_control.safety.stages import EVERYWHERE, Area
from fivebar_description.loads import Loads
from fivebar_description.passive_encoder import PassiveEncoder, Sensors
from fivebar_description.robot_file import read_robot
from fivebar_description.tolerances import Tolerances


def conditions_in(scenario: Scenario, directory: Path) -> Conditions:
    """Return by what the run of a scenario judges requests."""
    (values,) = (
        node.parameters
        for node in crossing_graph(scenario, Mode.LOCKSTEP, directory)
        if node.executable == "trajectory_generator"
    )
    return conditions_of(values)


def test_they_are_what_the_scenario_declares(tmp_path: Path) -> None:
    scenario = load_scenario("unified_middle").model_copy(
        update={
            "estimator": "ekf",
            "sensors": Sensors(PassiveEncoder(leg=2, counts=4000)),
            "loads": Loads(tilt=0.02, push=0.3),
            "tolerances": Tolerances(length=2e-5),
        }
    )
    conditions = conditions_in(scenario, tmp_path)
    assert (conditions.robot, conditions.rate_hz) == (scenario.robot, scenario.rate_hz)
    assert conditions.error_tolerance == scenario.error_tolerance
    assert conditions.loads == Loads(tilt=0.02, push=0.3)
    assert conditions.sensing == scenario.sensing()


def test_they_hold_what_stops_the_robot(tmp_path: Path) -> None:
    scenario = load_scenario("unified_middle")
    usual = conditions_in(scenario, tmp_path)
    assert (usual.workspace, usual.forbidden) == (EVERYWHERE, ())
    area, strip = Area(-0.1, 0.1, 0.0, 0.2), (-0.1, 0.1, 0.0, 0.01, -3.0, 3.0, -3.0, 3.0)
    safety = scenario.safety._replace(workspace=area, forbidden=strip)
    kept = conditions_in(scenario.model_copy(update={"safety": safety, "tracking_error_limit": 0.003}), tmp_path)
    assert (kept.workspace, kept.forbidden, kept.tracking_error_limit) == (area, strip, 0.003)


@pytest.mark.parametrize(
    ("controller", "changed"),
    [("unified", {"unified": UnifiedSettings(kp=900.0, kd=60.0)}), ("mpc", {"law": {"horizon": 31}})],
)
def test_they_have_the_controller_of_the_run(tmp_path: Path, controller: str, changed: dict[str, Any]) -> None:
    scenario = load_scenario("unified_middle").model_copy(update={"controller": controller, **changed})
    conditions = conditions_in(scenario, tmp_path)
    assert conditions.follower(read_robot(scenario.robot)) == scenario.tuned()


def test_a_sample_waits_for_a_plan_in_lockstep_alone(tmp_path: Path) -> None:
    waits = {
        mode: [
            node.parameters["goal_wait_ms"]
            for node in crossing_graph(load_scenario("unified_middle"), mode, tmp_path)
            if "goal_wait_ms" in node.parameters
        ]
        for mode in Mode
    }
    assert waits == {Mode.LOCKSTEP: [100.0], Mode.REALTIME: [0.0]}
