# SPDX-License-Identifier: Apache-2.0
"""One case of a sweep, repeated alone: its metrics, scenario and figure."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from fivebar_bringup.bag.recording import FloatArray
from fivebar_bringup.odds.odds import PEAK_LIMIT
from fivebar_bringup.pages.style import GREY, INK, MOTORS, ZONE, house_style, new_figure, png
from fivebar_bringup.recorded.results import new_directory, write_results
from fivebar_bringup.report.workspace import draw_base, draw_map, draw_robot, frame, survey
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.case import case_of
from fivebar_bringup.simulation.engine import traced_crossing
from fivebar_bringup.simulation.engine_table import columns_of
from fivebar_control.loop.sampled_plan import sampled
from fivebar_control.model.singularity import NEAR_LOCUS
from fivebar_description.strict_yaml import InputError
from fivebar_studies.sweep.rows import REFUSED, SweepRow

LOWEST = -0.185
"""Lower edge of the map (m)."""


def save_case(rows: Sequence[SweepRow], out: Path) -> list[Path]:
    """Write CONTROLLER.yaml and CONTROLLER.png for each row of a case: scenario and figure of the run.

    Args:
        rows: of the case.
        out: new or empty directory.

    Raises:
        InputError: the planner refuses the case, or the directory cannot be used.
    """
    if rows[0].status == REFUSED:
        raise InputError(f"case {rows[0].case}: is refused, so there is nothing to save: {rows[0].reason}")
    directory = new_directory(out, "case")
    files: dict[str, str | bytes] = {}
    for row in rows:
        scenario = row.draw.scenario(row.controller)
        # a law from elsewhere has a colon in its name
        stem = row.controller.replace(":", ".")
        files[f"{stem}.yaml"] = scenario.to_yaml()
        files[f"{stem}.png"] = trace_png(scenario, row)
    write_results(directory, files)
    return [directory / name for name in files]


def trace_png(scenario: Scenario, row: SweepRow) -> bytes:
    """Return the figure of a run as PNG: path in the plane, error and torques over time."""
    robot, rate_hz = scenario.five_bar(), scenario.rate_hz
    plan = sampled(robot, scenario.plan(), rate_hz, scenario.lead_samples)
    _, table = traced_crossing(case_of(scenario), plan)
    run = columns_of(table)
    times = np.arange(len(table)) / rate_hz
    places = np.column_stack((run.x, run.y))
    wanted = plan.rows[: len(table), :2]
    with house_style():
        figure = new_figure(
            f"Case {row.case}, {row.controller}: {'success' if row.success else row.why_not.partition(';')[0]}",
            f"{row.status.replace('_', ' ')}; {_equipment(row)}; mass × {row.mass_scale:.2f}, inertia ×"
            f" {row.inertia_scale:.2f}, friction × {row.friction_scale:.2f}",
            5.6,
        )
        plane, error, torque = figure.subplot_mosaic(
            [["plane", "error"], ["plane", "torque"]], width_ratios=(1.0, 1.3)
        ).values()
        lowest = row.draw.size * LOWEST
        draw_map(plane, survey(robot, scenario.working_mode, lowest))
        for number, alpha in ((0, 0.35), (-1, 1.0)):
            motors, (x, y) = (float(run.q11[number]), float(run.q21[number])), places[number].tolist()
            draw_robot(plane, robot, motors, (x, y), alpha=alpha, width=2.4)
        plane.plot(*(1e3 * wanted.T), color=GREY, linestyle="--", zorder=4)
        plane.plot(*(1e3 * places.T), color=MOTORS[1], zorder=4.1)
        draw_base(plane, robot)
        frame(plane, robot, lowest)
        _shade(error, times, run.kappa)
        error.plot(times, 1e3 * np.hypot(*(places - wanted).T), color=INK)
        error.axhline(1e3 * row.draw.size * PEAK_LIMIT, color=GREY, linestyle="--", linewidth=1.0)
        error.set_ylabel("error in mm")
        _shade(torque, times, run.kappa)
        for motor, (applied, colour) in enumerate(zip((run.applied1, run.applied2), MOTORS, strict=True), start=1):
            torque.plot(times, applied, color=colour, label=f"motor {motor}")
        torque.set_ylabel("torque applied in Nm")
        torque.set_xlabel("time in s; shaded: 1/cond(A) below 0.05")
        torque.legend(loc="best")
        return png(figure)


def _equipment(row: SweepRow) -> str:
    sensors = "exact sensors" if row.encoder_counts is None else f"{row.encoder_counts} counts, estimator"
    return f"{sensors}, delay {row.delay_samples}, {row.duration:.2f} s"


def _shade(axes: Axes, times: FloatArray, kappa: FloatArray) -> None:
    near = kappa < NEAR_LOCUS
    axes.fill_between(
        times, 0.0, 1.0, where=near.tolist(), color=ZONE, alpha=0.55, transform=axes.get_xaxis_transform(), zorder=0.5
    )
    axes.set_xlim(times[0], times[-1] if len(times) > 1 else 1.0)
