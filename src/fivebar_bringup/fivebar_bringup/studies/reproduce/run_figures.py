"""Figures of single runs, as their own reports have them."""

from __future__ import annotations

from collections.abc import Callable

from matplotlib.figure import Figure

from fivebar_bringup.pages.style import house_style, png
from fivebar_bringup.report import criterion_figure, figures, plane
from fivebar_bringup.report.findings import Findings

DRAW: dict[str, Callable[[Findings], Figure]] = {
    "torques": figures.torques,
    "vhc_error": figures.vhc_error,
    "acceleration": figures.acceleration,
    "supervisor": figures.supervisor,
    "criterion": criterion_figure.criterion,
    "path": lambda run: plane.path(run, plane.survey_run(run)),
    "hero": lambda run: plane.hero(run, plane.survey_run(run)),
}


def draw(run: Findings, name: str) -> bytes:
    """Return one of a run's figures as PNG."""
    with house_style():
        return png(DRAW[name](run))
