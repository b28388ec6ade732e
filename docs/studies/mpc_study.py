# SPDX-License-Identifier: Apache-2.0
"""The span of the predictive law's horizon, and the cost of its weights: tables and figure of docs/laws.md.

`python docs/studies/mpc_study.py OUT.png` runs it all, which takes a minute or two.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fivebar_bringup.pages.style import BLUE, GREEN, GREY, PURPLE, VERMILION, house_style, new_figure, png
from fivebar_bringup.report.thesis import MIDDLE, MULTIPLE
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.case import case_of
from fivebar_bringup.simulation.engine import crossing
from fivebar_bringup.simulation.run_metrics import RunMetrics
from fivebar_control.laws.mpc import MpcSettings
from fivebar_control.laws.mpc_problem import prediction_matrices
from fivebar_control.laws.unified import input_map
from fivebar_control.loop.sampled_plan import sampled
from fivebar_control.model.kinematics import state_from_platform
from fivebar_control.model.singularity import inverse_condition
from fivebar_description.rounding import in_millimetres
from unified_sweep import PLANTS as ALL_PLANTS

FloatArray = NDArray[np.float64]

RATE_HZ = 500

PLANTS = {name: ALL_PLANTS[name] for name in ("as believed", "rig, from its encoders")}
"""On which the settings are compared."""

HORIZONS = {2: GREY, 5: PURPLE, 10: VERMILION, 25: BLUE, 50: GREEN}
"""Samples ahead for which the Gramian is drawn, and colours."""

DURATIONS = (0.5, 1.0, 2.0, 3.0)

SWEPT: dict[str, tuple[float, ...]] = {
    "horizon": (5, 10, 25, 35),
    "speed_time": (0.01, 0.03, 0.06),
    "step_weight": (1e-7, 2e-6, 1e-4),
    "weight": (1e-8, 3e-7, 1e-5),
}
"""Values of each setting, the others at their defaults."""

MOTIONS = ((MIDDLE, 0.5), (MIDDLE, 1.0), (MULTIPLE[:3], 0.5))
"""Waypoints and duration of a segment (s) of the crossings behind every row of the table."""


class Authority(NamedTuple):
    """Least authority over a horizon, sample by sample of a crossing.

    Attributes:
        kappa: float64[n], 1/cond(A) of the reference.
        least: float64[n], square root of the Gramian's least singular value (m/Nm): how far a torque of 1 Nm, as the
            root of the sum of squares over the horizon, moves the platform in the direction that it moves least.
    """

    kappa: FloatArray
    least: FloatArray


def authority(scenario: Scenario, horizon: int) -> Authority:
    """Return the authority along the first segment of a scenario, the state weighed as in the law's cost."""
    robot, path = scenario.five_bar(), scenario.plan().path
    count = round(scenario.durations()[0] * RATE_HZ) + 1
    states = []
    for sample in range(count + horizon):
        place = path.at(sample / RATE_HZ)
        states.append(state_from_platform(robot, scenario.working_mode, *place[:4]))
    maps = [input_map(robot, state) for state in states]
    inputs = np.array([one[:4] for one in maps if one is not None]).reshape(len(states), 2, 2)
    to_place, to_speed = (matrix[-1] for matrix in prediction_matrices(horizon, 1.0 / RATE_HZ))
    least = []
    for first in range(count):
        ahead = inputs[first : first + horizon]
        reached = np.concatenate(
            (to_place[:, None, None] * ahead, MpcSettings().speed_time * to_speed[:, None, None] * ahead), axis=1
        )
        gramian = np.einsum("nij,nkj->ik", reached, reached)
        least.append(np.sqrt(np.linalg.svd(gramian, compute_uv=False)[-1]))
    return Authority(np.array([inverse_condition(state) for state in states[:count]]), np.array(least))


class Row(NamedTuple):
    """A value of a setting, and the worst of some runs on each of `PLANTS`: error (m) and torque (Nm)."""

    setting: str
    value: float
    worst: dict[str, tuple[float, float]]


def sweep(run: Callable[[Scenario], RunMetrics]) -> Iterator[Row]:
    """Yield a row for every value of every setting."""
    for setting, values in SWEPT.items():
        for value in values:
            law = {setting: value}
            yield Row(
                setting, value, {plant: _worst(run, {"controller": "mpc", "law": law}, plant) for plant in PLANTS}
            )


def worst_of_unified(run: Callable[[Scenario], RunMetrics]) -> Row:
    """Return the same for the law that looks at one sample."""
    return Row("unified", 0.0, {plant: _worst(run, {"controller": "unified"}, plant) for plant in PLANTS})


def _worst(run: Callable[[Scenario], RunMetrics], controller: dict[str, Any], plant: str) -> tuple[float, float]:
    error = torque = 0.0
    for other in PLANTS[plant]:
        for waypoints, duration in MOTIONS:
            fields = {"name": "study", "waypoints": waypoints, "segment_duration": duration, **controller, **other}
            outcome = run(Scenario.model_validate(fields))
            error = max(error, np.inf if outcome.fault else outcome.error_peak)
            torque = max(torque, outcome.requested1, outcome.requested2)
    return error, torque


def run_once(scenario: Scenario) -> RunMetrics:
    """Run a scenario without a recording."""
    plan = sampled(scenario.five_bar(), scenario.plan(), scenario.rate_hz, scenario.lead_samples)
    return crossing(case_of(scenario), plan)


def line(row: Row) -> str:
    """Return a row of a table in Markdown: error in mm and torque in Nm."""
    name = "`unified`"
    if row.setting != "unified":
        chosen = " (default)" if row.value == getattr(MpcSettings(), row.setting) else ""
        name = f"`{row.setting}` {row.value:g}{chosen}"
    cells = [f"{in_millimetres(error, 3)}, {torque:.2f} Nm" for error, torque in row.worst.values()]
    return f"| {name} | " + " | ".join(cells) + " |"


def motion(waypoints: Sequence[Sequence[float]], duration: float) -> Scenario:
    """Return the scenario of a crossing."""
    fields = {"name": "study", "controller": "mpc", "waypoints": waypoints, "segment_duration": duration}
    return Scenario.model_validate(fields)


def draw() -> Figure:
    """Draw the authority over the distance from the locus, for several horizons and durations."""
    figure = new_figure(
        "What the motors can still do within a horizon",
        "least singular value of the Gramian (its root) along the first segment of the middle crossing",
        4.8,
        13.0,
    )
    panels = figure.subplots(1, len(DURATIONS), sharey=True)
    for axes, duration in zip(panels, DURATIONS, strict=True):
        scenario = motion(MIDDLE, duration)
        times = 1e3 * (np.arange(round(duration * RATE_HZ) + 1) / RATE_HZ - scenario.plan().crossings[0].time)
        for horizon, color in HORIZONS.items():
            found = authority(scenario, horizon)
            axes.semilogy(times, 1e3 * found.least, color=color, label=f"{horizon} samples")
        near = times[found.kappa < 0.056]
        axes.axvspan(near[0], near[-1], color=GREY, alpha=0.2)
        axes.set_xlim(-150.0, 150.0)
        axes.set_title(f"T = {duration:g} s")
        axes.set_xlabel("ms from the locus")
    panels[0].set_ylabel("least authority in mm/Nm")
    panels[0].legend()
    return figure


def main() -> None:
    """Draw the figure into the file that is given, and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("figure", type=Path, help="file of the figure (.png)")
    figure = parser.parse_args().figure
    with house_style():
        figure.write_bytes(png(draw()))
    print("| T | " + " | ".join(f"{horizon} samples" for horizon in HORIZONS) + " | κ < 0.056 for |")
    print("|---|" + "---|" * (len(HORIZONS) + 1))
    for name, waypoints in (("middle", MIDDLE), ("multiple", MULTIPLE)):
        for duration in DURATIONS:
            scenario = motion(waypoints, duration)
            found = [authority(scenario, horizon) for horizon in HORIZONS]
            near = found[0].kappa < 0.056
            cells = [f"{1e3 * np.min(one.least[near]):.2g} mm/Nm" for one in found]
            print(f"| {name}, {duration:g} s | " + " | ".join(cells) + f" | {1e3 * np.sum(near) / RATE_HZ:.0f} ms |")
    print()
    print("| setting | " + " | ".join(PLANTS) + " |")
    print("|---|" + "---|" * len(PLANTS))
    for row in chain((worst_of_unified(run_once),), sweep(run_once)):
        print(line(row), flush=True)


if __name__ == "__main__":
    main()
