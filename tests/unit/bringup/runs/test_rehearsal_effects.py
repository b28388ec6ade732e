# SPDX-License-Identifier: Apache-2.0
"""The emulated drives move the robot that a scenario describes, with its effects."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import can
import pytest
from emulation_file import load_emulation

from fivebar_bringup.drives.choice import write_drive_files
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_sim.drives.emulation import SYNC_ID, Emulation
from fivebar_sim.effects.settings import has_effects
from fivebar_sim.emulation_file import NOT_EFFECTS

EFFECTS: dict[str, Any] = {
    "encoders": {"zero_1": 3e-3, "zero_2": -2e-3},
    "transmission": {"frequency": 60.0},
    "tilt": {"angle": 0.3, "heading": 0.2},
    "seed": 5,
}


def scenario(effects: dict[str, Any]) -> Scenario:
    content = load_scenario("middle_encoders").model_dump(mode="json")
    content["plant"] |= effects
    return Scenario.model_validate(content)


def test_the_emulation_has_the_effects_of_the_scenario(tmp_path: Path) -> None:
    given = scenario({**EFFECTS, "engine": "mujoco"})
    plant = load_emulation(str(write_drive_files(given, tmp_path).emulation)).plant()
    assert has_effects(plant)
    assert plant == given.plant._replace(
        torque_limit=None, encoder_counts=None, delay_samples=0, torque_quantum=plant.torque_quantum
    )
    assert "seed" not in NOT_EFFECTS and "mass_scale" in NOT_EFFECTS


def test_a_file_without_effects_says_nothing_of_them(tmp_path: Path) -> None:
    file = write_drive_files(scenario({}), tmp_path).emulation
    assert "effects" not in file.read_text(encoding="utf-8")
    assert not has_effects(load_emulation(str(file)).plant())


def test_emulated_encoders_read_the_rotors(tmp_path: Path) -> None:
    file = load_emulation(str(write_drive_files(scenario(EFFECTS), tmp_path).emulation))
    with can.Bus(interface="virtual", channel="effects") as bus:
        emulation = Emulation(file, bus)
        count = 2.0 * math.pi / file.pair[0].counts_per_revolution
        # at the start the encoders read the posture of the file, which the links are not in
        assert emulation.drives[0].angle == pytest.approx(file.initial_joints[0], abs=count)
        assert emulation.plant.joints[0] == pytest.approx(file.initial_joints[0] - 3e-3, abs=1e-9)
        # its first torque ends that it is held
        emulation.move((1e-9, 0.0))
        for _ in range(50):
            emulation.take(SYNC_ID, b"")
        # downhill by its weight alone
        assert emulation.plant.joints[0] < file.initial_joints[0] - 3.1e-3
