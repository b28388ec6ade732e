# SPDX-License-Identifier: Apache-2.0
"""Errors, torques and success of all controllers over the duration, rig by rig."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.ticker import NullLocator

from fivebar_bringup.pages.content import Picture
from fivebar_bringup.pages.style import (
    AMBER,
    BLUE,
    GREEN,
    GREY,
    INK,
    PURPLE,
    SKY,
    VERMILION,
    WIDTH,
    house_style,
    log_axis,
    new_figure,
    png,
)
from fivebar_studies.compare.results import ComparedRun
from fivebar_studies.compare.verdicts import BOUNDS

LOOKS = {
    "ctc": (GREY, "v"),
    "multi_joint": (BLUE, "s"),
    "multi_cartesian": (GREEN, "o"),
    "multi_model_ctc": (PURPLE, "^"),
    "unified": (VERMILION, "D"),
    "lqr": (AMBER, "X"),
    "mpc": (SKY, "*"),
}
"""Colour and marker of each controller, the same in all figures."""

CAPTION = (
    "Above: largest distance from the reference. Middle: largest torque requested. Crosses: the run was not completed."
    " Dashed: bounds required of unified on this rig. Below: green where the run was completed."
)


def compare_figures(results: Sequence[ComparedRun]) -> list[Picture]:
    """Return one figure per motion: a column of panels for each rig."""
    motions = dict.fromkeys(result.case.motion for result in results)
    return [_figure(motion, [result for result in results if result.case.motion == motion]) for motion in motions]


def _figure(motion: str, results: Sequence[ComparedRun]) -> Picture:
    rigs = list(dict.fromkeys(result.case.rig for result in results))
    controllers = list(dict.fromkeys(result.case.controller for result in results))
    with house_style():
        figure = new_figure(
            f"{motion}: error, torque and success",
            "over the duration of a segment; crosses: not completed",
            height := 7.2 + 0.2 * len(controllers),
            max(WIDTH, 1.2 + 2.9 * len(rigs)),
        )
        rows = figure.subplots(
            3,
            len(rigs),
            sharex=True,
            sharey="row",
            squeeze=False,
            height_ratios=(3.0, 3.0, 0.8 + 0.28 * len(controllers)),
        )
        for column, rig in enumerate(rigs):
            runs = [result for result in results if result.case.rig == rig]
            error, torque, success = rows[:, column]
            error.set_title(rig)
            _lines(error, runs, controllers, [_scaled(run.row.tracking_error_peak_m) for run in runs])
            _lines(torque, runs, controllers, [run.row.torque_requested_peak_nm for run in runs])
            if rig in BOUNDS:
                case = runs[0].case
                bounds = (error, 1e3 * BOUNDS[rig].error * case.size), (torque, BOUNDS[rig].torque * case.torque)
                for axes, bound in bounds:
                    axes.axhline(bound, color=INK, linewidth=1.0, linestyle="--", zorder=1.5)
            _strip(success, runs, controllers)
        _log_over_all(rows[0, 0], [_scaled(run.row.tracking_error_peak_m) for run in results])
        _log_over_all(rows[1, 0], [run.row.torque_requested_peak_nm for run in results])
        rows[0, 0].set_ylabel("error in mm")
        rows[1, 0].set_ylabel("torque requested in Nm")
        handles, names = rows[0, 0].get_legend_handles_labels()
        figure.legend(handles, names, loc="upper right", bbox_to_anchor=(0.985, 1.0 - 0.06 / height), ncols=3)
        return Picture(f"{motion}_over_duration", f"{motion}. {CAPTION}", png(figure))


def look_of(controller: str) -> tuple[str, str]:
    """Return colour and marker of a controller; those from elsewhere share one look."""
    return LOOKS.get(controller, ("black", "P"))


def _scaled(error: float | None) -> float | None:
    return None if error is None else 1e3 * error


def _lines(axes: Axes, runs: Sequence[ComparedRun], controllers: Sequence[str], values: Sequence[float | None]) -> None:
    for controller in controllers:
        colour, marker = look_of(controller)
        points = sorted(
            (run.case.duration or 0.0, value, run.row.completed)
            for run, value in zip(runs, values, strict=True)
            if run.case.controller == controller and value is not None
        )
        axes.plot(
            [duration for duration, _, _ in points],
            [value for _, value, _ in points],
            color=colour,
            marker=marker,
            markersize=5,
            # an empty line that is not clipped takes room at the figure's corner
            clip_on=not points,
            label=controller,
        )
        for duration, value, completed in points:
            if not completed:
                axes.plot(duration, value, "X", color=colour, markersize=11, mec="white", clip_on=False)


def _log_over_all(axes: Axes, values: Sequence[float | None]) -> None:
    known = [value for value in values if value]
    if known:
        log_axis(axes, min(known), max(known))
    else:
        axes.set_ylim(0.0, 1.0)
        axes.set_yticks([])


def _strip(axes: Axes, runs: Sequence[ComparedRun], controllers: Sequence[str]) -> None:
    durations = sorted({run.case.duration or 0.0 for run in runs})
    axes.set_xscale("log")
    axes.set_xticks(durations, [f"{duration:g}" for duration in durations])
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set_xlim(0.8 * durations[0], 1.25 * durations[-1])
    axes.set_ylim(len(controllers) - 0.4, -0.6)
    axes.set_yticks(range(len(controllers)), list(controllers))
    axes.grid(False)
    axes.set_xlabel("T in s")
    for run in runs:
        row = controllers.index(run.case.controller)
        colour, marker = (GREEN, "s") if run.row.completed else (VERMILION, "X")
        axes.plot(run.case.duration or 0.0, row, marker, color=colour, markersize=9, mec="white")
