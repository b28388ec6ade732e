# SPDX-License-Identifier: Apache-2.0
"""The time laws by name: how the reference passes along a segment. The module of one is imported when it is used."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Annotated, NamedTuple

from fivebar_control.model.state import WorkingMode
from fivebar_control.trajectory.path import Segment
from fivebar_control.trajectory.rounded import RoundedSegment
from fivebar_control.trajectory.time_scaling import rest_to_rest_without_jerk
from fivebar_description.parameters import FiveBar
from fivebar_description.settings import Setting

QUINTIC, CRITERION, SEPTIC, OPTIMAL = "quintic", "criterion", "septic", "optimal"
OPTIMAL_WITH_FRICTION = "optimal_with_friction"

TIME_LAWS = {
    QUINTIC: "time_laws:fifth_order",
    CRITERION: "criterion:through_criterion",
    SEPTIC: "time_laws:seventh_order",
    OPTIMAL: "optimal:least_torque",
    OPTIMAL_WITH_FRICTION: "optimal_with_friction:least_torque_with_friction",
}
"""Module of this folder and function that times a segment: by the fifth-order polynomial, which knows nothing of the
locus (4.2); so that the dynamic criterion holds at the crossing; by the seventh-order polynomial without a jerk at
rest, which every segment has that is planned in the motors' angles; or with the least torque for its duration, beyond
friction or with it."""

TimeLawName = Annotated[str, Setting("How the reference passes along a segment.", choices=tuple(TIME_LAWS))]


class Untimed(NamedTuple):
    """A segment for which a time law is sought.

    Attributes:
        robot, mode: the robot and its working mode.
        segment: with the usual time law.
        number: of the segment, from 1 on.
        crossed: shares of its way at which it crosses the Type 2 locus.
    """

    robot: FiveBar
    mode: WorkingMode
    segment: Segment | RoundedSegment
    number: int
    crossed: tuple[float, ...]


def fifth_order(untimed: Untimed) -> Segment | RoundedSegment:
    """Return a segment by the fifth-order polynomial: as it is."""
    return untimed.segment


def seventh_order(untimed: Untimed) -> Segment | RoundedSegment:
    """Return a segment by the seventh-order polynomial."""
    return untimed.segment._replace(time_law=rest_to_rest_without_jerk)


def timed_by(name: str, untimed: Untimed) -> Segment | RoundedSegment:
    """Return a segment with the time law of a name.

    Raises:
        PlanRefused: the time law does not suit the segment.
    """
    module, _, function = TIME_LAWS[name].partition(":")
    timed: Callable[[Untimed], Segment | RoundedSegment] = getattr(import_module(f"{__package__}.{module}"), function)
    return timed(untimed)
