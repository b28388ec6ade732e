# SPDX-License-Identifier: Apache-2.0
"""A planned motion with the scenario that runs it, and its odds where they are known."""

from __future__ import annotations

from typing import Any, Generic, NamedTuple, TypeVar

from fivebar_bringup.odds.odds import Odds, kept_odds
from fivebar_bringup.scenario import Scenario
from fivebar_control.planning.alternative_courses import TimedCourse
from fivebar_control.planning.course import Course
from fivebar_control.trajectory.refusal import place

M = TypeVar("M")


class PlannedMotion(NamedTuple, Generic[M]):
    """A planned motion.

    Attributes:
        motion: as its planner returns it.
        scenario: by which it is run.
        odds: how many of the drawn robots make it; None where they are not known, or nothing is declared to draw from.
        likely: whether enough of the drawn robots make it; also where none are drawn.
        better: what has better odds, where the duration was given; else None.
        chosen: in what it differs from the planner's first choice, in words; "" for nothing.
    """

    motion: M
    scenario: Scenario
    odds: Odds | None = None
    likely: bool = True
    better: PlannedMotion[M] | None = None
    chosen: str = ""

    @property
    def known_odds(self) -> dict[str, Any] | None:
        """The odds as plain numbers, to be kept with a run."""
        return kept_odds(self.odds, self.chosen)

    @property
    def required(self) -> float:
        """The share of robots that have to make it."""
        return self.scenario.risk.success

    @property
    def duration(self) -> float:
        """How long it takes (s)."""
        return sum(self.scenario.durations())

    @property
    def timed(self) -> TimedCourse:
        """Where it goes, and how long its legs take."""
        scenario = self.scenario
        radius = scenario.blend_radius
        radii = radius if isinstance(radius, tuple) else (radius,) * (len(scenario.waypoints) - 2)
        return TimedCourse(Course(scenario.waypoints, radii, scenario.time_law), scenario.durations())

    def how_other_than(self, first: PlannedMotion[M]) -> str:
        """Return in what else than its duration it differs from another motion, in words; "" for nothing."""
        ours, theirs = self.timed.course, first.timed.course
        law = f" by time law {ours.time_law}" if ours.time_law != theirs.time_law else ""
        if ours.waypoints == theirs.waypoints:
            return law
        return f"{law} by way of {' and '.join(place(*point) for point in ours.waypoints[1:-1])}"
