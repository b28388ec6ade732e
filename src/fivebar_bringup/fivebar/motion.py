# SPDX-License-Identifier: Apache-2.0
"""Motions: planned from a start to a goal, or read from scenario files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple

from fivebar.robot import Robot, load_robot
from fivebar_bringup.motions.likely import plan_likely
from fivebar_bringup.motions.request import Request, within_drives
from fivebar_bringup.motions.start import HOME_MODE, Start
from fivebar_bringup.odds.odds import Odds
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.changes import OPTION, changed_scenario
from fivebar_bringup.scenarios.scenario_files import load_scenario as _load_scenario
from fivebar_bringup.scenarios.without_effect import dotted
from fivebar_control.laws import registry
from fivebar_control.model.state import WorkingMode
from fivebar_control.planning.timing import Speed
from fivebar_control.planning.transfer import Transfer
from fivebar_description.errors import InputError
from fivebar_description.scenario_file import shipped_scenarios


class Motion(NamedTuple):
    """A planned motion.

    Attributes:
        scenario: that runs it.
        transfer: the plan with the figures that it was judged by.
        odds: how many of the robots drawn within the declared tolerances and loads make it in simulation; None where
            the robot's file declares none.
    """

    scenario: Scenario
    transfer: Transfer
    odds: Odds | None = None

    def __repr__(self) -> str:
        """Return the motion in a line, and its odds in another where there are any; `transfer` has all figures.

        Examples:
            >>> import fivebar
            >>> fivebar.plan("dextar", goal=(0.0, 0.02), assembly_mode="-")
            <Motion of dextar from (0, 0.15) to (0, 0.02) m: 0.540 s, 1 crossing of the Type 2 locus, by unified>
        """
        (x, y), (goal_x, goal_y) = self.waypoints[0], self.waypoints[-1]
        crossings = f"{self.crossings} crossing{'' if self.crossings == 1 else 's'} of the Type 2 locus"
        ends = f"from ({x:.4g}, {y:.4g}) to ({goal_x:.4g}, {goal_y:.4g}) m"
        odds = "" if self.odds is None else f"\n  {self.odds}"
        words = f"Motion of {self.scenario.robot} {ends}: {self.duration:.3f} s, {crossings}"
        return f"<{words}, by {self.scenario.controller}{odds}>"

    @property
    def waypoints(self) -> tuple[tuple[float, float], ...]:
        """Start, points on the way and goal (m); the platform rests there, unless a blend radius says otherwise."""
        return self.transfer.waypoints

    @property
    def duration(self) -> float:
        """Duration of the whole motion (s)."""
        return sum(self.transfer.durations)

    @property
    def crossings(self) -> int:
        """How often it crosses the Type 2 locus."""
        return len(self.transfer.crossings)


def plan(
    robot: Robot | str | Path,
    goal: tuple[float, float],
    *,
    start: tuple[float, float] | None = None,
    via: Sequence[tuple[float, float]] = (),
    blend_radius: float | Sequence[float] = 0.0,
    assembly_mode: Literal["+", "-"] | None = None,
    working_mode: WorkingMode = HOME_MODE,
    controller: str = "unified",
    judge: Literal["timed", "path"] = "timed",
    duration: float | None = None,
    fastest: bool = False,
    torque_limit: float | None = None,
    speed_limit: float | None = None,
    rate_hz: int = 500,
) -> Motion:
    """Plan a motion between two rests, through the Type 2 locus where the goal is in the other assembly mode.

    Where and how fast it crosses the locus is determined, and torque, speeds, margins and the time near the locus are
    checked, as `fivebar goto` does.

    Args:
        robot: to be moved.
        goal: where the platform shall rest (m).
        start: where it rests now (m), by default at home.
        via: points on the way (m), in straight lines.
        blend_radius: within which the corners there are rounded, without a rest (m); 0 for rests. One for all or each.
        assembly_mode: at the goal, the sign of det A, by default the one that the goal has.
        working_mode: elbow sides of the whole motion.
        controller: one of `controllers()` that can cross the locus.
        judge: by which distance the motion is judged, from its reference or from its path.
        duration: of the whole motion (s), by default comfortably within the limits.
        fastest: whether it shall be as fast as the limits allow.
        torque_limit: of both motors (Nm), by default that of the robot's file, else 10.
        speed_limit: of both motors (rad/s), by default that of the robot's file, else 50.
        rate_hz: of the controller.

    Raises:
        InputError: a value is impossible.
        PlanRefused: no motion is feasible; says why.

    Examples:
        >>> import fivebar
        >>> motion = fivebar.plan("dextar", goal=(0.0, 0.02), assembly_mode="-")
        >>> motion.crossings, round(motion.duration, 3)
        (1, 0.54)
        >>> fivebar.plan("dextar", goal=(0.0, 0.3))  # doctest: +ELLIPSIS
        Traceback (most recent call last):
            ...
        fivebar_control.planning.transfer.TransferRefused: goal: ... is out of reach of leg 1 by 125.75 mm
    """
    if duration is not None and fastest:
        raise ValueError("duration and fastest: expected one of them")
    moved = robot if isinstance(robot, Robot) else load_robot(robot)
    torque, speed = within_drives(moved.source, torque_limit, speed_limit)
    request = Request(
        x=goal[0],
        y=goal[1],
        assembly=assembly_mode,
        working_mode=working_mode,
        start=Start(*(start or moved.home), working_mode),
        controller=controller,
        robot=moved.source,
        torque_limit=torque,
        motor_speed=speed,
        rate_hz=rate_hz,
        duration=duration if duration is not None else Speed.FASTEST if fastest else Speed.COMFORTABLE,
        via=tuple(via),
        blend_radius=(blend_radius,) if isinstance(blend_radius, float | int) else tuple(blend_radius),
        judge=judge,
    )
    likely = plan_likely(request)
    return Motion(likely.scenario, likely.motion, likely.odds)


def load_scenario(source: str | Path | Scenario | Motion, **changes: Any) -> Scenario:
    """Read a scenario by the name of a shipped one or from a file (.yaml), with some of its keys changed.

    Args:
        source: one of `scenarios()`, a path, or a scenario or motion whose keys are to be changed.
        **changes: values of top-level keys; of a section, such as `plant`, only the given keys are changed.

    Raises:
        InputError: there is no such scenario, it is malformed, a key has no effect, or its motion cannot be made.

    Examples:
        >>> import fivebar
        >>> heavier = fivebar.load_scenario("middle", controller="unified", plant={"mass_scale": 1.2})
        >>> heavier.controller, heavier.plant.mass_scale
        ('unified', 1.2)
    """
    keys = dict(dotted(changes))
    scenario = source.scenario if isinstance(source, Motion) else source
    try:
        if not isinstance(scenario, Scenario):
            return _load_scenario(str(scenario), changes=keys)
        changed = changed_scenario(scenario.model_dump(mode="json"), keys) if keys else scenario
    except InputError as error:
        raise InputError(str(error).removeprefix(OPTION).lstrip(": ")) from error
    changed.plan()
    return changed


def scenarios() -> list[str]:
    """Return the names of the shipped scenarios.

    Examples:
        >>> import fivebar
        >>> "middle" in fivebar.scenarios()
        True
    """
    return shipped_scenarios()


def controllers(crossing: bool = False) -> tuple[str, ...]:
    """Return the names of the controllers, or of those only that can cross the Type 2 locus.

    Examples:
        >>> import fivebar
        >>> set(fivebar.controllers()) - set(fivebar.controllers(crossing=True))
        {'ctc'}
    """
    return registry.crossing_controllers() if crossing else tuple(registry.CONTROLLERS)
