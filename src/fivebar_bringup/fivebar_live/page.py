# SPDX-License-Identifier: Apache-2.0
"""The live page, and the scene that a graph's parameters give."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from fivebar_bringup.pages.rendering import render
from fivebar_bringup.pages.scripts import page_scripts
from fivebar_bringup.report.charts import BLENDING, MOTOR_TORQUES, Chart, ChartLine
from fivebar_bringup.report.scene import links, scene
from fivebar_description.parameters import FiveBar

PACKAGE = "fivebar_live"

SCRIPTS = ("stage.js", "charts.js", "live.js")

REPORT_SCRIPTS = ("replay.js",)
"""Further scripts of a run's report, which the live page opens under its own policy."""

CHARTS = (
    Chart("Torque in Nm", "Nm", 0.02, MOTOR_TORQUES),
    BLENDING,
    Chart("Distance from reference in mm", "mm", 0.002, (ChartLine("error", "distance", "first"),)),
)


def live_page() -> str:
    """Return the page, without any data of a graph and without the token, which the server checks."""
    return render(
        "live.html",
        package=PACKAGE,
        title="fivebar live",
        setting="a running graph, as it publishes itself",
        scripts=page_scripts(
            SCRIPTS,
            {"charts": [chart.as_json() for chart in CHARTS]},
            "live-data",
            allowed=REPORT_SCRIPTS,
            package=PACKAGE,
        ),
    )


def live_scene(robot: FiveBar, modes: Sequence[int], waypoints: Sequence[float]) -> dict[str, Any]:
    """Return scene and links of a robot that moves through waypoints (m: x, y, x, y, ...) in working modes.

    With more than one working mode, the way between the waypoints is not straight, and not drawn.
    """
    places = list(zip(waypoints[::2], waypoints[1::2], strict=False))
    corners = places if len(modes) == 2 else []
    return {"scene": scene(robot, (modes[0], modes[1]), places, corners), "robot": links(robot)}
