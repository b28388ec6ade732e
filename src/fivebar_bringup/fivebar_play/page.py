# SPDX-License-Identifier: Apache-2.0
"""The page that explains by play: one file with the translated model, which needs no network and no server."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from fivebar_bringup.pages.rendering import render
from fivebar_bringup.pages.scripts import page_scripts
from fivebar_bringup.report.scene import links, scene
from fivebar_bringup.simulation.offline import simulate
from fivebar_control.model.kinematics import det_a, state_from_joints
from fivebar_control.workspace.loci import Type2, singular_loci
from fivebar_play.content import GOAL, PUSH_TIME, RECORDED, START, model, scenario_of
from fivebar_play.run import PlaySample

PACKAGE = "fivebar_play"

LOCUS_SAMPLES = 720
"""Postures along each closed curve of the loci."""

LOWEST_SHOWN = -0.075
"""Where the platform is on the lowest motion that the page shows (m)."""

PUSHES = (0.0, 0.5)
"""Forces (N) of the recorded runs."""

TITLE = "Through a singularity"


def page() -> str:
    """Return the page."""
    return rendered(data())


def rendered(content: Any) -> str:
    """Return the page with its data: scene, loci and recorded runs."""
    scripts = page_scripts(
        ("stage.js", "play_chart.js", "play.js"),
        content,
        "play-data",
        libraries=(),
        generated=(f'"use strict";\nconst model = {model()};',),
        package=PACKAGE,
    )
    setting = "A five-bar robot loses its grip where its two outer links lie on one line. Drag it there, and cross."
    return render("play.html", package=PACKAGE, title=TITLE, setting=setting, scripts=scripts)


def data() -> dict[str, Any]:
    """Return what the page draws and does not compute: the scene, the loci, and the runs of the predictive law."""
    scenario = scenario_of(RECORDED)
    robot, mode = scenario.five_bar(), scenario.working_mode
    loci = [branch for branch in singular_loci(robot, LOCUS_SAMPLES).type2 if branch.working_mode == mode]
    shown = scene(robot, mode, [START, GOAL, (0.0, LOWEST_SHOWN)], [])
    folded = {"locus": _lines(loci, "folded"), "path": [], "waypoints": []}
    return {
        "scene": shown | {"locus": _lines(loci, "stretched"), "waypoints": [], "second": folded},
        "robot": links(robot),
        "start": START,
        "recorded": [recorded(push) for push in PUSHES],
    }


def recorded(push: float) -> dict[str, Any]:
    """Return the run of the predictive law under a push (N), which the page shows and does not compute."""
    crossing = scenario_of(RECORDED).plan().crossings[0].time
    scenario = scenario_of(RECORDED, push=push, push_start=crossing - 0.5 * PUSH_TIME)
    robot = scenario.five_bar()
    rows = []
    for sample in simulate(scenario).samples:
        state = state_from_joints(robot, *sample.exact.position, *sample.exact.velocity)
        row = PlaySample(
            x=state.x,
            y=state.y,
            q11=state.leg1.q1,
            q21=state.leg2.q1,
            error=math.hypot(state.x - sample.reference.x, state.y - sample.reference.y),
            determinant=det_a(state),
            kappa=sample.supervisor.inverse_condition,
            sigma=0.0,
            asked1=math.nan if sample.requested is None else sample.requested.tau1,
            asked2=math.nan if sample.requested is None else sample.requested.tau2,
            command1=sample.command.tau1,
            command2=sample.command.tau2,
        )
        rows.append([float(f"{value:.6g}") if math.isfinite(value) else None for value in row])
    return {"push": push, "columns": PlaySample._fields, "rows": rows}


def _lines(loci: list[Type2], shape: str) -> list[list[list[float]]]:
    return [np.round(1e3 * locus.curve.platform, 3).tolist() for locus in loci if locus.shape == shape]
