# SPDX-License-Identifier: Apache-2.0
"""The law without switching as a node graph and without ROS, to the last bit: through Type 2 and Type 1, disturbed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from bag_contents import contents
from fivebar_command import FivebarCommand

from fivebar_bringup.bag.reader import read_bag
from fivebar_bringup.bag.recording import Recording
from fivebar_description.interface import (
    JOINT_STATES,
    REFERENCE,
    SUPERVISOR_STATE,
    TORQUE_COMMAND,
    UNIFIED_TORQUE,
    Topic,
)

SCENARIO = """
name: short_unified
controller: unified
waypoints: [[0.0, 0.15], [0.0, 0.02], [0.0, 0.15], [0.03, 0.13]]
working_modes: [[1, -1], [1, -1], [1, -1], [-1, -1]]
segment_duration: 0.4
plant: {friction_scale: 1.3, mass_scale: 0.9, torque_limit: 2.0}
unified: {observer_rate: 60.0, disturbance_limit: 0.4}
"""
SAMPLES = 601

# other runs of the graph have this law, and the engine is compared with the offline runner through Type 1 as well
pytestmark = pytest.mark.extra

STAMPED = (JOINT_STATES, REFERENCE, UNIFIED_TORQUE, SUPERVISOR_STATE, TORQUE_COMMAND)


@pytest.fixture(scope="module")
def bags(fivebar: Callable[..., FivebarCommand], folder: Path) -> tuple[Recording, Recording]:
    scenario = folder / "short_unified.yaml"
    scenario.write_text(SCENARIO, encoding="utf-8")
    bags = []
    for command in ("run", "simulate"):
        out = folder / f"unified_{command}"
        call = fivebar(command, str(scenario), "--json", "--out", str(out))
        assert call.finish() == 0, call.stderr
        summary = call.json()
        assert summary["outcome"] == "succeeded", summary["not_completed_because"]
        assert (summary["assembly_mode_changes"], summary["working_mode_changes"]) == (2, 1)
        bags.append(read_bag(out / "bag"))
    return bags[0], bags[1]


@pytest.mark.parametrize("topic", STAMPED, ids=lambda topic: topic.name)
def test_every_stamped_message_is_equal(bags: tuple[Recording, Recording], topic: Topic) -> None:
    ros, offline = bags
    assert contents(ros, topic) == contents(offline, topic)
    assert len(contents(ros, topic)) >= SAMPLES
