# SPDX-License-Identifier: Apache-2.0
"""A loop of one's own over controller and plant gives the torques of `fivebar simulate`, to the last bit."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fivebar
from fivebar_bringup.bag.reader import read_bag
from fivebar_bringup.runs.offline import run_offline
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_description.interface import TORQUE_COMMAND
from fivebar_description.scenario_file import shipped_scenarios

QUICK = ("middle_robot", "multi_model_criterion")
"""Those that take less than a second: motors' encoders with a delay, and all joints."""


def stepped(name: str) -> list[tuple[float, float]]:
    """The torques of the loop that a user writes, up to where the robot can be moved no further."""
    control, plant = fivebar.Controller(name), fivebar.Plant(name)
    readings, torques = plant.reset(), []
    while not control.finished:
        command = control.step(readings)
        torques.append(tuple(command.torque))
        try:
            readings = plant.step(command.torque)
        except fivebar.PlantDiverged:
            break
    return torques


def marked(name: str) -> Any:
    return pytest.param(name, marks=[] if name in QUICK else [pytest.mark.extra])


@pytest.mark.parametrize("name", [marked(name) for name in shipped_scenarios()])
def test_the_loop_has_the_torques_of_the_bag(name: str, tmp_path: Path) -> None:
    run, _ = run_offline(load_scenario(name), tmp_path / "run", lambda done, total: None, with_page=False)
    # the last message is the zero torque of a blender that is stopped
    recorded = read_bag(run.bag).field(TORQUE_COMMAND, "effort")[:-1]
    torques = np.array(stepped(name))
    assert torques.shape == recorded.shape and torques.tobytes() == recorded.tobytes()


def test_a_plant_that_is_reset_repeats_its_readings_and_another_seed_gives_others() -> None:
    plant = fivebar.Plant("gyro_middle")
    first = [plant.reset(), *(plant.step((0.1, -0.1)) for _ in range(20))]
    assert [plant.reset(), *(plant.step((0.1, -0.1)) for _ in range(20))] == first
    other = fivebar.Plant("gyro_middle", seed=load_scenario("gyro_middle").plant.seed + 1)
    assert [other.reset(), *(other.step((0.1, -0.1)) for _ in range(20))] != first


def test_mujoco_moves_the_same_robot_by_nearly_the_same_way() -> None:
    pytest.importorskip("mujoco")
    plants = fivebar.Plant("unified_middle"), fivebar.Plant("unified_middle", engine="mujoco")
    ends = []
    for plant in plants:
        plant.reset()
        for _ in range(50):
            plant.step((0.3, 0.1))
        ends.append(plant.truth.position)
    assert ends[0] != ends[1] and ends[1] == pytest.approx(ends[0], abs=1e-5)
    assert abs(ends[0][0] - plants[0].reset().joint_angles[0]) > 1e-3
