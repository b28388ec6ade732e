# SPDX-License-Identifier: Apache-2.0
"""The data of the moving figure: recorded runs as columns over time, the charts of them, and the scene behind them."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from fivebar_bringup.bag.recording import FloatArray, IntArray
from fivebar_bringup.pages.scripts import Scripts, page_scripts
from fivebar_bringup.recorded.series import RunSeries
from fivebar_bringup.report.analysis import RunAnalysis
from fivebar_bringup.report.charts import BLENDING, MOTOR_TORQUES, Chart, ChartLine
from fivebar_bringup.report.fault_marks import FaultMark
from fivebar_bringup.report.scene import corners_of, links, scene, shared_scene

LONGEST = 20_000
"""Rows of a replay. A longer run is thinned to about as many; its peaks stay."""

SCRIPTS = ("stage.js", "charts.js", "replay.js")


CHARTS = (
    Chart(
        "Torque in Nm",
        "Nm",
        0.02,
        (
            ChartLine("requested1", "motor 1, requested", "soft"),
            ChartLine("requested2", "motor 2, requested", "soft"),
            *MOTOR_TORQUES,
        ),
    ),
    BLENDING,
    Chart(
        "Distance from reference, h, in mm",
        "mm",
        0.002,
        (
            ChartLine("error", "distance", "first", "from the reference"),
            ChartLine("constraint", "h", "fourth", "across the path"),
            ChartLine("estimate", "error of the estimate", "soft"),
        ),
    ),
    Chart(
        "Acceleration error by IMU, in m/s²",
        "m/s²",
        0.02,
        (ChartLine("acceleration", "acceleration error", "first", "IMU less reference"),),
    ),
)
"""The charts below the robot; those of which a run has no values are left out."""

ALWAYS = ("time", "x", "y", "q11", "q21", "mode")
"""Columns that the robot on the canvas needs: s, mm, rad, and the sign of det A."""


def replay_scripts(runs: Sequence[tuple[str, RunAnalysis, Sequence[FaultMark]]]) -> Scripts | None:
    """Return what a page needs to play one or more runs, each with its name; None where one has no samples."""
    if not all(run.series.sample.size for _, run, _ in runs):
        return None
    return page_scripts(SCRIPTS, replay_data(runs), "replay-data")


def replay_data(runs: Sequence[tuple[str, RunAnalysis, Sequence[FaultMark]]]) -> dict[str, Any]:
    """Return scene, charts and columns (float32, little-endian, as base64) of runs as plain values."""
    tables = [_columns(run) for _, run, _ in runs]
    known = {name for table in tables for name, values in table.items() if np.any(np.isfinite(values))}
    charts = [chart._replace(lines=tuple(line for line in chart.lines if line.column in known)) for chart in CHARTS]
    scenes = [scene(run.series.robot, run.modes, run.scenario.waypoints, corners_of(run.plan)) for _, run, _ in runs]
    return {
        "scene": shared_scene(scenes),
        "charts": [chart.as_json() for chart in charts if chart.lines],
        "runs": [
            {
                "name": name,
                "robot": links(run.series.robot),
                "columns": {
                    column: _packed(values) for column, values in table.items() if column in known or column in ALWAYS
                },
                "zones": zones(run.series),
                "faults": [mark._asdict() for mark in marks],
            }
            for (name, run, marks), table in zip(runs, tables, strict=True)
        ],
    }


def kept_rows(series: RunSeries, longest: int = LONGEST) -> IntArray:
    """Return the rows of a replay: all of them, or of each of equal spans the first one and its peaks."""
    count = series.sample.size
    if count <= longest:
        return np.arange(count)
    peaked = [
        np.abs(series.torque_applied[:, 0]),
        np.abs(series.torque_applied[:, 1]),
        np.hypot(series.tracking_error[:, 0], series.tracking_error[:, 1]),
        -series.kappa,
    ]
    edges = np.linspace(0, count, longest // (1 + len(peaked)) + 1).astype(np.int64)
    rows = [edges[:-1], np.array([count - 1])]
    for values in peaked:
        size = np.where(np.isnan(values), -np.inf, values)
        rows.append(np.array([low + np.argmax(size[low:high]) for low, high in pairwise(edges.tolist())]))
    return np.unique(np.concatenate(rows))


def zones(series: RunSeries) -> list[list[float]]:
    """Return from when to when (s) sigma was above zero."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], series.in_zone, [False]]).astype(np.int8)))
    return [[float(series.time[first]), float(series.time[end - 1])] for first, end in edges.reshape(-1, 2).tolist()]


def _columns(run: RunAnalysis) -> dict[str, FloatArray]:
    """Return the columns [rows] of a run; a robot that is lost stays where it was last seen."""
    series = run.series
    rows = kept_rows(series)
    requested = series.torque_requested if run.torque_was_limited else np.full_like(series.torque_requested, np.nan)
    posture = {
        "x": 1e3 * series.platform[:, 0],
        "y": 1e3 * series.platform[:, 1],
        "q11": _unwrapped(series.joint_position[:, 0]),
        "q21": _unwrapped(series.joint_position[:, 2]),
        "mode": np.sign(series.det_a),
    }
    charted = {
        "torque1": series.torque_applied[:, 0],
        "torque2": series.torque_applied[:, 1],
        "requested1": requested[:, 0],
        "requested2": requested[:, 1],
        "sigma": series.sigma,
        "kappa": series.kappa,
        "error": 1e3 * np.hypot(series.tracking_error[:, 0], series.tracking_error[:, 1]),
        "constraint": 1e3 * series.vhc_error,
        "estimate": 1e3 * series.estimate_error,
        "acceleration": series.acceleration_error,
    }
    whole = {"time": series.time, **{name: _filled(values) for name, values in posture.items()}, **charted}
    return {name: values[rows] for name, values in whole.items()}


def _filled(values: FloatArray) -> FloatArray:
    """Return values with the last known one, or the first, in place of NaN; zeros where none is known."""
    known = np.isfinite(values)
    if not np.any(known):
        return np.zeros_like(values)
    last = np.maximum.accumulate(np.where(known, np.arange(values.size), 0))
    return np.where(known[last], values[last], values[known][0])


def _unwrapped(angles: FloatArray) -> FloatArray:
    """Return angles without jumps by a turn, so that an angle between two rows lies between theirs."""
    known = np.isfinite(angles)
    whole = angles.copy()
    whole[known] = np.unwrap(angles[known])
    return whole


def _packed(values: FloatArray) -> str:
    # beyond what a float32 holds nothing could be drawn
    limited = np.clip(values, -1e30, 1e30).astype("<f4")
    return base64.b64encode(limited.tobytes()).decode("ascii")
