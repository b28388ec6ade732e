"""What a recorder gets as bundles: all that the nodes of one process publish in a cycle, and nothing else."""

from __future__ import annotations

from pathlib import Path

import pytest

from fivebar_bringup.runs.graph.crossing_graph import crossing_graph
from fivebar_bringup.runs.graph.node_spec import RECORDER, Mode
from fivebar_bringup.runs.processes import processes
from fivebar_bringup.scenario import load_scenario


def bundled(mode: Mode, composed: bool) -> set[str]:
    scenario = load_scenario("middle_encoders")
    nodes = crossing_graph(scenario, mode, Path("bag"))
    specs = {spec.name: spec for spec in processes(nodes, mode, scenario.rate_hz, composed=composed)}
    # ROS has no empty list of strings
    return set(specs[RECORDER].nodes[0].parameters["bundled"]) - {""}


def test_the_control_chain_of_one_process_is_recorded_by_bundles() -> None:
    assert bundled(Mode.REALTIME, composed=True) == {
        "joint_states",
        "estimate/covariance",
        "estimate/disturbance",
        "reference",
        "supervisor/state",
        "supervisor/sigma",
        "ctc/torque",
        "vhc/torque",
        "torque_requested",
        "torque_command",
    }


@pytest.mark.parametrize("mode", list(Mode))
def test_nodes_of_their_own_are_recorded_topic_by_topic(mode: Mode) -> None:
    assert bundled(mode, composed=False) == set()
