# SPDX-License-Identifier: Apache-2.0
"""A payload on the platform: the plants go on as a robot with that mass does."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import can
import numpy as np
import pytest
from bench_robot import emulation_content
from emulation_file import load_emulation

from fivebar_control.model.geometry import inverse_geometry
from fivebar_description.parameters import FiveBar, laden
from fivebar_description.robot_file import load_robot
from fivebar_motkin_emulation.board import EmulatedBoard
from fivebar_motkin_emulation.configuration import BoardEmulationFile
from fivebar_sim.drives.emulation import Emulation
from fivebar_sim.effects.friction import FrictionEffects
from fivebar_sim.effects.settings import MUJOCO, PlantSettings
from fivebar_sim.moved_robot import MovedRobot
from fivebar_sim.plant import Plant

PLANTS = {
    "pinocchio": PlantSettings(),
    "effects": PlantSettings(friction=FrictionEffects(passive=0.01)),
    "mujoco": PlantSettings(engine=MUJOCO),
}

START = tuple(inverse_geometry(load_robot("motkin_vertical"), (1, -1), 0.0, 0.12))


@pytest.mark.parametrize("settings", PLANTS.values(), ids=list(PLANTS))
def test_a_plant_goes_on_with_the_mass_that_it_is_given(settings: PlantSettings, dextar: FiveBar) -> None:
    home = tuple(inverse_geometry(dextar, (1, -1), 0.0, 0.13))
    heavy = laden(dextar, 0.5)
    assert heavy.mass == dextar.mass + 0.5
    empty, loaded, wanted = (Plant(robot, home, 500, settings) for robot in (dextar, dextar, heavy))
    loaded.carry(heavy)
    for _ in range(10):
        for plant in (empty, loaded, wanted):
            plant.advance((0.6, -0.4))
    np.testing.assert_allclose(loaded.joints, wanted.joints, rtol=0.0, atol=1e-12)
    assert np.abs(empty.joints - wanted.joints).max() > 1e-5
    # put down again while it moves: what it has of speed it keeps
    speeds = loaded.joint_velocities
    loaded.carry(dextar)
    np.testing.assert_array_equal(loaded.joint_velocities, speeds)


@pytest.fixture(params=["board", "drives"])
def emulated(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[EmulatedBoard | Emulation]:
    if request.param == "board":
        yield EmulatedBoard(BoardEmulationFile.model_validate(emulation_content(tmp_path), strict=False), 0.0)
        return
    with can.Bus(interface="virtual", channel="payload") as bus:
        yield Emulation(load_emulation("dextar_emulated"), bus)


def test_the_robot_on_emulated_hardware_carries_a_payload_and_keeps_it_at_home(
    emulated: EmulatedBoard | Emulation,
) -> None:
    def pushed() -> np.ndarray:
        start = emulated.plant.joints
        for _ in range(5):
            emulated.plant.advance((0.9, -0.9))
        return emulated.plant.joints - start

    empty = pushed()
    emulated.carry(0.5)
    emulated.go_home()
    loaded = pushed()
    assert np.abs(loaded).max() < 0.9 * np.abs(empty).max()
    emulated.carry(0.0)
    emulated.go_home()
    np.testing.assert_array_equal(pushed(), empty)


def test_an_upright_robot_is_held_until_it_has_torque_and_then_falls_without() -> None:
    file = load_emulation("dextar_emulated")
    upright = MovedRobot(file.model_copy(update={"robot": "motkin_vertical", "initial_joints": START}), 500)

    def fallen() -> float:
        start = upright.plant.joints
        for _ in range(50):
            upright.move((0.0, 0.0))
        return float(np.abs(upright.plant.joints - start).max())

    assert fallen() == 0.0
    upright.move((1e-3, 0.0))
    assert fallen() > 0.01
    upright.go_home()
    assert fallen() == 0.0
