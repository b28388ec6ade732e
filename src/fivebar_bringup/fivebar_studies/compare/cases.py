# SPDX-License-Identifier: Apache-2.0
"""The runs of a comparison."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.changes import changes_for, with_changes
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_control.laws.robot_sizes import size_ratio, torque_ratio
from fivebar_control.scenario.guard_settings import guard_settings
from fivebar_control.scenario.keys import parameters_of
from fivebar_description.robot_file import load_robot, read_robot
from fivebar_description.strict_yaml import InputError, validate
from fivebar_studies.compare.screening import has_quickest, quickest_durations
from fivebar_studies.rigs.named import find_rig
from fivebar_studies.rigs.proportion import in_proportion
from fivebar_studies.rigs.rig import OF_ROBOT

COMPARED_RIGS = "ideal", "wrong", "encoders", "realistic"
"""Rigs of a comparison where none are named, each with the robot that has none of its drawn errors."""

AS_GIVEN = "as_given"
"""In place of a rig: plant, estimator and gains of the scenario itself."""

LENGTHS = "tracking_error_limit", "error_tolerance"
"""Keys of a rig (m) that go with the size of the robot."""

TIGHT_LIMIT = 0.6
"""Torque limit (Nm) of DexTAR, in proportion for other robots, for the test whether the planner's screen refuses what
the controllers cannot do."""


class ComparisonCase(NamedTuple):
    """One run of a comparison.

    Attributes:
        base: the scenario with the motion.
        controller: name of the controller.
        duration: of each segment (s); None for the quickest that the planner's screen allows.
        rig: name or path of a rig, or `AS_GIVEN`.
        torque_limit: of the drives (Nm); None for the scenario's.
        changes: KEY=VALUE of further keys of the scenario, in place of the rig's.
    """

    base: Scenario
    controller: str
    duration: float | None
    rig: str
    torque_limit: float | None = None
    changes: tuple[str, ...] = ()

    @property
    def size(self) -> float:
        """Size of the robot over that of DexTAR, by which errors are judged."""
        return size_ratio(load_robot(self.base.robot))

    @property
    def torque(self) -> float:
        """Torque of the robot's crossings over that of DexTAR's, by which torques are judged."""
        return torque_ratio(read_robot(self.base.robot))

    @property
    def motion(self) -> str:
        """Name of the motion."""
        return self.base.name

    @property
    def pace(self) -> str:
        """The duration in words."""
        return "quickest" if self.duration is None else f"{self.duration:g} s"

    def scenario(self) -> Scenario:
        """Return what to run.

        Raises:
            InputError: the controller cannot follow the motion on the rig, or there is no quickest duration.
        """
        content = with_changes(on_rig(self.base, self.rig, self.controller), changes_for(self.changes, self.controller))
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


@dataclass(frozen=True)
class ComparisonExtent:
    """Extent of a comparison: scenarios, controllers, segment durations (s), rigs (None: the default ones), changes."""

    scenarios: tuple[Scenario, ...]
    controllers: tuple[str, ...]
    durations: tuple[float, ...]
    rigs: tuple[str, ...] | None = None
    changes: tuple[str, ...] = ()

    def rigs_of(self, scenario: Scenario) -> tuple[str, ...]:
        """Return the rigs for a scenario, without those on which its motion cannot be made."""
        if self.rigs is None:
            return default_rigs(scenario)
        return tuple(name for name in self.rigs if can_be_on(scenario, name))

    @cached_property
    def asked(self) -> list[ComparisonCase]:
        """The runs that are compared."""
        return [
            ComparisonCase(scenario, controller, duration, rig, changes=self.changes)
            for scenario in self.scenarios
            for rig in self.rigs_of(scenario)
            for controller in self.controllers
            for duration in self.durations
        ]

    @cached_property
    def tight(self) -> list[ComparisonCase]:
        """The runs under the tight limit, whose numbers follow: as asked on the first rig, the quickest on all rigs.

        None of a scenario whose quickest pace cannot be found, nor of one whose drives have no more than that limit.
        """
        return [
            ComparisonCase(scenario, controller, duration, rig, tight_limit(scenario), self.changes)
            for scenario in self.scenarios
            for number, rig in enumerate(self.rigs_of(scenario))
            for controller in self.controllers
            for duration in ((*self.durations, None) if number == 0 else (None,))
            if has_quickest(scenario) and guard_settings(scenario).torque_limit > tight_limit(scenario)
        ]


def scenario_on(name: str, robot: str) -> Scenario:
    """Return a scenario by name or path; on another robot than its own its lengths are in proportion to the size.

    Args:
        name: of the scenario.
        robot: by the name of its file, "" for that of the scenario.

    Raises:
        InputError: there is no such scenario or robot, or the robot cannot make the motion.
    """
    scenario = load_scenario(name, any_law=True)
    if robot in ("", scenario.robot):
        return scenario
    file = read_robot(robot)
    size = size_ratio(file.five_bar()) / size_ratio(scenario.five_bar())
    limit = file.drives.torque_limit
    scaled: dict[str, Any] = {
        "robot": robot,
        "waypoints": tuple((size * x, size * y) for x, y in scenario.waypoints),
        "blend_radius": _scaled(scenario.blend_radius, size),
        "tracking_error_limit": size * scenario.tracking_error_limit,
        "error_tolerance": size * scenario.error_tolerance,
        "plant": scenario.plant if limit is None else scenario.plant._replace(torque_limit=limit),
    }
    keys = (*scaled.keys() - {"plant"}, "plant.torque_limit")
    try:
        return load_scenario(name, parameters_of(scenario.model_copy(update=scaled), keys), any_law=True)
    except InputError as error:
        raise InputError(f"robot {robot!r}: {size:.3g} times as large as {scenario.robot}: {error}") from error


def _scaled(length: float | tuple[float, ...], size: float) -> float | tuple[float, ...]:
    return tuple(size * radius for radius in length) if isinstance(length, tuple) else size * length


def on_rig(scenario: Scenario, name: str, controller: str) -> dict[str, Any]:
    """Return the content of a scenario with its robot put on a rig, without drawn errors, and a controller."""
    if name == AS_GIVEN:
        law = scenario.law if controller == scenario.controller else {}
        return scenario.model_dump() | {"controller": controller, "law": law}
    rig = find_rig(name)
    content = rig.content(scenario, controller)
    if rig.robot == scenario.robot:
        return content
    size = size_ratio(scenario.five_bar()) / size_ratio(load_robot(rig.robot))
    lengths = {key: size * content[key] for key in LENGTHS if key in rig.settings_for(controller)}
    return in_proportion({**content, **lengths}, scenario.robot)


def can_be_on(scenario: Scenario, name: str) -> bool:
    """Return whether a scenario's motion can be made on a rig: an estimator follows it in one working mode only."""
    return scenario.working_modes is None or name == AS_GIVEN or not find_rig(name).estimated


def default_rigs(scenario: Scenario) -> tuple[str, ...]:
    """Return the rigs for a scenario where none are named.

    They are all, the robot as its file declares it where that says of robots at all, and the scenario's own plant
    where that is none of them.
    """
    declared = (f"{OF_ROBOT}{scenario.robot}",) if read_robot(scenario.robot).declares_errors else ()
    possible = tuple(name for name in (*COMPARED_RIGS, *declared) if can_be_on(scenario, name))
    for name in possible:
        rigged = validate(on_rig(scenario, name, scenario.controller), Scenario, name)
        if (rigged.plant, rigged.estimator) == (scenario.plant, scenario.estimator):
            return possible
    return (*possible, AS_GIVEN)


def tight_limit(scenario: Scenario) -> float:
    """Return the tight torque limit (Nm) of a scenario's robot."""
    return TIGHT_LIMIT * torque_ratio(read_robot(scenario.robot))
