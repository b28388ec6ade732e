# SPDX-License-Identifier: Apache-2.0
"""The table that a compiled run fills, with a row for every sample, and what it knows in the columns of any run."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from fivebar_bringup.simulation.case import Case, FloatArray
from fivebar_bringup.simulation.run_metrics import RunColumns, RunMetrics, metrics_of
from fivebar_control.laws.vhc_cartesian import line_constraint
from fivebar_control.loop.sampled_plan import DIRECTION_X, DIRECTION_Y, Sampled, X, Y
from fivebar_control.model.line import Line


class TraceRow(NamedTuple):
    """Columns of a trace, which has a row for each sample.

    Attributes:
        q11, q12, q21, q22, dq11, dq12, dq21, dq22: exact joints (rad, rad/s).
        estimated_x, estimated_y, estimated_vx, estimated_vy: platform motion that the controllers use, measured or
            estimated (m, m/s).
        sigma, kappa: the supervisor's state.
        requested1, requested2: torques requested for the sample (Nm), NaN once a fault is latched.
        command1, command2: torques commanded (Nm).
        applied1, applied2: torques applied over the period before the sample (Nm).
        read1, read2: what the motors' encoders read (rad).
        x, y: of the actual platform (m).
        det_a: of the actual robot.
        type1_distance: of its platform from the nearer leg's Type 1 boundary (m).
        from_path: of its platform from the path, whatever the time (m).
        mirror_deviations: standard deviations between the estimate and the other assembly mode, else infinite.
        misfit, misfit_offset, misfit_jump, misfit_error, misfit_strain: as in `RunMetrics`.
        loop_gap: gap (m) that the period before opened, before it was closed.
    """

    q11: float
    q12: float
    q21: float
    q22: float
    dq11: float
    dq12: float
    dq21: float
    dq22: float
    estimated_x: float
    estimated_y: float
    estimated_vx: float
    estimated_vy: float
    sigma: float
    kappa: float
    requested1: float
    requested2: float
    command1: float
    command2: float
    applied1: float
    applied2: float
    read1: float
    read2: float
    x: float
    y: float
    det_a: float
    type1_distance: float
    from_path: float
    mirror_deviations: float
    misfit: float
    misfit_offset: float
    misfit_jump: float
    misfit_error: float
    misfit_strain: float
    loop_gap: float


def columns_of(table: FloatArray) -> Any:
    """Return the columns of a table, float64[samples, columns of `TraceRow`], by their names, float64[samples] each."""
    return TraceRow(*table.T)


class RunEnd(NamedTuple):
    """The end of a run.

    Attributes:
        samples: samples made.
        fault, fault_sample: as in `RunMetrics`.
        applied1, applied2: torques (Nm) applied last, also where the robot did not get through its last period.
    """

    samples: int
    fault: int
    fault_sample: int
    applied1: float
    applied2: float


def metrics_of_table(case: Case, plan: Sampled, table: FloatArray, ended: RunEnd) -> RunMetrics:
    """Return the metrics of a run of a case along its plan from its table, float64[samples, columns of `TraceRow`]."""
    row, planned = columns_of(table), plan.rows[: len(table)]
    off_x, off_y = row.x - planned[:, X], row.y - planned[:, Y]
    segments = Line(*planned[:, [X, Y, DIRECTION_X, DIRECTION_Y]].T)
    columns = RunColumns(
        tracking_error=(off_x, off_y),
        from_reference=np.sqrt(off_x * off_x + off_y * off_y),
        from_path=row.from_path,
        from_segment=np.asarray(line_constraint(segments, row.x, row.y, 0.0, 0.0).h),
        det_a=row.det_a,
        sigma=row.sigma,
        requested=(row.requested1, row.requested2),
        applied=(np.append(row.applied1, ended.applied1), np.append(row.applied2, ended.applied2)),
        motor_angle=(row.q11, row.q21),
        estimate_error=np.zeros(1) if case.numbers.estimation is None else _estimate_errors(case, row),
        type1_distance=row.type1_distance,
        mirror_deviations=row.mirror_deviations,
        misfit=row.misfit,
        misfit_offset=row.misfit_offset,
        misfit_jump=row.misfit_jump,
        misfit_error=row.misfit_error,
        misfit_strain=row.misfit_strain,
        loop_gap=row.loop_gap,
    )
    of_columns = metrics_of(columns, case.numbers.control.limits.torque_limit)
    return of_columns._replace(fault=ended.fault, fault_sample=ended.fault_sample)


def _estimate_errors(case: Case, row: Any) -> FloatArray:
    """Return the distances (m) of the platform from where it was estimated, of the samples for which it was."""
    lead, samples = case.numbers.lead, len(row.x)
    then = np.flatnonzero(~case.numbers.missing[: max(0, samples - lead)])
    distances: FloatArray = np.hypot(
        row.estimated_x[then] - row.x[then + lead], row.estimated_y[then] - row.y[then + lead]
    )
    return distances
