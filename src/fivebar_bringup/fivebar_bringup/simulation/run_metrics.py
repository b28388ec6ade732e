# SPDX-License-Identifier: Apache-2.0
"""Metrics of a compiled run, made of its table."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from fivebar_bringup.simulation.case import Case, FloatArray
from fivebar_bringup.simulation.column_metrics import largest, saturated, sign_changes
from fivebar_bringup.simulation.outcome import LEFT, Outcome, RunEnd, columns_of
from fivebar_control.laws.vhc_cartesian import line_constraint
from fivebar_control.loop.sampled_plan import DIRECTION_X, DIRECTION_Y, Sampled, X, Y
from fivebar_control.model.line import Line


def summarized(case: Case, plan: Sampled, table: FloatArray, ended: RunEnd) -> Outcome:
    """Return the metrics of a run of a case along its plan from its table, float64[samples, columns of `TraceRow`]."""
    numbers, places = case.numbers, plan.rows[: len(table)]
    row = columns_of(table)
    off_x, off_y = row.x - places[:, X], row.y - places[:, Y]
    distance = np.sqrt(off_x * off_x + off_y * off_y)
    left = np.flatnonzero(~(distance <= LEFT))
    line = Line(*places[:, [X, Y, DIRECTION_X, DIRECTION_Y]].T)
    off_line = np.asarray(line_constraint(line, row.x, row.y, 0.0, 0.0).h)[row.sigma > 0.0]
    limit = numbers.control.limits.torque_limit
    turned1, turned2 = np.diff(row.q11), np.diff(row.q21)
    work = np.abs(row.applied1[1:] * turned1) + np.abs(row.applied2[1:] * turned2)
    return Outcome(
        samples=ended.samples,
        fault=ended.fault,
        fault_sample=ended.fault_sample,
        mode_changes=sign_changes(row.det_a),
        error_x=largest(off_x),
        error_y=largest(off_y),
        error_peak=largest(distance),
        error_final=float(distance[-1]),
        left_sample=int(left[0]) if left.size else -1,
        path_error=largest(row.from_path),
        constraint_error=largest(off_line),
        requested1=largest(row.requested1),
        requested2=largest(row.requested2),
        applied1=max(largest(row.applied1), abs(ended.applied1)),
        applied2=max(largest(row.applied2), abs(ended.applied2)),
        saturated=saturated(np.column_stack((row.requested1, row.requested2)), limit),
        # one after the other: a sum by pairs rounds otherwise
        work=float(np.cumsum(work)[-1]) if work.size else 0.0,
        sigma_max=largest(row.sigma),
        type1_distance=float(np.fmin.reduce(row.type1_distance, initial=math.inf)),
        estimate_error=largest(_estimate_errors(case, row)) if numbers.estimation is not None else 0.0,
        mirror_deviations=float(np.fmin.reduce(row.mirror_deviations, initial=math.inf)),
        misfit=largest(row.misfit),
        misfit_offset=largest(row.misfit_offset),
        misfit_jump=largest(row.misfit_jump),
        misfit_error=largest(row.misfit_error),
        misfit_strain=largest(row.misfit_strain),
        loop_gap=largest(row.loop_gap),
    )


def _estimate_errors(case: Case, row: Any) -> FloatArray:
    """Return the distances (m) of the platform from where it was estimated, of the samples for which it was."""
    lead, samples = case.numbers.lead, len(row.x)
    then = np.flatnonzero(~case.numbers.missing[: max(0, samples - lead)])
    distances: FloatArray = np.hypot(
        row.estimated_x[then] - row.x[then + lead], row.estimated_y[then] - row.y[then + lead]
    )
    return distances
