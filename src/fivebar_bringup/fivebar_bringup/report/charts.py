# SPDX-License-Identifier: Apache-2.0
"""Charts over time as a page's scripts draw them."""

from __future__ import annotations

from typing import Any, NamedTuple


class ChartLine(NamedTuple):
    """A line of a chart: a column, its name, which of the page's colours it has, and what a symbol or name means."""

    column: str
    label: str
    colour: str
    meaning: str = ""


class Chart(NamedTuple):
    """A chart over time.

    Attributes:
        title: what it shows.
        unit: of all its lines.
        least: the smallest range that the vertical axis shows, so that rounding errors do not fill it.
        lines: from back to front.
    """

    title: str
    unit: str
    least: float
    lines: tuple[ChartLine, ...]

    def as_json(self) -> dict[str, Any]:
        """Return the chart as plain values."""
        return {**self._asdict(), "lines": [line._asdict() for line in self.lines]}


MOTOR_TORQUES = (ChartLine("torque1", "motor 1", "first"), ChartLine("torque2", "motor 2", "second"))

BLENDING = Chart(
    "Weight σ and 1/cond(A)",
    "",
    0.02,
    (
        ChartLine("sigma", "σ", "third", "weight of the constraint law"),
        ChartLine("kappa", "1/cond(A)", "first", "0 on the Type 2 locus"),
    ),
)
