# SPDX-License-Identifier: Apache-2.0
"""Runs cases, in this process or in several, and keeps the results that tables, rows and figures need."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from pydantic import TypeAdapter

from fivebar_bringup.bag.recording import FloatArray
from fivebar_bringup.pages.content import Picture
from fivebar_bringup.recorded.series import read_series
from fivebar_bringup.recorded.summary import Summary, summarize
from fivebar_bringup.recorded.timing import RunTiming
from fivebar_bringup.report.analysis import RunAnalysis
from fivebar_bringup.report.criterion_figure import crossing_residuals
from fivebar_bringup.simulation.column_metrics import rms
from fivebar_bringup.simulation.offline import simulate
from fivebar_bringup.simulation.run_in_memory import RunInMemory
from fivebar_control.estimation.imu_check import noise_floor
from fivebar_control.trajectory.planner import PlanRefused
from fivebar_studies.reproduce.cases import ReproductionCase

Drawings = tuple[str, ...]


class ReproductionRow(NamedTuple):
    """A line of reproduce.csv: the results of a run, without figures.

    Attributes:
        case: number of the run.
        label: what was run.
        refused: why the planner refused it.
        summary: its metrics as JSON, nothing where the planner refused it.
        crossing_residual_n: largest |m t_s^T xddot| of the reference on the locus.
        least_fraction, largest_fraction: of a segment's way at which it crosses.
        zones: how often sigma rose above zero.
        sigma_at_rest: largest sigma at the first and last sample.
        acceleration_outside_zones_m_s2: rms of the IMU's error outside the blending zones.
        noise_floor_m_s2: the noise floor of the sensor there.
        acceleration_m_s2, noise_floor_whole_m_s2: both over the whole run.
    """

    case: int
    label: str
    refused: str = ""
    summary: str = ""
    crossing_residual_n: float | None = None
    least_fraction: float | None = None
    largest_fraction: float | None = None
    zones: int | None = None
    sigma_at_rest: float | None = None
    acceleration_outside_zones_m_s2: float | None = None
    noise_floor_m_s2: float | None = None
    acceleration_m_s2: float | None = None
    noise_floor_whole_m_s2: float | None = None


class ReproductionResult(NamedTuple):
    """Results of a run.

    Attributes:
        case: what was run.
        row: its line.
        summary: its metrics, as in its own report; None where the planner refused it.
        pictures: requested figures, by name.
    """

    case: ReproductionCase
    row: ReproductionRow
    summary: Summary | None = None
    pictures: Mapping[str, bytes] = {}

    @property
    def completed(self) -> bool:
        """Whether the run was made and completed."""
        return self.summary is not None and not self.summary.not_completed_because

    @property
    def across(self) -> bool:
        """Whether the run made its planned changes of assembly mode."""
        summary = self.summary
        return summary is not None and summary.assembly_mode_changes == summary.planned_mode_changes

    @property
    def requested(self) -> float | None:
        """Largest torque requested of either motor (Nm)."""
        return None if self.summary is None else _larger(self.summary.torque_requested_peak_nm)

    @property
    def applied(self) -> float | None:
        """Largest torque applied by either motor (Nm)."""
        return None if self.summary is None else _larger(self.summary.torque_peak_nm)

    @property
    def constraint_error(self) -> float | None:
        """Largest |h| in the blending zones (m)."""
        return None if self.summary is None else self.summary.vhc_error_max_m

    @property
    def constraint_error_joint(self) -> float | None:
        """The same in motor angles (rad)."""
        return None if self.summary is None else self.summary.vhc_error_joint_max_rad

    @property
    def tracking_error(self) -> float | None:
        """Largest distance from the reference (m)."""
        return None if self.summary is None else self.summary.tracking_error_peak_m

    @property
    def saturated(self) -> int | None:
        """Samples that requested more than the drives can give."""
        return None if self.summary is None else self.summary.torque_saturated_samples

    @property
    def imu_ratio(self) -> float | None:
        """The IMU's error outside the zones over its noise floor."""
        return _ratio(self.row.acceleration_outside_zones_m_s2, self.row.noise_floor_m_s2)

    @property
    def imu_ratio_whole(self) -> float | None:
        """The same over the whole run."""
        return _ratio(self.row.acceleration_m_s2, self.row.noise_floor_whole_m_s2)

    @property
    def why_not(self) -> str:
        """Why the run was not made or not completed; empty where it was."""
        if self.row.refused:
            return f"refused: {self.row.refused}"
        return "" if self.summary is None else "; ".join(self.summary.not_completed_because)

    def picture(self, name: str, caption: str) -> Picture:
        """Return one of the figures under a name of its own."""
        case = self.case
        stem = f"{case.motion}_{case.controller}_{case.time_law}_{name}" + ("_imu" if case.imu else "")
        return Picture(stem, f"{caption} Run: {case.label}.", self.pictures[name])


Results = Mapping[ReproductionCase, ReproductionResult]


SUMMARY = TypeAdapter(Summary)


def result_of(case: ReproductionCase, row: ReproductionRow, drawings: Drawings) -> ReproductionResult:
    """Return the result of a case from its line; one with figures is run again for these."""
    summary = SUMMARY.validate_json(row.summary) if row.summary else None
    return ReproductionResult(case, row, summary, run_case(case, drawings).pictures if drawings else {})


def run_case(case: ReproductionCase, drawings: Sequence[str] = (), number: int = 0) -> ReproductionResult:
    """Run one case of a number without ROS and return its results."""
    scenario, row = case.scenario(), ReproductionRow(number, case.label)
    try:
        plan = scenario.plan()
    except PlanRefused as refusal:
        return ReproductionResult(case, row._replace(refused=str(refusal)))
    run = simulate(scenario)
    recording = RunInMemory(run, scenario)
    series = read_series(recording, scenario)
    summary = summarize(recording, series, scenario, RunTiming(runner="offline"))
    findings = RunAnalysis(scenario, plan, scenario.five_bar(), series, summary)
    fractions = [_fraction(findings, number) for number in range(len(plan.crossings))]
    outside = ~series.in_zone
    row = row._replace(
        summary=SUMMARY.dump_json(summary).decode(),
        crossing_residual_n=max((abs(residual) for residual in crossing_residuals(findings)), default=None),
        least_fraction=min(fractions, default=None),
        largest_fraction=max(fractions, default=None),
        zones=int(np.count_nonzero(np.diff(np.concatenate([[False], series.in_zone]).astype(np.int8)) > 0)),
        sigma_at_rest=float(max(series.sigma[0], series.sigma[-1])),
        acceleration_outside_zones_m_s2=rms(series.acceleration_error[outside]),
        noise_floor_m_s2=_noise_floor(series.reference[outside], scenario.imu.noise),
        acceleration_m_s2=rms(series.acceleration_error),
        noise_floor_whole_m_s2=_noise_floor(series.reference, scenario.imu.noise),
    )
    return ReproductionResult(case, row, summary, _draw(findings, drawings) if drawings else {})


def _noise_floor(reference: FloatArray, noise: float) -> float | None:
    """Return the noise floor (m/s^2) of an accelerometer over samples of the reference, [n, 6]."""
    if noise == 0.0:
        return 0.0
    return rms(np.array([noise_floor(noise, math.hypot(ax, ay)) for ax, ay in reference[:, 4:].tolist()]))


def _ratio(error: float | None, noise: float | None) -> float | None:
    return None if error is None or not noise else error / noise


def _fraction(run: RunAnalysis, number: int) -> float:
    """Return after which fraction of its segment's way a planned crossing comes."""
    crossing = run.plan.crossings[number]
    segment = run.plan.path.straight(crossing.segment)
    line = segment.line_at(crossing.time)
    way = (crossing.x - segment.start_x) * line.direction_x + (crossing.y - segment.start_y) * line.direction_y
    return way / math.hypot(segment.end_x - segment.start_x, segment.end_y - segment.start_y)


def _draw(run: RunAnalysis, names: Iterable[str]) -> dict[str, bytes]:
    # here, because only few cases are drawn and matplotlib takes long to load
    from fivebar_bringup.report.gallery import draw

    return {name: draw(run, name) for name in names}


def _larger(pair: tuple[float | None, float | None]) -> float | None:
    known = [value for value in pair if value is not None]
    return max(known, default=None)
