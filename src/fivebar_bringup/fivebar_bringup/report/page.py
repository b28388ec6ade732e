# SPDX-License-Identifier: Apache-2.0
"""The page of a run."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from fivebar_bringup.pages.content import Picture
from fivebar_bringup.pages.rendering import render
from fivebar_bringup.pages.scripts import Scripts
from fivebar_bringup.recorded.summary import REALTIME, MotorPair, Summary
from fivebar_bringup.report.analysis import zones_in_words
from fivebar_bringup.report.outcome_words import odds_of, outcome_sentence, requested_odds_of
from fivebar_bringup.report.thesis import thesis_figures
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.units import error_of, plain

RUNNERS = {"ros": "ROS 2 node graph", "offline": "one process, without ROS"}

UNKNOWN = plain(None, "")
"""A value that a run does not have."""


class Metric(NamedTuple):
    """A line of the results: what was found, its value, and what the thesis states; None where it states nothing."""

    name: str
    value: str
    thesis: str | None = None


def html_page(scenario: Scenario, summary: Summary, pictures: Sequence[Picture], replay: Scripts | None = None) -> str:
    """Return the page: outcome, replay, metrics beside those of the thesis, figures, scenario, how to repeat it all."""
    return render(
        "run.html",
        title=f"{scenario.name}: {summary.outcome}",
        setting=_setting(summary),
        scenario=scenario,
        summary=summary,
        sentence=outcome_sentence(summary),
        metrics=[metric for metric in _metrics(scenario, summary) if metric.value != UNKNOWN],
        pictures=pictures,
        scripts=replay,
        zones=zones_in_words(scenario),
        commands=_commands(summary),
    )


def overlay_page(names: tuple[str, str], runs: Sequence[tuple[Scenario, Summary]], replay: Scripts) -> str:
    """Return the page of two runs: their common replay, and their metrics beside each other."""
    first, second = ({metric.name: metric.value for metric in _metrics(*run)} for run in runs)
    return render(
        "overlay.html",
        title=f"{names[0]} and {names[1]}",
        setting="two runs with the same time axis · " + ", ".join(run[1].outcome for run in runs),
        names=names,
        rows=[(name, first.get(name, UNKNOWN), second.get(name, UNKNOWN)) for name in dict.fromkeys([*first, *second])],
        scripts=replay,
    )


def _setting(summary: Summary) -> str:
    parts = [f"controller {summary.controller}"]
    if summary.runner is not None:
        parts.append(RUNNERS.get(summary.runner, summary.runner))
    if summary.mode is not None:
        parts.append(summary.mode)
    return " · ".join(parts)


def _metrics(scenario: Scenario, summary: Summary) -> Iterable[Metric]:
    thesis = thesis_figures(scenario)
    cycle = summary.cycle_time_ms
    yield Metric("changes of assembly mode", str(summary.assembly_mode_changes), thesis.mode_changes)
    if summary.planned_working_mode_changes or summary.working_mode_changes:
        yield Metric("changes of working mode", str(summary.working_mode_changes))
    yield Metric("largest torque applied, motors 1 and 2", _both(summary.torque_peak_nm, "Nm"), thesis.torque)
    yield Metric("largest torque requested, motors 1 and 2", _both(summary.torque_requested_peak_nm, "Nm"))
    yield Metric("samples that requested more than the limit", _count(summary.torque_saturated_samples))
    yield Metric(
        "error of the virtual constraint |h| where σ > 0", error_of(summary.vhc_error_max_m, "m"), thesis.vhc_error
    )
    joint = error_of(summary.vhc_error_joint_max_rad, "rad")
    yield Metric("the same in motor angles", joint, thesis.vhc_error_joint)
    yield Metric("largest tracking error, x and y", _both(summary.tracking_error_max_m, "m"))
    yield Metric("root mean square tracking error, x and y", _both(summary.tracking_error_rms_m, "m"))
    yield Metric("largest distance from the reference", error_of(summary.tracking_error_peak_m, "m"))
    sigma = UNKNOWN if summary.sigma_max is None else f"{summary.sigma_max:.3g}"
    yield Metric("largest weight σ", sigma, "1 on the locus")
    imu = plain(summary.imu_acceleration_error_rms, "m/s²")
    yield Metric("root mean square acceleration error by the IMU", imu, "goes to zero")
    if summary.vision_error_rms_m is not None:
        seen = f"{error_of(summary.vision_error_rms_m, 'm')}, {error_of(summary.vision_error_max_m, 'm')}"
        yield Metric("camera minus joints: root mean square, largest", seen)
        yield Metric("camera minus exact platform, largest", error_of(summary.vision_true_error_max_m, "m"))
    yield Metric("largest error of the estimate", error_of(summary.estimate_error_max_m, "m"))
    if (odds := odds_of(summary)) is not None:
        yield Metric("odds before the run, on drawn robots", odds)
    if (requested := requested_odds_of(summary)) is not None:
        yield Metric("odds of requested motions, on drawn robots", requested)
    yield Metric("samples recorded of those planned", f"{summary.samples} of {summary.planned_samples}")
    # in lockstep, samples follow each other as fast as they are computed
    by_clock = summary.mode == REALTIME
    if by_clock:
        times = UNKNOWN if cycle is None else f"{cycle.p50:.2f}, {cycle.p99:.2f}, {cycle.max:.2f} ms"
        yield Metric("time between samples: median, 99 %, longest", times)
    if by_clock and summary.latency_ms is not None:
        latency = summary.latency_ms
        times = f"{latency.p50:.2f}, {latency.p99:.2f}, {latency.max:.2f} ms"
        yield Metric("from a sample to its torque: median, 99 %, longest", times)
    if by_clock:
        yield Metric("samples late, samples missing", f"{_count(summary.overruns)}, {summary.missing_samples}")
    else:
        yield Metric("samples missing", str(summary.missing_samples))
    yield Metric("messages that the recorder missed", _count(summary.dropped_messages))
    yield Metric("recorded messages of others", _count(summary.stray_messages))
    yield Metric("simulated time", plain(summary.simulated_s, "s"))
    yield Metric("wall time", plain(summary.wall_s, "s"))


def _both(pair: MotorPair, unit: str) -> str:
    text = plain if unit == "Nm" else error_of
    return ", ".join(text(value, unit) for value in pair)


def _count(value: int | None) -> str:
    return UNKNOWN if value is None else str(value)


def _commands(summary: Summary) -> str:
    again = "fivebar simulate scenario.yaml" if summary.runner == "offline" else "fivebar run scenario.yaml"
    if summary.mode == "realtime":
        again += " --realtime"
    return f"{again}\nfivebar report .\nros2 bag play bag"
