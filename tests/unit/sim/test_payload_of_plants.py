"""A payload on the platform: the plants go on as a robot with that mass does."""

from __future__ import annotations

import numpy as np
import pytest

from fivebar_control.model.geometry import inverse_geometry
from fivebar_description.parameters import FiveBar, laden
from fivebar_sim.effects.friction import FrictionEffects
from fivebar_sim.plant import Plant
from fivebar_sim.settings import MUJOCO, PlantSettings

PLANTS = {
    "pinocchio": PlantSettings(),
    "effects": PlantSettings(friction=FrictionEffects(passive=0.01)),
    "mujoco": PlantSettings(engine=MUJOCO),
}


@pytest.mark.parametrize("settings", PLANTS.values(), ids=list(PLANTS))
def test_a_plant_goes_on_with_the_mass_that_it_is_given(settings: PlantSettings, dextar: FiveBar) -> None:
    home = tuple(inverse_geometry(dextar, 1, -1, 0.0, 0.13))
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
