"""By what the node that takes requests, and whoever plans the same ones, judges them."""

from __future__ import annotations

from pathlib import Path

from fivebar_bringup.runs.graph.crossing_graph import crossing_graph
from fivebar_bringup.runs.graph.node_spec import Mode
from fivebar_bringup.scenario_files import load_scenario
from fivebar_control.ros.goal_conditions import conditions_of
from fivebar_description.loads import Loads
from fivebar_description.passive_encoder import PassiveEncoder, Sensors
from fivebar_description.tolerances import Tolerances


def test_they_are_what_the_scenario_declares(tmp_path: Path) -> None:
    scenario = load_scenario("unified_middle").model_copy(
        update={
            "estimator": "ekf",
            "sensors": Sensors(PassiveEncoder(leg=2, counts=4000)),
            "loads": Loads(tilt=0.02, push=0.3),
            "tolerances": Tolerances(length=2e-5),
        }
    )
    (values,) = (
        node.parameters
        for node in crossing_graph(scenario, Mode.LOCKSTEP, tmp_path)
        if node.executable == "trajectory_generator"
    )
    conditions = conditions_of(values)
    assert (conditions.robot, conditions.rate_hz) == (scenario.robot, scenario.rate_hz)
    assert conditions.error_tolerance == scenario.error_tolerance
    assert conditions.loads == Loads(tilt=0.02, push=0.3)
    assert conditions.sensing == scenario.sensing()


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
