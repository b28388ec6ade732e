# SPDX-License-Identifier: Apache-2.0
"""The figures by which a motion is judged, and the verdict that they make together."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple, Protocol, TypeVar

from fivebar_control.trajectory.refusal import place


class Figure(NamedTuple):
    """The worst of one quantity along a motion.

    Attributes:
        name: of the quantity, in words.
        value, limit: in `unit`.
        at_most: whether the limit is an upper one.
        time: when (s since sample 0).
        x, y: where (m).
        unit: of value and limit, "" for none.
    """

    name: str
    value: float
    limit: float
    at_most: bool
    time: float
    x: float
    y: float
    unit: str = ""

    @property
    def kept(self) -> bool:
        """Whether the limit is kept; an undefined value keeps none."""
        return self.value <= self.limit if self.at_most else self.value >= self.limit

    def __str__(self) -> str:
        """Return the figure in words: what, how much, where, when, and what was expected; NaN is unbounded, too."""
        unit = f" {self.unit}" if self.unit else ""
        value = f"{self.value:.3g}{unit}" if math.isfinite(self.value) else "unbounded"
        return (
            f"{self.name} is {value} at {place(self.x, self.y)} after {self.time:.3f} s,"
            f" expected at {'most' if self.at_most else 'least'} {self.limit:.3g}{unit}"
        )


(
    TORQUE,
    SPEED,
    SERIAL,
    DWELL,
    ZONE_STAY,
    REST,
    DIRECTION,
    NEAREST,
    ERROR,
    PATH_ERROR,
    REQUEST,
    MODE_CHANGES,
    WRONG_MODE,
    UNCERTAINTY,
    LOADS,
    WITH_RESERVE,
    PATH_WITH_RESERVE,
    APPROACH,
    WORKSPACE,
    ELBOWS,
) = (
    "reference torque",
    "motor speed",
    "|sin q_i2|",
    "time near the Type 2 locus",
    "time in a blending zone",
    "1/cond(A) at rest",
    "|n.v1| where the path crosses the Type 2 locus",
    "least 1/cond(A) under a law that is undefined on the Type 2 locus",
    "predicted distance from the reference",
    "predicted distance from the path",
    "predicted torque request",
    "predicted number of unplanned changes of assembly mode",
    "predicted probability of a wrong assembly mode within the tolerances",
    "predicted position error within the tolerances",
    "displacement by the declared loads where the path crosses the Type 2 locus",
    "predicted distance from the reference without the reserve of torque",
    "predicted distance from the path without the reserve of torque",
    "time between a rest and the Type 2 locus",
    "distance of the reference from the edge of the workspace",
    "number of crossings at which the elbows pass each other (elbows_pass: false)",
)
"""Names of the figures."""


FORBIDDEN = "time to the forbidden posture"
"""How the names of the figures of forbidden postures begin."""

WORTH_A_CHANGE = 0.9
"""Share of the expected distance that another time law must not exceed to be taken: the first is the smoother."""


class Feasibility(NamedTuple):
    """The verdict on a motion.

    Attributes:
        figures: one per limit, the worst of the motion each.
        displacement: of the platform (m) by the declared loads, 0 without any. Motions are compared by it, since how
            much of them is risked must not decide which motion is the better one.
        causes: why a motion is refused, where the figures do not say it.
    """

    figures: tuple[Figure, ...]
    displacement: float = 0.0
    causes: tuple[str, ...] = ()

    @property
    def feasible(self) -> bool:
        """Whether all limits are kept."""
        return all(figure.kept for figure in self.figures)

    @property
    def reasons(self) -> list[str]:
        """The limits that are not kept, in words, and why they are not where that is known."""
        return [*(str(figure) for figure in self.figures if not figure.kept), *self.causes]

    @property
    def expected_distance(self) -> float:
        """How far (m) from what it is judged by the platform is expected: the predicted distance, and what errors add.

        Those of the estimate, within the tolerances, and those by the declared loads are independent of each other.
        """
        by_path = self.value(PATH_ERROR)
        distance = (self.value(ERROR) if by_path is None else by_path) or 0.0
        estimate = max((self.value(UNCERTAINTY) or 0.0) - distance, 0.0)
        return distance + math.hypot(estimate, self.displacement)

    def figure(self, name: str) -> Figure | None:
        """Return a figure by its name; None where the motion has no such figure."""
        return next((figure for figure in self.figures if figure.name == name), None)

    def value(self, name: str) -> float | None:
        """Return a figure's value; None where the motion has no such figure."""
        figure = self.figure(name)
        return None if figure is None else figure.value


class JudgedMotion(Protocol):
    """A motion with its verdict."""

    @property
    def feasibility(self) -> Feasibility:
        """The verdict."""


Duration = TypeVar("Duration")
Motion = TypeVar("Motion", bound=JudgedMotion)


def nearest(motions: Sequence[Motion]) -> Motion:
    """Return the first of some feasible motions, unless a later one keeps nearer to its reference by a tenth."""
    best = motions[0]
    for motion in motions[1:]:
        if motion.feasibility.expected_distance < WORTH_A_CHANGE * best.feasibility.expected_distance:
            best = motion
    return best


def first_feasible(
    durations: Iterable[Duration],
    timed: Callable[[Duration], Motion | str],
    unhurried: Callable[[Duration], Motion | str | None],
) -> Motion | str:
    """Return the motion in the first of some durations in which it is feasible, or the reason against the first one.

    The unhurried one takes its place, if the platform is expected no farther from its reference then.

    Args:
        durations: to try.
        timed: returns the motion in a duration, or why it is not feasible.
        unhurried: returns the same for a longer duration, None where that is not to be tried.
    """
    reason = ""
    for duration in durations:
        motion = timed(duration)
        if isinstance(motion, str):
            reason = reason or motion
            continue
        slower = unhurried(duration)
        if slower is None or isinstance(slower, str):
            return motion
        return slower if slower.feasibility.expected_distance <= motion.feasibility.expected_distance else motion
    return reason
