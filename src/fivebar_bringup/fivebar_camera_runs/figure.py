# SPDX-License-Identifier: Apache-2.0
"""The figure of what the camera saw in a run."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from fivebar_bringup.pages.style import BLUE, INK, VERMILION, error_axis, new_figure
from fivebar_bringup.report.analysis import RunAnalysis
from fivebar_bringup.report.figures import finish
from fivebar_bringup.units import error_of, suitable_unit

CAPTION = (
    "Position of the platform that the camera measured, minus that by the joints at the time of the"
    " exposure, and minus the exact one. The thesis names this validation as future work."
)


def vision(run: RunAnalysis) -> tuple[Figure, str]:
    """Draw the platform by the camera against that by the joints, and against the exact one; with a caption."""
    summary, seen = run.summary, run.series.vision
    figure = new_figure("Check by the camera", "future work of the thesis, beside the IMU of section 4.3", 5.6)
    panels = figure.subplots(2, 1, sharex=True)
    scale, unit = suitable_unit(summary.vision_error_max_m, "m")
    dotted = "" if np.all(np.isnan(seen.true_error)) else " (dotted: minus the exact platform)"
    for axes, axis, color in ((panels[0], 0, BLUE), (panels[1], 1, VERMILION)):
        axes.plot(seen.time, seen.error[:, axis] * scale, color=color, linewidth=1.2)
        axes.plot(seen.time, seen.true_error[:, axis] * scale, color=INK, linewidth=0.9, linestyle=":")
        axes.set_ylabel(f"{'xy'[axis]}, camera − joints in {unit}")
        error_axis(axes, seen.error[:, axis] * scale)
    panels[0].set_title(
        f"rms {error_of(summary.vision_error_rms_m, 'm')}, at most {error_of(summary.vision_error_max_m, 'm')}{dotted}"
    )
    finish(run, panels)
    return figure, CAPTION
