"""The figures by which a motion is judged, and the verdict that they make together."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeVar

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
    """

    figures: tuple[Figure, ...]
    displacement: float = 0.0

    @property
    def feasible(self) -> bool:
        """Whether all limits are kept."""
        return all(figure.kept for figure in self.figures)

    @property
    def reasons(self) -> list[str]:
        """The limits that are not kept, in words."""
        return [str(figure) for figure in self.figures if not figure.kept]

    @property
    def expected_distance(self) -> float:
        """How far (m) from what it is judged by the platform is expected: the predicted distance, and what errors add.

        Those of the estimate, within the tolerances, and those by the declared loads are independent of each other.
        """
        distance = self._value(ERROR if self.figure(PATH_ERROR) is None else PATH_ERROR)
        estimate = max(self._value(UNCERTAINTY) - distance, 0.0)
        return distance + math.hypot(estimate, self.displacement)

    def keeps_nearer_than(self, other: Feasibility) -> bool:
        """Return whether the platform is expected nearer to its reference, by a tenth at least, than in another."""
        return self.expected_distance < WORTH_A_CHANGE * other.expected_distance

    def keeps_as_near_as(self, other: Feasibility) -> bool:
        """Return whether the platform is expected no farther from its reference than in another."""
        return self.expected_distance <= other.expected_distance

    def figure(self, name: str) -> Figure | None:
        """Return a figure by its name; None where the motion has no such figure."""
        return next((figure for figure in self.figures if figure.name == name), None)

    def _value(self, name: str) -> float:
        """Return a figure's value, 0 where the motion has no such figure."""
        figure = self.figure(name)
        return 0.0 if figure is None else figure.value


Found = TypeVar("Found")


def nearest(found: Sequence[Found], verdict: Callable[[Found], Feasibility]) -> Found:
    """Return the first of some feasible motions, unless a later one keeps nearer to its reference by a tenth."""
    best = found[0]
    for one in found[1:]:
        if verdict(one).keeps_nearer_than(verdict(best)):
            best = one
    return best
