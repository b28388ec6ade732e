# SPDX-License-Identifier: Apache-2.0
"""The scenario with the robot that is simulated: the whole file of a run, checked before anything starts."""

from __future__ import annotations

from typing import Any

from fivebar_control.scenario.motion_file import DECLARED, SEEN
from fivebar_control.scenario.scenario import ControlScenario
from fivebar_description.interface import EXTRA_READINGS, PASSIVE_STATES, Topic
from fivebar_description.parameters import FiveBar
from fivebar_description.robot_file import RobotFile
from fivebar_description.settings import Section
from fivebar_sim.effects.mechanism import actual_robot
from fivebar_sim.effects.settings import PlantSettings
from fivebar_sim.scenario import has_ground_truth, with_assumed_effects

__all__ = ["DECLARED", "SEEN", "Scenario", "scalar_topics"]


def scalar_topics(scenario: ControlScenario) -> tuple[Topic, ...]:
    """Return the topics of a scenario's sensors of one value."""
    passive = (PASSIVE_STATES,) if scenario.passive.leg else ()
    return (*passive, EXTRA_READINGS) if scenario.extra_sensor else passive


class Scenario(ControlScenario):
    """One run. Every field but the name, the waypoints and the controller has a default."""

    # the controllers know its drives only
    plant: Section[PlantSettings] = PlantSettings()  # type: ignore[assignment]

    @classmethod
    def _with_robot(cls, content: Any) -> tuple[Any, RobotFile | None]:
        filled, file = super()._with_robot(content)
        return with_assumed_effects(filled, file), file

    def __repr__(self) -> str:
        """Return what is run in a line; `to_yaml()` has every key."""
        motion = f"{len(self.waypoints)} waypoints" if len(self.waypoints) != 1 else "1 waypoint"
        return f"<Scenario {self.name}: robot {self.robot}, controller {self.controller}, {motion}>"

    __str__ = __repr__

    def actual_robot(self) -> FiveBar:
        """Return the robot that is simulated: scaled, with its actual geometry."""
        return actual_robot(self.five_bar(), self.plant)

    @property
    def has_ground_truth(self) -> bool:
        """Whether the exact state of the robot is recorded besides."""
        return has_ground_truth(self.estimated, self.camera, self.plant)
