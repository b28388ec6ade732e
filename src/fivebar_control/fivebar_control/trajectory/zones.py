# SPDX-License-Identifier: Apache-2.0
"""How wide the blending zones around the crossings of a motion are."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from fivebar_control.laws.registry import OF_CONTROLLER, SUPERVISIONS
from fivebar_control.trajectory.refusal import PlanRefused as PlanRefused
from fivebar_description.settings import Setting

MIN_ZONE_SAMPLES = 10
"""A ballistic blending zone holds at least this many samples with sigma = 1."""


BALLISTIC, FIXED = "ballistic", "fixed"


class ZoneSettings(NamedTuple):
    """How wide the blending zones are."""

    rule: Annotated[
        str,
        Setting(
            "How the zones are sized: by a time from the speed at each crossing, or all alike.",
            choices=(BALLISTIC, FIXED),
        ),
    ] = BALLISTIC
    duration_ms: Annotated[
        float,
        Setting("Time with sigma = 1 at a crossing, for the ballistic rule.", "ms", at_least=0.1, at_most=10_000.0),
    ] = 40.0
    epsilon: Annotated[
        float, Setting("Half width of the zones in 1/cond(A), for the fixed rule.", above=0.0, below=0.5)
    ] = 0.05
    supervision: Annotated[
        str,
        Setting(
            "What decides where the constraint law of a blended controller acts: 1/cond(A) in the planned zones,"
            " a sigmoid in time around each planned crossing, 1/cond(A) in zones as wide as the estimated state's"
            " own speed makes them, or what the controller has of its own.",
            choices=(OF_CONTROLLER, *SUPERVISIONS),
        ),
    ] = OF_CONTROLLER

    def as_rule(self) -> ZoneRule:
        """Return the rule for the planner."""
        return ZoneRule(self.duration_ms / 1e3, self.epsilon if self.rule == FIXED else None)


class ZoneRule(NamedTuple):
    """How wide a blending zone is.

    With `epsilon` None (ballistic) each crossing gets eps = T_b |dkappa/dt| / 2 from the reference's speed there, so
    that sigma = 1 lasts about `duration` T_b (s). A number is a fixed epsilon for all crossings, as in the thesis.
    """

    duration: float = ZoneSettings().duration_ms / 1e3
    epsilon: float | None = None

    def lasts(self, rate_hz: int) -> float:
        """Return the time (s) for which sigma is meant to be 1: at least `MIN_ZONE_SAMPLES`."""
        return max(self.duration, MIN_ZONE_SAMPLES / rate_hz)
