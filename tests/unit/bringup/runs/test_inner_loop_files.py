# SPDX-License-Identifier: Apache-2.0
"""The bridge's file and node of a run whose motor board closes an inner loop."""

from __future__ import annotations

from pathlib import Path

from fivebar_bringup.drives.choice import write_drive_files
from fivebar_bringup.graph.robot_nodes import bridge
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_description.interface import JOINT_STATES, REFERENCE
from fivebar_motkin.board_file import load_board


def test_a_run_takes_gains_from_the_named_file_and_the_zone_from_its_plan(tmp_path: Path) -> None:
    scenario = load_scenario("motkin_middle")
    drives = str(write_drive_files(scenario, tmp_path, "motkin_inner_loop").drives)
    loop = load_board(drives).inner_loop
    assert (loop.stiffness, loop.damping) == (1.0, 0.03)
    assert (loop.robot, loop.epsilon) == ("motkin", max(one.epsilon for one in scenario.plan().crossings))
    assert {REFERENCE, JOINT_STATES} <= set(bridge(scenario, drives, ()).subscribes)
    plain = str(write_drive_files(scenario, tmp_path).drives)
    assert not load_board(plain).inner_loop.on
    assert not {REFERENCE, JOINT_STATES} & set(bridge(scenario, plain, ()).subscribes)
