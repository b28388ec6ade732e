# SPDX-License-Identifier: Apache-2.0
"""The robot that emulated hardware moves: what the files of emulated drives and boards have in common."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from fivebar_description.settings import Keys, declared
from fivebar_description.strict_yaml import StrictModel
from fivebar_sim.effects.settings import FrictionScale, InertiaScale, MassScale, PlantSettings

NOT_EFFECTS = tuple(setting.name for setting in declared(PlantSettings) if setting.name not in ("engine", "seed"))
"""Settings of a plant that have keys of their own here, or that the hardware has."""

Four = Annotated[tuple[float, float, float, float], Field(strict=False)]


class EmulatedRobotFile(StrictModel):
    """A file of emulated hardware.

    Attributes:
        interface: that of the drives which are emulated; empty where the other keys tell.
        robot: file of the robot that the hardware moves.
        initial_joints: its posture at the start: q11, q12, q21, q22 in rad, of a closed loop.
        mass_scale, inertia_scale, friction_scale: how the robot differs from its file.
        effects: the robot's effects, what simulates them, and the seed of what is random in them.
    """

    name: Annotated[str, Field(min_length=1)]
    interface: str = ""
    robot: str
    initial_joints: Four
    mass_scale: MassScale = 1.0
    inertia_scale: InertiaScale = 1.0
    friction_scale: FrictionScale = 1.0
    effects: Annotated[PlantSettings, Keys(without=NOT_EFFECTS)] = PlantSettings()

    def plant(self) -> PlantSettings:
        """Return the settings of the robot; the hardware itself limits and quantises."""
        return self.effects._replace(
            mass_scale=self.mass_scale,
            inertia_scale=self.inertia_scale,
            friction_scale=self.friction_scale,
            torque_limit=None,
        )
