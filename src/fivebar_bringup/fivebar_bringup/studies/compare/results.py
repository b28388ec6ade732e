"""Runs one case of a comparison and computes its metrics."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fivebar_bringup.bag.recording import FloatArray
from fivebar_bringup.recorded.outcome import RunOutcome
from fivebar_bringup.recorded.series import read_series
from fivebar_bringup.recorded.summary import peak, rms, summarize
from fivebar_bringup.recorded.timing import RunTiming
from fivebar_bringup.simulation.offline import simulate
from fivebar_bringup.simulation.run_in_memory import RunInMemory
from fivebar_bringup.studies.compare.cases import ComparisonCase
from fivebar_bringup.studies.compare.screening import objections
from fivebar_control.estimation.homing import check_declared
from fivebar_description.strict_yaml import InputError

AT_LIMIT = 1e-6
"""A torque this close (Nm) to the limit is at the limit."""


SEPARATOR = "; "
"""Between reasons in a line."""


class ComparisonResult(NamedTuple):
    """Metrics of a run; a case that the planner refused has none.

    Attributes:
        case: what was run.
        completed: whether the motion was made, within the tolerance or not.
        why_not: reasons where it was not.
        objections: why the planner's screen refuses the motion; empty where it does not.
        made: whether there was a run at all.
        tracking_error: largest distance from the reference (m).
        tracking_rms: root mean square of the distance (m).
        constraint_error: largest |h| in the blending zones (m), None where the controller has none.
        applied, requested: largest torque applied by, and requested of, a motor (Nm).
        saturated: samples that requested more than the limit, of `samples`; None without a limit.
        at_limit: samples with a motor at its limit; a controller that respects the limit requests no more.
        samples: samples made.
        limit: of the torque (Nm), None for none.
        energy: spent by the motors (J), see `MotorWork`.
        net_work: their net work (J), all of it lost to friction where the robot ends at rest.
        durations: of the segments (s).
        outcome: what became of the run.
        path_error: largest distance from the path, whatever the time (m).
    """

    case: ComparisonCase
    completed: bool = False
    why_not: tuple[str, ...] = ()
    objections: tuple[str, ...] = ()
    made: bool = False
    tracking_error: float | None = None
    tracking_rms: float | None = None
    constraint_error: float | None = None
    applied: float | None = None
    requested: float | None = None
    saturated: int | None = None
    at_limit: int | None = None
    samples: int | None = None
    limit: float | None = None
    energy: float | None = None
    net_work: float | None = None
    durations: tuple[float, ...] = ()
    outcome: RunOutcome = RunOutcome.REFUSED
    path_error: float | None = None

    @property
    def margin(self) -> float | None:
        """How far the largest applied torque stayed below the limit (Nm)."""
        return None if self.limit is None or self.applied is None else self.limit - self.applied

    @property
    def margin_share(self) -> float | None:
        """The same as a share of the limit."""
        return None if self.limit is None or self.margin is None else self.margin / self.limit


class ComparisonRow(NamedTuple):
    """A line of compare.csv: a result with plain values; what is not known is left empty.

    Attributes:
        case: number of the run.
        motion, rig, controller: what was run.
        segment_duration_s: of each segment, nothing for the quickest that the screen allows.
        duration_s: of the whole motion.
        torque_limit_nm: of the drives.
        completed: whether the motion was made, within the tolerance or not.
        outcome: what became of the run.
        why_not: reasons where it was not completed.
        refused_by_screen: whether the planner's screen refuses the motion; nothing where there was no run.
        screen_says: why.
        tracking_error_peak_m, tracking_error_rms_m: distance from the reference.
        vhc_error_max_m: largest |h| in the blending zones.
        torque_peak_nm, torque_requested_peak_nm: largest torque applied by, and requested of, a motor.
        torque_saturated_samples: samples that requested more than the limit.
        samples_at_limit: samples with a motor at its limit.
        samples: samples made.
        margin_nm, margin_share: how far the largest applied torque stayed below the limit, and as a share of it.
        energy_j, net_work_j: spent by the motors, and their net work.
        segments_s: durations of the segments, separated by blanks.
        path_error_peak_m: distance from the path, whatever the time.
    """

    case: int
    motion: str
    rig: str
    controller: str
    segment_duration_s: float | None
    duration_s: float | None
    torque_limit_nm: float | None
    completed: bool
    outcome: str
    why_not: str
    refused_by_screen: bool | None
    screen_says: str
    tracking_error_peak_m: float | None
    tracking_error_rms_m: float | None
    vhc_error_max_m: float | None
    torque_peak_nm: float | None
    torque_requested_peak_nm: float | None
    torque_saturated_samples: int | None
    samples_at_limit: int | None
    samples: int | None
    margin_nm: float | None
    margin_share: float | None
    energy_j: float | None
    net_work_j: float | None
    segments_s: str
    path_error_peak_m: float | None


def row_of(number: int, result: ComparisonResult) -> ComparisonRow:
    """Return the line of a result, of the case of a number."""
    case = result.case
    return ComparisonRow(
        number,
        case.motion,
        case.rig,
        case.controller,
        case.duration,
        sum(result.durations) if result.durations else None,
        result.limit,
        result.completed,
        result.outcome.value,
        SEPARATOR.join(result.why_not),
        bool(result.objections) if result.made else None,
        SEPARATOR.join(result.objections),
        result.tracking_error,
        result.tracking_rms,
        result.constraint_error,
        result.applied,
        result.requested,
        result.saturated,
        result.at_limit,
        result.samples,
        result.margin,
        result.margin_share,
        result.energy,
        result.net_work,
        " ".join(map(repr, result.durations)),
        result.path_error,
    )


def result_of(case: ComparisonCase, row: ComparisonRow) -> ComparisonResult:
    """Return the result of a case from its line."""
    return ComparisonResult(
        case,
        row.completed,
        _parts(row.why_not),
        _parts(row.screen_says),
        row.refused_by_screen is not None,
        row.tracking_error_peak_m,
        row.tracking_error_rms_m,
        row.vhc_error_max_m,
        row.torque_peak_nm,
        row.torque_requested_peak_nm,
        row.torque_saturated_samples,
        row.samples_at_limit,
        row.samples,
        row.torque_limit_nm,
        row.energy_j,
        row.net_work_j,
        tuple(map(float, row.segments_s.split())),
        RunOutcome(row.outcome),
        row.path_error_peak_m,
    )


def _parts(text: str) -> tuple[str, ...]:
    return tuple(text.split(SEPARATOR)) if text else ()


class MotorWork(NamedTuple):
    """Work of both motors (J).

    Attributes:
        spent: integral of |tau_i dq_i1/dt| over time, summed over both motors: the energy needed by drives
            that recover nothing when braking.
        net: integral of tau_i dq_i1/dt: kinetic energy left at the end plus friction losses.
    """

    spent: float
    net: float


def motor_work(angles: FloatArray, torques: FloatArray) -> MotorWork:
    """Return the work along a run.

    A torque is constant over a sampling period, so the net work of a period is exactly torque times angle turned; what
    is spent is only too small where a motor turns back within a period.

    Args:
        angles: [n, 2], q11 and q21 at the samples (rad).
        torques: [n, 2], applied over the period before each sample (Nm).
    """
    work = torques[1:] * np.diff(angles, axis=0)
    return MotorWork(float(np.sum(np.abs(work))), float(np.sum(work)))


def run_case(case: ComparisonCase) -> ComparisonResult:
    """Run one case without ROS and return its metrics."""
    try:
        scenario = case.scenario()
        plan = scenario.plan()
        if scenario.estimated:
            check_declared(scenario.five_bar(), scenario.homing())
    except InputError as refusal:
        return ComparisonResult(case, why_not=(str(refusal),))
    run = simulate(scenario)
    recording = RunInMemory(run, scenario)
    series = read_series(recording, scenario)
    summary = summarize(recording, series, scenario, RunTiming())
    work = motor_work(series.joint_position[:, [0, 2]], series.torque_applied)
    return ComparisonResult(
        case,
        not summary.not_completed_because,
        tuple(summary.not_completed_because),
        objections(scenario, plan),
        made=True,
        tracking_error=summary.tracking_error_peak_m,
        tracking_rms=rms(np.hypot(series.tracking_error[:, 0], series.tracking_error[:, 1])),
        constraint_error=summary.vhc_error_max_m,
        applied=peak(series.torque_applied),
        requested=peak(series.torque_requested),
        saturated=summary.torque_saturated_samples,
        at_limit=_at_limit(series.torque_applied, scenario.torque_limit),
        samples=summary.samples,
        limit=scenario.torque_limit,
        energy=work.spent,
        net_work=work.net,
        durations=scenario.durations(),
        outcome=summary.outcome,
        path_error=summary.path_error_peak_m,
    )


def _at_limit(applied: FloatArray, limit: float | None) -> int | None:
    """Return at how many samples a torque [n, 2] is at the limit; None without a limit."""
    return None if limit is None else int(np.count_nonzero(np.any(np.abs(applied) >= limit - AT_LIMIT, axis=1)))
