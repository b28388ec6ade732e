# SPDX-License-Identifier: Apache-2.0
"""The metrics of a run, and what became of it."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from itertools import groupby
from typing import Any

import numpy as np

from fivebar_bringup.bag.recording import FloatArray, Recording
from fivebar_bringup.recorded.outcome import RunOutcome, fault_name, outcome_of
from fivebar_bringup.recorded.run_odds import requested_odds
from fivebar_bringup.recorded.series import RunSeries
from fivebar_bringup.recorded.timing import RunTiming
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.column_metrics import finite, peak, rms
from fivebar_bringup.simulation.run_metrics import RunColumns, metrics_of
from fivebar_control.model.singularity import FOLDED, DistalLinks
from fivebar_control.scenario.guard_settings import motor_torque_limit
from fivebar_control.scenario.stopping import stop_cycles, stops_by_its_law
from fivebar_control.trajectory.path_distance import KEPT_TO, judged_distance, path_distances
from fivebar_control.trajectory.planner import Plan
from fivebar_control.trajectory.type1 import working_mode_changes
from fivebar_description.interface import FAULTS, JOINT_STATES, MOTOR_STATES
from fivebar_description.robot_file import UNKNOWN, ElbowsPass, read_robot
from fivebar_description.rounding import in_millimetres

ERROR_LIMIT = 0.050
"""The platform stays within this distance (m) of its reference throughout, whatever the tolerance."""

FINAL_ERROR_LIMIT = 0.002
"""The platform ends within this distance (m) of its reference."""

REALTIME = "realtime"
"""The mode of runs that follow the clock, as in timing.json."""

COMPLETED = "completed"
"""A deprecated field of summary.json: whether there is no reason in `not_completed_because`."""

MotorPair = tuple[float | None, float | None]


@dataclass(frozen=True)
class CycleTime:
    """Median, 99th percentile and maximum of a time (ms), as between two samples' recording."""

    p50: float
    p99: float
    max: float


@dataclass(frozen=True)
class PlannedCrossing:
    """A planned crossing of the Type 2 locus.

    Attributes:
        time_s: when, from sample 0 on.
        x, y: where (m).
        distal_links: "stretched" or "folded".
        elbows_pass: whether the elbows may pass each other, by the robot's file, where they do so; None where they do
            not.
    """

    time_s: float
    x: float
    y: float
    distal_links: DistalLinks
    elbows_pass: ElbowsPass | None


@dataclass(frozen=True)
class Summary:
    """The metrics of a run. None stands for one that does not apply or is not known.

    Attributes:
        outcome: what became of the run: "succeeded" where the whole motion was made without a fault and within the
            scenario's tolerance; "off_reference" where it was made without a fault, but beyond the tolerance, beside
            its goal or in another mode than planned; "stopped" by a fault, or before its last sample; "refused" where
            nothing has moved; "interrupted" by a signal. In real time samples may be late or missing, but for the last
            one.
        faults: names of the faults, each once, in the order in which they came.
        samples: samples recorded, of `planned_samples`.
        assembly_mode_changes: changes of the sign of det A, of `planned_mode_changes`.
        torque_peak_nm: largest applied torque of each motor (Nm).
        torque_requested_peak_nm: largest requested torque of each motor, before limits (Nm).
        tracking_error_max_m: largest error in x and in y (m).
        tracking_error_rms_m: root mean square of the error in x and in y (m).
        vhc_error_max_m: largest distance from the current path segment while sigma > 0 (m).
        vhc_error_joint_max_rad: the same for the motor angles, against those of the nearest path point (rad).
        sigma_max: largest blending weight; None for a controller that blends nothing.
        torque_saturated_samples: samples that requested more than the torque limit; None without a limit.
        estimate_error_max_m: largest distance of the estimated platform from the actual one at the time that the
            estimate is for, prediction over the drives' delay included (m); None without estimator.
        imu_acceleration_error_rms: of the IMU's minus the desired magnitude (m/s^2).
        vision_error_rms_m, vision_error_max_m: distance of the platform by the camera from that by the joints at the
            time of the exposure (m); None without a camera.
        vision_true_error_max_m: its largest distance from the exact platform (m), as far as that is recorded.
        cycle_time_ms: None where time did not pass, as in an offline run.
        latency_ms: from a sample to its torque at plant or drives; None where time did not pass.
        overruns: clock periods that passed without a torque: samples whose torque was late.
        missing_samples: planned samples up to the last one recorded that were not recorded: not measured, or lost by
            the recorder; in real time also those without a reference, where that was missing.
        simulated_s: nominal time from sample 0 to the last one recorded (s).
        wall_s: how long the run took (s).
        not_completed_because: why the run was stopped, refused or interrupted, or has ended in another mode than
            planned, beside its goal or more than 50 mm off its reference, in real time more than the tolerance; in
            words.
        fault_details: the faults' full texts.
        tracking_error_peak_m: largest distance from the reference (m).
        path_error_peak_m: largest distance from the path, whatever the time (m).
        dropped_messages: messages that the recorder is known to have missed.
        error_tolerance_m: the scenario's tolerance (m).
        within_tolerance: whether the platform is known to have stayed within it throughout, in real time at all samples
            that are not missing; from its reference, or from the path where the scenario says `judge: path`.
        judge: by which of both distances, "timed" or "path".
        stray_messages: recorded messages with other names, lengths or stamps than those of their topic have.
        not_judged: what is not known because the module of the run's law is not imported by what only reads a run.
        working_mode_changes: how often a leg went through Type 1, of `planned_working_mode_changes`.
        planned_crossings: of the Type 2 locus, in order of time.
        odds: how likely the motion was to succeed, of a program all its moves, as `RunOdds` has it; None where its
            planner has not found that out.
        requested_odds: the same of each requested motion whose planner has found it out, as `goal/status` has told.
    """

    outcome: RunOutcome
    faults: list[str]
    samples: int
    assembly_mode_changes: int
    torque_peak_nm: MotorPair
    torque_requested_peak_nm: MotorPair
    tracking_error_max_m: MotorPair
    tracking_error_rms_m: MotorPair
    vhc_error_max_m: float | None
    vhc_error_joint_max_rad: float | None
    sigma_max: float | None
    torque_saturated_samples: int | None
    estimate_error_max_m: float | None
    imu_acceleration_error_rms: float | None
    vision_error_rms_m: float | None
    vision_error_max_m: float | None
    vision_true_error_max_m: float | None
    cycle_time_ms: CycleTime | None
    latency_ms: CycleTime | None
    overruns: int | None
    missing_samples: int
    simulated_s: float | None
    wall_s: float | None
    name: str
    controller: str
    mode: str | None
    runner: str | None
    not_completed_because: list[str]
    fault_details: list[str]
    tracking_error_peak_m: float | None
    planned_samples: int
    planned_mode_changes: int
    working_mode_changes: int
    planned_working_mode_changes: int
    dropped_messages: int | None
    error_tolerance_m: float
    within_tolerance: bool
    stray_messages: int
    not_judged: list[str]
    planned_crossings: list[PlannedCrossing]
    odds: dict[str, Any] | None
    path_error_peak_m: float | None
    judge: str
    requested_odds: list[dict[str, Any]]

    @property
    def completed(self) -> bool:
        """Whether the motion was made, within the tolerance or not; deprecated, `outcome` takes its place."""
        warnings.warn("Summary.completed is deprecated: use Summary.outcome", DeprecationWarning, stacklevel=2)
        return not self.not_completed_because

    def __repr__(self) -> str:
        """Return the outcome in a line; `as_dict()` has every figure."""
        error = "unknown" if self.tracking_error_peak_m is None else f"{1e3 * self.tracking_error_peak_m:.3g} mm"
        return f"<Summary: {self.outcome}, largest distance from the reference {error}; as_dict() has all figures>"

    def as_dict(self) -> dict[str, Any]:
        """Return the summary as plain lists, numbers and texts, with no NaN or infinity in it."""
        values = asdict(self)
        content = {"outcome": values.pop("outcome").value, COMPLETED: not self.not_completed_because, **values}
        return {key: list(value) if isinstance(value, tuple) else value for key, value in content.items()}


def summarize(
    recording: Recording,
    series: RunSeries,
    scenario: Scenario,
    timing: RunTiming,
    planned: Plan | None = None,
    odds: dict[str, Any] | None = None,
) -> Summary:
    """Return the summary of a run; `planned` is what it was to do, by default the scenario's motion.

    The odds are those that its planner has found, if it has.

    Raises:
        BagError: the recorded faults or requests cannot be read.
        InputError: the scenario's motion is refused.
    """
    plan = scenario.plan() if planned is None else planned
    planned_samples = plan.path.samples(scenario.rate_hz) + 1
    planned_changes = len(plan.crossings)
    elbows_pass = read_robot(scenario.robot).elbows_pass if plan.crossings else UNKNOWN
    recorded = list(dict.fromkeys(recording.texts(FAULTS))) if recording.count(FAULTS) else []
    details = [*recorded, *(fault for fault in timing.faults if fault not in recorded)]
    distance = np.hypot(series.tracking_error[:, 0], series.tracking_error[:, 1])
    turned = working_mode_changes(np.sin(series.joint_position[:, [1, 3]]).tolist())
    clocked = timing.mode == REALTIME
    from_path = path_distances(series.reference, series.platform)
    torque_limit = motor_torque_limit(scenario)
    metrics = metrics_of(_columns(series, distance, from_path), math.inf if torque_limit is None else torque_limit)
    asked = not (math.isnan(metrics.requested1) and math.isnan(metrics.requested2))
    counted = judged_distance(scenario.judge, distance, np.where(np.isnan(distance), math.nan, from_path))
    judged = counted[~np.isnan(counted)] if clocked else counted
    within = bool(judged.size) and bool(np.all(judged <= scenario.error_tolerance))
    unrecorded = _unrecorded_samples(series, planned_samples, clocked)
    bridged = _bridged_samples(scenario, timing) if clocked else 0
    deviations = [
        *([] if details else _clock_steps(recording)),
        *_lost_tracking(distance, bridged, counted, KEPT_TO[scenario.judge]),
        *(_beyond_tolerance(counted, scenario.error_tolerance, KEPT_TO[scenario.judge]) if clocked else ()),
        *_wrong_changes("assembly", metrics.mode_changes, planned_changes),
        *_wrong_changes("working", turned, plan.working_mode_changes),
    ]
    reasons = [*details, *unrecorded, *deviations]
    vhc_error_joint = np.max(np.abs(series.vhc_error_joint), axis=1)
    dropped = recording.custom_data.get("dropped", "")
    return Summary(
        outcome=outcome_of(metrics.samples, not unrecorded, within and not deviations, recorded, timing.faults),
        faults=list(dict.fromkeys(map(fault_name, details))),
        samples=metrics.samples,
        assembly_mode_changes=metrics.mode_changes,
        torque_peak_nm=(finite(metrics.applied1), finite(metrics.applied2)),
        torque_requested_peak_nm=(finite(metrics.requested1), finite(metrics.requested2)),
        tracking_error_max_m=(finite(metrics.error_x), finite(metrics.error_y)),
        tracking_error_rms_m=(rms(series.tracking_error[:, 0]), rms(series.tracking_error[:, 1])),
        vhc_error_max_m=finite(metrics.constraint_error),
        vhc_error_joint_max_rad=peak(vhc_error_joint[series.in_zone]),
        sigma_max=finite(metrics.sigma_max) if scenario.scheme().blended else None,
        torque_saturated_samples=None if torque_limit is None or not asked else metrics.saturated,
        estimate_error_max_m=finite(metrics.estimate_error),
        imu_acceleration_error_rms=rms(series.acceleration_error),
        vision_error_rms_m=rms(np.hypot(*series.vision.error.T)),
        vision_error_max_m=peak(np.hypot(*series.vision.error.T)),
        vision_true_error_max_m=peak(np.hypot(*series.vision.true_error.T)),
        cycle_time_ms=cycle_time(series),
        latency_ms=CycleTime(**timing.latency_ms) if clocked and timing.latency_ms else None,
        overruns=timing.overruns,
        missing_samples=_missing(series) + (int(np.count_nonzero(np.isnan(distance))) if clocked else 0),
        simulated_s=float(series.time[-1]) if series.time.size else None,
        wall_s=timing.wall_s,
        name=scenario.name,
        controller=str(scenario.controller),
        mode=timing.mode,
        runner=timing.runner,
        not_completed_because=reasons,
        fault_details=details,
        tracking_error_peak_m=finite(metrics.error_peak),
        planned_samples=planned_samples,
        planned_mode_changes=planned_changes,
        working_mode_changes=turned,
        planned_working_mode_changes=plan.working_mode_changes,
        dropped_messages=int(dropped) if dropped.isdecimal() else None,
        error_tolerance_m=scenario.error_tolerance,
        within_tolerance=within,
        stray_messages=recording.strays,
        not_judged=_not_judged(recording, scenario, bridged),
        planned_crossings=planned_crossings(plan, elbows_pass),
        odds=odds,
        path_error_peak_m=finite(metrics.path_error),
        judge=scenario.judge,
        requested_odds=requested_odds(recording),
    )


def _clock_steps(recording: Recording) -> list[str]:
    """Return where a clock was set, of a run in which no other program has published on its topics."""
    steps = (recording.clock_step(topic) for topic in (MOTOR_STATES, JOINT_STATES) if recording.count(topic))
    return [step for step in steps if step is not None]


def planned_crossings(plan: Plan, elbows_pass: ElbowsPass) -> list[PlannedCrossing]:
    """Return the crossings of a plan of a robot whose elbows may pass each other, or may not."""
    return [
        PlannedCrossing(
            crossing.time,
            crossing.x,
            crossing.y,
            crossing.distal_links,
            elbows_pass if crossing.distal_links == FOLDED else None,
        )
        for crossing in plan.crossings
    ]


def cycle_time(series: RunSeries) -> CycleTime | None:
    """Return the times between the recording of consecutive samples; None where the log times equal the stamps."""
    periods = sample_periods(series)
    if not periods.size or np.array_equal(series.log_time_ns, series.stamp_ns):
        return None
    p50, p99 = np.percentile(periods, (50, 99)).tolist()
    return CycleTime(p50, p99, float(np.max(periods)))


def sample_periods(series: RunSeries) -> FloatArray:
    """Return the times (ms) between the recording of consecutive samples; missing samples are left out."""
    neighbours = np.diff(series.sample) == 1
    periods: FloatArray = np.diff(series.log_time_ns)[neighbours] / 1e6
    return periods


def _columns(series: RunSeries, from_reference: FloatArray, from_path: FloatArray) -> RunColumns:
    """Return the columns of a run of which metrics are made, with the platform's distances [n] (m)."""
    return RunColumns(
        tracking_error=series.tracking_error.T,
        from_reference=from_reference,
        from_path=from_path,
        from_segment=series.vhc_error,
        det_a=series.det_a,
        sigma=series.sigma,
        requested=series.torque_requested.T,
        applied=series.torque_applied.T,
        motor_angle=series.joint_position[:, [0, 2]].T,
        estimate_error=series.estimate_error,
    )


def _missing(series: RunSeries) -> int:
    """Return how many samples are missing between the first of the run and the last one recorded."""
    return int(series.sample[-1]) + 1 - series.sample.size if series.sample.size else 0


def _unrecorded_samples(series: RunSeries, planned: int, clocked: bool) -> Sequence[str]:
    """Return that samples are missing; in real time, where some are bridged, that the end of the run is.

    Real drives hold the robot at its goal until their bridge is stopped: samples after the last one are none too many.
    """
    reached = int(series.sample[-1]) + 1 if clocked and series.sample.size else series.sample.size
    if reached == planned or (clocked and reached > planned):
        return ()
    return (f"{series.sample.size} of the {planned} planned samples were recorded",)


def _beyond_tolerance(distance: FloatArray, tolerance: float, kept_to: str) -> Sequence[str]:
    largest = peak(distance)
    if largest is None or largest <= tolerance:
        return ()
    tolerated = f"tolerated are {tolerance * 1e3:g} mm"
    return (f"the platform was up to {in_millimetres(largest)} from its {kept_to}, {tolerated}",)


def _bridged_samples(scenario: Scenario, timing: RunTiming) -> int | None:
    """Return how many samples in a row may lack their reference in real time; None where the law would have to say."""
    if timing.stop_cycles is not None:
        return timing.stop_cycles
    return None if scenario.law_unopened and stops_by_its_law(scenario) else stop_cycles(scenario)


def _not_judged(recording: Recording, scenario: Scenario, bridged: int | None) -> list[str]:
    """Return what is not known of a run, of whose law only the name is known."""
    unknown = []
    why = f"the module of {scenario.controller} is not imported"
    if bridged is None:
        unknown.append(
            f"whether the tracking error was unknown for too long: {why}, and timing.json has no stop_cycles"
        )
    candidates = recording.torque_candidates() if scenario.law_unopened else ()
    if len(candidates) > 1:
        names = ", ".join(topic.name for topic in candidates)
        unknown.append(f"the torque that the law asked for: {why}, and the bag has {names}")
    return unknown


def _lost_tracking(distance: FloatArray, bridged: int | None, judged: FloatArray, kept_to: str) -> list[str]:
    """Return reasons where the error is beyond its limits, or unknown for more than the bridged samples in a row.

    None for the bridged samples leaves out how many these may be. `judged` is the distance by which the run is judged
    but for its end, `kept_to` from what.
    """
    reasons = []
    largest = peak(judged)
    if largest is not None and largest > ERROR_LIMIT:
        reasons.append(f"the platform was up to {in_millimetres(largest)} from its {kept_to}, allowed are 50 mm")
    unknown = np.isnan(distance)
    longest = max((len(list(run)) for lacks, run in groupby(unknown.tolist()) if lacks), default=0)
    if (bridged is not None and longest > bridged) or unknown[-1:].any():
        reasons.append(f"the tracking error is not known at {unknown.sum()} of the {distance.size} samples")
    if distance.size and distance[-1] > FINAL_ERROR_LIMIT:
        reasons.append(f"the platform ended {in_millimetres(distance[-1])} from its reference, allowed are 2 mm")
    return reasons


def _wrong_changes(mode: str, changes: int, planned: int) -> Sequence[str]:
    if changes == planned:
        return ()
    return (f"the {mode} mode changed {changes} times, planned are {planned}",)
