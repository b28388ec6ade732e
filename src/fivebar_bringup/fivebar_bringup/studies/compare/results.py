"""Runs one case of a comparison and computes its metrics."""

from __future__ import annotations

import time
from typing import Any, NamedTuple

import numpy as np

from fivebar_bringup.recorded.bag.recording import FloatArray
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
        wall_s: how long it took (s).
        outcome: what became of the run.
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
    wall_s: float = 0.0
    outcome: RunOutcome = RunOutcome.REFUSED

    @property
    def margin(self) -> float | None:
        """How far the largest applied torque stayed below the limit (Nm)."""
        return None if self.limit is None or self.applied is None else self.limit - self.applied

    @property
    def margin_share(self) -> float | None:
        """The same as a share of the limit."""
        return None if self.limit is None or self.margin is None else self.margin / self.limit

    def as_row(self) -> dict[str, Any]:
        """Return the result as one flat row of plain values."""
        case = self.case
        return {
            "motion": case.motion,
            "rig": case.rig,
            "controller": case.controller,
            "segment_duration_s": case.duration,
            "duration_s": sum(self.durations) if self.durations else None,
            "torque_limit_nm": self.limit,
            "completed": self.completed,
            "outcome": self.outcome.value,
            "why_not": "; ".join(self.why_not),
            "refused_by_screen": bool(self.objections) if self.made else None,
            "screen_says": "; ".join(self.objections),
            "tracking_error_peak_m": self.tracking_error,
            "tracking_error_rms_m": self.tracking_rms,
            "vhc_error_max_m": self.constraint_error,
            "torque_peak_nm": self.applied,
            "torque_requested_peak_nm": self.requested,
            "torque_saturated_samples": self.saturated,
            "samples_at_limit": self.at_limit,
            "samples": self.samples,
            "margin_nm": self.margin,
            "margin_share": self.margin_share,
            "energy_j": self.energy,
            "net_work_j": self.net_work,
        }


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
    began = time.monotonic()
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
        wall_s=time.monotonic() - began,
        outcome=summary.outcome,
    )


def _at_limit(applied: FloatArray, limit: float | None) -> int | None:
    """Return at how many samples a torque [n, 2] is at the limit; None without a limit."""
    return None if limit is None else int(np.count_nonzero(np.any(np.abs(applied) >= limit - AT_LIMIT, axis=1)))
