"""The scenario with the robot that is simulated: the whole file of a run, checked before anything starts."""

from __future__ import annotations

from fivebar_control.scenario.scenario import DECLARED, SEEN, ControlScenario
from fivebar_description.parameters import FiveBar
from fivebar_description.settings import Section
from fivebar_sim.effects.mechanism import actual_robot
from fivebar_sim.effects.settings import PlantSettings
from fivebar_sim.scenario import has_ground_truth

__all__ = ["DECLARED", "SEEN", "Scenario"]


class Scenario(ControlScenario):
    """One run. Every field but the name, the waypoints and the controller has a default."""

    # the controllers know its drives only
    plant: Section[PlantSettings] = PlantSettings()  # type: ignore[assignment]

    def actual_robot(self) -> FiveBar:
        """Return the robot that is simulated: scaled, with its actual geometry."""
        return actual_robot(self.five_bar(), self.plant)

    @property
    def has_ground_truth(self) -> bool:
        """Whether the exact state of the robot is recorded besides."""
        return has_ground_truth(self.estimated, self.camera, self.plant)
