# SPDX-License-Identifier: Apache-2.0
"""Runs one case of a comparison and computes its metrics."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fivebar_bringup.bag.recording import FloatArray
from fivebar_bringup.recorded.outcome import RunOutcome
from fivebar_bringup.recorded.series import read_series
from fivebar_bringup.recorded.summary import summarize
from fivebar_bringup.recorded.timing import RunTiming
from fivebar_bringup.simulation.column_metrics import peak, rms
from fivebar_bringup.simulation.offline import simulate
from fivebar_bringup.simulation.run_in_memory import RunInMemory
from fivebar_control.estimation.homing import HomingContradicted, check_declared
from fivebar_control.scenario.guard_settings import motor_torque_limit
from fivebar_control.scenario.sensors import homing_of
from fivebar_control.trajectory.refusal import PlanRefused
from fivebar_description.strict_yaml import InputError
from fivebar_studies.compare.cases import ComparisonCase
from fivebar_studies.compare.screening import objections

AT_LIMIT = 1e-6
"""A torque this close (Nm) to the limit is at the limit."""


SEPARATOR = "; "
"""Between reasons in a line."""


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
    duration_s: float | None = None
    torque_limit_nm: float | None = None
    completed: bool = False
    outcome: str = RunOutcome.REFUSED.value
    why_not: str = ""
    refused_by_screen: bool | None = None
    screen_says: str = ""
    tracking_error_peak_m: float | None = None
    tracking_error_rms_m: float | None = None
    vhc_error_max_m: float | None = None
    torque_peak_nm: float | None = None
    torque_requested_peak_nm: float | None = None
    torque_saturated_samples: int | None = None
    samples_at_limit: int | None = None
    samples: int | None = None
    margin_nm: float | None = None
    margin_share: float | None = None
    energy_j: float | None = None
    net_work_j: float | None = None
    segments_s: str = ""
    path_error_peak_m: float | None = None

    @property
    def made(self) -> bool:
        """Whether there was a run at all."""
        return self.refused_by_screen is not None


class ComparedRun(NamedTuple):
    """A case with the line of its run."""

    case: ComparisonCase
    row: ComparisonRow


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


def run_case(number: int, case: ComparisonCase) -> ComparisonRow:
    """Run a case of a number without ROS and return its line."""
    row = ComparisonRow(number, case.motion, case.rig, case.controller, case.duration)
    try:
        scenario = case.scenario()
        plan = scenario.plan()
        if scenario.estimated:
            check_declared(scenario.five_bar(), homing_of(scenario))
    except (PlanRefused, HomingContradicted) as refusal:
        return row._replace(why_not=str(refusal))
    except InputError as error:
        return row._replace(why_not=str(error), outcome=RunOutcome.COULD_NOT_RUN.value)
    run = simulate(scenario)
    recording = RunInMemory(run, scenario)
    series = read_series(recording, scenario)
    summary = summarize(recording, series, scenario, RunTiming())
    work = motor_work(series.joint_position[:, [0, 2]], series.torque_applied)
    says, limit, applied = objections(scenario, plan), motor_torque_limit(scenario), peak(series.torque_applied)
    margin = None if limit is None or applied is None else limit - applied
    return row._replace(
        duration_s=sum(scenario.durations()),
        torque_limit_nm=limit,
        completed=not summary.not_completed_because,
        outcome=summary.outcome.value,
        why_not=SEPARATOR.join(summary.not_completed_because),
        refused_by_screen=bool(says),
        screen_says=SEPARATOR.join(says),
        tracking_error_peak_m=summary.tracking_error_peak_m,
        tracking_error_rms_m=rms(np.hypot(series.tracking_error[:, 0], series.tracking_error[:, 1])),
        vhc_error_max_m=summary.vhc_error_max_m,
        torque_peak_nm=applied,
        torque_requested_peak_nm=peak(series.torque_requested),
        torque_saturated_samples=summary.torque_saturated_samples,
        samples_at_limit=_at_limit(series.torque_applied, limit),
        samples=summary.samples,
        margin_nm=margin,
        margin_share=None if limit is None or margin is None else margin / limit,
        energy_j=work.spent,
        net_work_j=work.net,
        segments_s=" ".join(map(repr, scenario.durations())),
        path_error_peak_m=summary.path_error_peak_m,
    )


def _at_limit(applied: FloatArray, limit: float | None) -> int | None:
    """Return at how many samples a torque [n, 2] is at the limit; None without a limit."""
    return None if limit is None else int(np.count_nonzero(np.any(np.abs(applied) >= limit - AT_LIMIT, axis=1)))
