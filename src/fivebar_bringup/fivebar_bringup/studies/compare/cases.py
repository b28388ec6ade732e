"""The runs of a comparison."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, NamedTuple

from fivebar_bringup.scenario import Scenario
from fivebar_bringup.studies.compare.screening import has_quickest, quickest_durations
from fivebar_bringup.studies.rigs.rig import find_rig
from fivebar_control.laws.robot_sizes import size_ratio, torque_ratio
from fivebar_description.robot_file import load_robot, read_robot
from fivebar_description.strict_yaml import validate

COMPARED_RIGS = "ideal", "wrong", "encoders", "realistic"
"""Rigs of a comparison where none are named, each with the robot that has none of its drawn errors."""

AS_GIVEN = "as_given"
"""In place of a rig: plant, estimator and gains of the scenario itself."""

TIGHT_LIMIT = 0.6
"""Torque limit (Nm) of DexTAR, in proportion for other robots, for the test whether the planner's screen refuses what
the controllers cannot do."""


class ComparisonCase(NamedTuple):
    """One run of a comparison.

    Attributes:
        given: the scenario with the motion.
        controller: name of the controller.
        duration: of each segment (s); None for the quickest that the planner's screen allows.
        rig: name or path of a rig, or `AS_GIVEN`.
        torque_limit: of the drives (Nm); None for the scenario's.
    """

    given: Scenario
    controller: str
    duration: float | None
    rig: str
    torque_limit: float | None = None

    @property
    def size(self) -> float:
        """Size of the robot over that of DexTAR, by which errors are judged."""
        return size_ratio(load_robot(self.given.robot))

    @property
    def torque(self) -> float:
        """Torque of the robot's crossings over that of DexTAR's, by which torques are judged."""
        return torque_ratio(read_robot(self.given.robot))

    @property
    def motion(self) -> str:
        """Name of the motion."""
        return self.given.name

    @property
    def pace(self) -> str:
        """The duration in words."""
        return "quickest" if self.duration is None else f"{self.duration:g} s"

    def scenario(self) -> Scenario:
        """Return what to run.

        Raises:
            InputError: the controller cannot follow the motion on the rig, or there is no quickest duration.
        """
        content = on_rig(self.given, self.rig, self.controller)
        # the name of a run takes no colon, which a law from elsewhere has
        rig = re.sub(r"[^\w.-]", "_", Path(self.rig).stem, flags=re.ASCII)
        name = f"{self.motion}-{self.controller.replace(':', '.')}-{rig}"
        content["name"] = name
        if self.torque_limit is not None:
            own = content["plant"]["torque_limit"]
            content["plant"]["torque_limit"] = self.torque_limit if own is None else min(own, self.torque_limit)
        if self.duration is not None:
            content["segment_duration"] = self.duration
        scenario = validate(content, Scenario, self.motion)
        if self.duration is not None:
            return scenario
        return validate({**content, "segment_duration": quickest_durations(scenario)}, Scenario, self.motion)


class ComparisonExtent(NamedTuple):
    """Extent of a comparison: scenarios, controllers, segment durations (s), rigs; None for the default ones."""

    given: tuple[Scenario, ...]
    controllers: tuple[str, ...]
    durations: tuple[float, ...]
    rigs: tuple[str, ...] | None = None

    def rigs_of(self, given: Scenario) -> tuple[str, ...]:
        """Return the rigs for a scenario, without those on which its motion cannot be made."""
        if self.rigs is None:
            return default_rigs(given)
        return tuple(name for name in self.rigs if can_be_on(given, name))

    def cases(self) -> list[ComparisonCase]:
        """Return the runs that are compared."""
        return [
            ComparisonCase(given, controller, duration, rig)
            for given in self.given
            for rig in self.rigs_of(given)
            for controller in self.controllers
            for duration in self.durations
        ]

    def tight_cases(self) -> list[ComparisonCase]:
        """Return the runs under the tight limit: as asked on the first rig, and the quickest allowed on all rigs.

        None of a scenario whose quickest pace cannot be found, nor of one whose drives have no more than that limit.
        """
        return [
            ComparisonCase(given, controller, duration, rig, tight_limit(given))
            for given in self.given
            for number, rig in enumerate(self.rigs_of(given))
            for controller in self.controllers
            for duration in ((*self.durations, None) if number == 0 else (None,))
            if has_quickest(given) and (given.torque_limit is None or given.torque_limit > tight_limit(given))
        ]


def on_rig(scenario: Scenario, name: str, controller: str) -> dict[str, Any]:
    """Return the content of a scenario with its robot put on a rig, without drawn errors, and a controller."""
    if name == AS_GIVEN:
        return scenario.model_dump() | {"controller": controller}
    return find_rig(name).content(scenario, controller)


def can_be_on(scenario: Scenario, name: str) -> bool:
    """Return whether a scenario's motion can be made on a rig: an estimator follows it in one working mode only."""
    return scenario.working_modes is None or name == AS_GIVEN or not find_rig(name).estimated


def default_rigs(scenario: Scenario) -> tuple[str, ...]:
    """Return the rigs for a scenario where none are named: all, and its own plant where that is none of them."""
    possible = tuple(name for name in COMPARED_RIGS if can_be_on(scenario, name))
    for name in possible:
        rigged = validate(on_rig(scenario, name, scenario.controller), Scenario, name)
        if (rigged.plant, rigged.estimator) == (scenario.plant, scenario.estimator):
            return possible
    return (*possible, AS_GIVEN)


def tight_limit(given: Scenario) -> float:
    """Return the tight torque limit (Nm) of a scenario's robot."""
    return TIGHT_LIMIT * torque_ratio(read_robot(given.robot))
