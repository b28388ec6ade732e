# SPDX-License-Identifier: Apache-2.0
"""Figure, page and settings file of an estimation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fivebar_bringup.bag.recording import FloatArray
from fivebar_bringup.pages.content import Picture
from fivebar_bringup.pages.rendering import render
from fivebar_bringup.pages.style import BLUE, GREY, house_style, new_figure, png
from fivebar_control.estimation.constants import watch_limits
from fivebar_description.strict_yaml import yaml_text
from fivebar_studies.estimate.changes import SECTIONS
from fivebar_studies.estimate.estimate import EstimationComparison

SETTINGS_FILE = "settings.yaml"
"""The new settings, beside the page."""

CAPTION = (
    "Squared innovations of each sensor in units of their variance (1 expected on average, dashed: the limit of the"
    " watch, which judges their mean), and the distance of the estimated platform from the recorded estimate. Grey:"
    " with the recorded settings, blue: with the others."
)


SENSORS = ("encoders", "gyroscope", "passive joint")
"""Columns of `Replay.squared`, in words."""


def settings_file(estimation: EstimationComparison) -> str:
    """Return the sections `ekf` and `tolerances` with the new settings as YAML."""
    content: dict[str, Any] = estimation.changed.model_dump(mode="json")
    return yaml_text({section: content[section] for section in SECTIONS})


def draw_pictures(estimation: EstimationComparison) -> list[Picture]:
    """Return the picture of the page."""
    with house_style():
        return [Picture("innovations", CAPTION, png(innovations(estimation)))]


def innovations(estimation: EstimationComparison) -> Figure:
    """Draw squared innovations and the distance from the recorded estimate over time."""
    squared = np.vstack((estimation.before.squared, estimation.after.squared))
    present = [sensor for sensor in range(len(SENSORS)) if np.any(np.isfinite(squared[:, sensor]))]
    figure = new_figure("Estimated again", ", ".join(name for name, _, _ in estimation.changes()) or "as recorded", 6.4)
    panels = figure.subplots(len(present) + 1, 1, sharex=True)
    for panel, sensor in zip(panels, present, strict=False):
        for replay, settings, colour in (
            (estimation.before, estimation.recorded, GREY),
            (estimation.after, estimation.changed, BLUE),
        ):
            _values(panel, replay.time, np.maximum(replay.squared[:, sensor], 1e-4), colour)
            panel.axhline(
                watch_limits(settings.ekf, settings.rate_hz).misfit_limit, color=colour, linestyle="--", linewidth=1.0
            )
        panel.set_yscale("log")
        panel.set_ylabel(f"{SENSORS[sensor]}:\nsquared innovation")
    for replay, colour in ((estimation.before, GREY), (estimation.after, BLUE)):
        _values(panels[-1], replay.time, 1e3 * replay.difference, colour)
    panels[-1].set_ylabel("distance from the\nrecorded estimate in mm")
    panels[-1].set_xlabel("time in s")
    return figure


def _values(axes: Axes, time: FloatArray, values: FloatArray, colour: str) -> None:
    axes.plot(time, values, color=colour, linewidth=1.0, marker=".", markersize=2.5)


def html_page(estimation: EstimationComparison, pictures: Sequence[Picture]) -> str:
    """Return the page: changed settings, figures of consistency, the picture, and the settings as a file."""
    return render(
        "estimation.html",
        package="fivebar_studies",
        title=f"{estimation.recorded.name}: estimated again",
        setting=f"from {estimation.bag} · {len(estimation.after.time)} samples at {estimation.recorded.rate_hz} Hz",
        change_rows=estimation.changes(),
        rows=estimation.rows(),
        pictures=pictures,
        settings_file=settings_file(estimation),
    )
