# SPDX-License-Identifier: Apache-2.0
"""Sensitivity of the unified law to its settings, which justifies the defaults.

`python docs/studies/unified_sweep.py OUT.png` runs it all, which takes some ten minutes, prints the
table of which docs/laws.md has a part, and draws its figure.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from matplotlib.figure import Figure

from fivebar_bringup.pages.style import BLUE, GREY, PURPLE, VERMILION, house_style, new_figure, png
from fivebar_bringup.report.thesis import MIDDLE, MULTIPLE
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.offline import Sample, simulate
from fivebar_control.laws.gains import UnifiedSettings
from fivebar_control.model.kinematics import state_from_joints
from fivebar_description.parameters import FiveBar
from fivebar_description.rounding import in_millimetres
from fivebar_studies.compare.verdicts import BOUNDS
from fivebar_studies.rigs.named import find_rig

DURATIONS = (0.5, 1.0, 2.0, 3.0)

PLANTS: dict[str, tuple[dict[str, Any], ...]] = {
    "as believed": ({},),
    "mass and friction wrong": (
        {"plant": {"mass_scale": 0.8, "friction_scale": 1.3}},
        {"plant": {"mass_scale": 1.2, "friction_scale": 0.7}},
    ),
    "rig, from its encoders": ({"estimator": "ekf", "plant": find_rig("realistic").plant},),
}
COLORS = dict(zip(PLANTS, (BLUE, VERMILION, PURPLE), strict=True))

SWEPT: dict[str, tuple[float, ...]] = {
    "weight": (0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0),
    "kp": (900.0, 1600.0, 2500.0, 6400.0, 10000.0, 14400.0, 22500.0),
    "kd": (80.0, 113.0, 160.0, 226.0, 320.0),
    "observer_rate": (0.0, 10.0, 20.0, 40.0, 80.0, 160.0),
}
"""Values of each setting, the others at their defaults; kd follows kp so that the damping stays critical."""

UNITS = {"weight": "(m/s²/Nm)²", "kp": "1/s²", "kd": "1/s", "observer_rate": "1/s"}

LIMITS = {"as believed": BOUNDS["ideal"], "rig, from its encoders": BOUNDS["realistic"]}


class WorstCase(NamedTuple):
    """The worst of some runs: largest error (m), largest root mean square error (m), largest torque (Nm)."""

    error: float
    rms: float
    torque: float


class SettingRow(NamedTuple):
    """One value of one setting, and the worst run with it on each of `PLANTS`."""

    setting: str
    value: float
    worst: dict[str, WorstCase]


def sweep(run: Callable[[Scenario], WorstCase]) -> Iterator[SettingRow]:
    """Yield a row for every value of every setting."""
    for setting, values in SWEPT.items():
        for value in values:
            unified = {setting: value, **({"kd": 2.0 * math.sqrt(value)} if setting == "kp" else {})}
            yield SettingRow(setting, value, {plant: _worst(run, plant, unified) for plant in PLANTS})


def _worst(run: Callable[[Scenario], WorstCase], plant: str, unified: dict[str, float]) -> WorstCase:
    results = [
        run(
            Scenario.model_validate(
                {
                    "name": "sweep",
                    "controller": "unified",
                    "waypoints": waypoints,
                    "segment_duration": duration,
                    "unified": unified,
                    **other,
                }
            )
        )
        for other in PLANTS[plant]
        for waypoints in (MIDDLE, MULTIPLE)
        for duration in DURATIONS
        # the slow multiple crossings take longest and are never the worst case
        if waypoints == MIDDLE or duration <= 1.0 or plant == "as believed"
    ]
    return WorstCase(*(max(figures) for figures in zip(*results, strict=True)))


def run_once(scenario: Scenario) -> WorstCase:
    """Run a scenario and return its metrics, infinite where a fault ended it."""
    run = simulate(scenario)
    if run.faults:
        return WorstCase(math.inf, math.inf, math.inf)
    robot, path = scenario.five_bar(), scenario.plan().path
    errors = []
    for sample in run.samples:
        desired = path.at(sample.number / scenario.rate_hz)
        x, y = _place(robot, sample)
        errors.append(math.hypot(x - desired.x, y - desired.y))
    torque = max(max(abs(sample.command[0]), abs(sample.command[1])) for sample in run.samples)
    return WorstCase(max(errors), math.sqrt(sum(error * error for error in errors) / len(errors)), torque)


def _place(robot: FiveBar, sample: Sample) -> tuple[float, float]:
    state = state_from_joints(robot, *sample.exact.position, *sample.exact.velocity)
    return state.x, state.y


def table(rows: Sequence[SettingRow]) -> str:
    """Return the rows as a table in Markdown: error in mm, its root mean square in mm, torque in Nm."""
    lines = ["| setting | " + " | ".join(PLANTS) + " |", "|---|" + "---|" * len(PLANTS)]
    for row in rows:
        chosen = " (default)" if row.value == getattr(UnifiedSettings(), row.setting) else ""
        cells = [
            f"{in_millimetres(w.error, 3)} / {in_millimetres(w.rms, 3)}, {w.torque:.2f} Nm" for w in row.worst.values()
        ]
        lines.append(f"| `{row.setting}` {row.value:g}{chosen} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def draw(rows: Sequence[SettingRow]) -> Figure:
    """Draw largest error and torque over each setting, with the required bounds."""
    figure = new_figure(
        "Settings of the unified law", "the worst of the middle and the multiple crossing, T = 0.5 to 3 s", 6.4, 13.0
    )
    panels = figure.subplots(2, len(SWEPT), sharex="col", sharey="row")
    for column, setting in enumerate(SWEPT):
        of_setting = [row for row in rows if row.setting == setting]
        default = getattr(UnifiedSettings(), setting)
        # a logarithmic axis has no zero: an observer that is off stands one step to the left
        values = [row.value or 5.0 for row in of_setting]
        for plant, color in COLORS.items():
            worst = [row.worst[plant] for row in of_setting]
            bound = LIMITS.get(plant)
            for axes, figures, limit in (
                (panels[0, column], [w.error * 1e3 for w in worst], bound and bound.error * 1e3),
                (panels[1, column], [w.torque for w in worst], bound and bound.torque),
            ):
                axes.plot(values, figures, color=color, marker="o", markersize=4.0, linewidth=1.6, label=plant)
                if limit is not None:
                    axes.axhline(limit, color=color, linewidth=0.9, linestyle=":")
        for axes in panels[:, column]:
            axes.set_xscale("log")
            axes.set_yscale("log")
            axes.axvline(default, color=GREY, linewidth=5.0, alpha=0.25, zorder=0.5)
            axes.minorticks_off()
            shown = sorted({0, values.index(default), len(values) - 1})
            axes.set_xticks([values[one] for one in shown], [f"{of_setting[one].value:g}" for one in shown])
        panels[1, column].set_xlabel(f"{setting} in {UNITS[setting]}")
    panels[0, 0].set_ylabel("largest error in mm")
    panels[1, 0].set_ylabel("largest torque in Nm")
    panels[0, 0].set_yticks([0.02, 0.05, 0.1, 0.2, 0.4, 0.8], ["0.02", "0.05", "0.1", "0.2", "0.4", "0.8"])
    panels[1, 0].set_yticks([1.0, 1.5, 2.0, 3.0, 5.0], ["1", "1.5", "2", "3", "5"])
    figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="upper right", ncols=3)
    return figure


def main() -> None:
    """Run the sweep, print its table and draw its figure."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("figure", type=Path, help="file of the figure (.png)")
    figure = parser.parse_args().figure
    rows = []
    for row in sweep(run_once):
        rows.append(row)
        print(f"{row.setting} {row.value:g}", file=sys.stderr)
    print(table(rows))
    with house_style():
        figure.write_bytes(png(draw(rows)))


if __name__ == "__main__":
    main()
