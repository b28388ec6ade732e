# SPDX-License-Identifier: Apache-2.0
"""Programs on emulated drives: the robot goes on after the plan of the run, and a payload needs one that carries it."""

from __future__ import annotations

from pathlib import Path

import pytest

from fivebar_bringup.drives.choice import write_drive_files
from fivebar_bringup.drives.run_files import Rehearsal
from fivebar_bringup.graph.crossing_graph import Work
from fivebar_bringup.graph.node_spec import EMULATED_ROBOT, PLANT, Mode, NodeSpec
from fivebar_bringup.graph.standing import LONGEST
from fivebar_bringup.motions.program import refuse_payload
from fivebar_bringup.motions.stand import standing_graph
from fivebar_bringup.recorded.run_directory import RunDirectory
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_control.planning.program import read_program
from fivebar_description.interface import PAYLOAD
from fivebar_description.strict_yaml import InputError

CARRIES = read_program("name: work\nsteps:\n- move: [0.0, 0.1]\n- pick: 0.1\n", "work.yaml")


def test_the_emulated_robot_goes_on_after_the_plan(tmp_path: Path) -> None:
    scenario = load_scenario("middle_robot").model_copy(update={"controller": "unified"})
    rehearsal = Rehearsal(write_drive_files(scenario, tmp_path))
    nodes = standing_graph(scenario, Mode.REALTIME, RunDirectory(tmp_path), LONGEST, Work(), rehearsal)
    (robot,) = (node for node in nodes if node.executable == EMULATED_ROBOT)
    assert robot.parameters["samples"] == LONGEST
    assert PLANT not in {node.executable for node in nodes}


def test_a_payload_is_refused_by_a_robot_that_knows_of_none() -> None:
    without, carrying = (NodeSpec("fivebar_sim", EMULATED_ROBOT, {}, topics, ()) for topics in ((), (PAYLOAD,)))
    refuse_payload(CARRIES, [carrying])
    with pytest.raises(InputError, match=r"work: step 2 \(line 4\): emulated_robot carries no payload"):
        refuse_payload(CARRIES, [without])
