# SPDX-License-Identifier: Apache-2.0
"""What is read out of a bag: series joined by stamp, and a summary whose figures are those written here by hand."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
import pytest

from fivebar_bringup.bag import serialize
from fivebar_bringup.bag.reader import read_bag
from fivebar_bringup.bag.writer import BagWriter
from fivebar_bringup.errors import BagError
from fivebar_bringup.recorded.outcome import RunOutcome, outcome_of
from fivebar_bringup.recorded.series import RunSeries, read_series
from fivebar_bringup.recorded.summary import CycleTime, PlannedCrossing, Summary, summarize
from fivebar_bringup.recorded.timing import RunTiming, read_timing
from fivebar_bringup.report.outcome_words import outcome_details, outcome_rows
from fivebar_bringup.report.page import html_page
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_bringup.simulation.column_metrics import peak, rms, sign_changes
from fivebar_bringup.simulation.offline import simulate, write_bag
from fivebar_control.model.geometry import inverse_geometry
from fivebar_control.model.kinematics import state_from_platform
from fivebar_control.trajectory.path_distance import PATH
from fivebar_description.interface import (
    ACTIVE_JOINTS,
    FAULTS,
    IMU_DATA,
    IMU_ERROR,
    JOINT_STATES,
    JOINTS,
    REFERENCE,
    REFERENCE_NAMES,
    SUPERVISOR_NAMES,
    SUPERVISOR_STATE,
    TOPICS,
    TORQUE_COMMAND,
    Topic,
    sample_stamp_ns,
)
from fivebar_description.strict_yaml import InputError
from fivebar_sim.effects.settings import PlantSettings

RATE_HZ = 50
LAST = 10
PERIOD_NS = 20_000_000

DOWN = Scenario(
    name="down",
    waypoints=((0.0, 0.15), (0.0, 0.02)),
    segment_duration=0.2,
    rate_hz=RATE_HZ,
    zone={"rule": "fixed", "epsilon": 0.05},
)
"""Eleven samples straight down through the locus: one change of assembly mode."""

Pairs = Mapping[int, tuple[float, float]]
Record = Callable[..., Path]


@pytest.fixture
def record(tmp_path: Path) -> Record:
    """Writes a bag of DOWN in which the platform is where it should be, except for what the arguments say."""

    def write(
        *,
        samples: Collection[int] = range(LAST + 1),
        offset: tuple[float, float] = (0.0, 0.0),
        efforts: Pairs | None = None,
        commands: Pairs | None = None,
        sigmas: Mapping[int, float] | None = None,
        without: Collection[tuple[Topic, int]] = (),
        only: Collection[Topic] = TOPICS,
        turns: int = 0,
        faults: Collection[str] = (),
        log_times: Mapping[int, int] | None = None,
        custom: Mapping[str, str] | None = None,
        extra: Collection[tuple[Topic, int, bytes]] = (),
    ) -> Path:
        path = DOWN.plan().path
        directory = tmp_path / "bag"
        with BagWriter(directory, [topic for topic in TOPICS if topic in only]) as bag:
            for sample in samples:
                stamp = sample_stamp_ns(sample, RATE_HZ)
                log_time = (log_times or {}).get(sample, stamp)
                desired = path.at(sample / RATE_HZ)
                tau1, tau2 = (efforts or {}).get(sample, (0.0, 0.0))
                x, y = desired.x + offset[0], desired.y + offset[1]
                position, velocity = joints_at(x, y, desired.vx, desired.vy)
                position = tuple(angle + 2.0 * math.pi * turns for angle in position)
                messages = {
                    JOINT_STATES: serialize.joint_state(stamp, JOINTS, position, velocity, (tau1, 0.0, tau2, 0.0)),
                    REFERENCE: serialize.joint_state(stamp, REFERENCE_NAMES, desired[:4], desired[2:]),
                    SUPERVISOR_STATE: serialize.joint_state(
                        stamp, SUPERVISOR_NAMES, ((sigmas or {}).get(sample, 0.0), 0.5)
                    ),
                    TORQUE_COMMAND: serialize.joint_state(
                        stamp, ACTIVE_JOINTS, effort=(commands or {}).get(sample, (0.0, 0.0))
                    ),
                }
                for topic, data in messages.items():
                    if topic in only and (topic, sample) not in without:
                        bag.write(topic, log_time, data)
            for topic, log_time, data in extra:
                bag.write(topic, log_time, data)
            for fault in faults:
                bag.write(FAULTS, sample_stamp_ns(LAST, RATE_HZ), serialize.string(fault))
            bag.close(custom if custom is not None else {"dropped": "0"})
        return directory

    return write


def joints_at(x: float, y: float, vx: float, vy: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Joint angles (rad) and rates (rad/s) of the elbows-outwards robot with its platform at a place (m, m/s)."""
    state = state_from_platform(DOWN.five_bar(), (1, -1), x, y, vx, vy)
    one, two = state.leg1, state.leg2
    return (one.q1, one.q2, two.q1, two.q2), (one.dq1, one.dtheta - one.dq1, two.dq1, two.dtheta - two.dq1)


def series_of(directory: Path, scenario: Scenario = DOWN) -> RunSeries:
    return read_series(read_bag(directory), scenario)


def summary_of(directory: Path, scenario: Scenario = DOWN, timing: RunTiming | None = None) -> Summary:
    recording = read_bag(directory)
    return summarize(recording, read_series(recording, scenario), scenario, timing or RunTiming())


def strict_json(summary: Summary) -> dict[str, object]:
    content: dict[str, object] = json.loads(json.dumps(summary.as_dict(), allow_nan=False))
    return content


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (1.5e-4, "at most 0.15 mm"),
        (9.96e-3, "at most 9.96 mm"),
        # 0.00 would say that there is none
        (2.7e-6, "at most 0.003 mm"),
        (4e-8, "at most 0.00004 mm"),
    ],
)
def test_the_verdict_tells_even_a_small_error(record: Record, error: float, words: str) -> None:
    summary = replace(summary_of(record()), tracking_error_peak_m=error)
    assert f"{words} from the reference" in outcome_details(summary)
    assert f"{words} from the reference" in html_page(DOWN, summary, ())


def test_a_few_rows_tell_a_run_with_units(record: Record) -> None:
    summary = replace(
        summary_of(record()),
        tracking_error_peak_m=1.49e-4,
        tracking_error_rms_m=(3e-5, 4e-5),
        torque_peak_nm=(0.5475, None),
        torque_requested_peak_nm=(2.5, 3.0),
        torque_saturated_samples=7,
        faults=["torque_excessive"],
        overruns=2,
        dropped_messages=3,
        not_judged=["the torque"],
        odds=None,
        planned_crossings=[
            PlannedCrossing(0.1, 0.0, 0.0845, "stretched", None),
            PlannedCrossing(0.2, 0.03, 0.14, "folded", "unknown"),
            PlannedCrossing(0.3, 0.03, 0.14, "folded", True),
        ],
    )
    assert dict(outcome_rows(summary)) == {
        "motion": "0.20 s, 11 of 11 samples, 1 change of assembly mode",
        "error": "at most 0.15 mm, root mean square 0.05 mm, tolerance 2 mm",
        "torque": "at most 0.55 and – Nm of motors 1 and 2;"
        " 7 samples asked for more than the limit, up to 2.50 and 3.00 Nm",
        "faults": "torque_excessive",
        "warnings": "2 samples late; 3 messages not recorded; the elbows pass each other, and the robot's file does not"
        " say whether they can (elbows_pass: unknown) at (0.0300, 0.1400) m; the torque",
    }
    unknown = dict(outcome_rows(replace(summary, tracking_error_peak_m=None, estimate_error_max_m=2.1e-4)))
    assert (unknown["error"], unknown["estimate"]) == ("not known", "at most 0.21 mm from the platform")


def test_a_perfect_run_is_completed(record: Record) -> None:
    summary = summary_of(record())
    assert summary.outcome == RunOutcome.SUCCEEDED
    assert summary.not_completed_because == []
    assert (summary.samples, summary.planned_samples) == (11, 11)
    assert (summary.assembly_mode_changes, summary.planned_mode_changes) == (1, 1)
    assert summary.simulated_s == 0.2
    assert summary.tracking_error_peak_m == pytest.approx(0.0, abs=1e-12)
    assert (summary.name, summary.controller) == ("down", "multi_cartesian")


def test_real_drives_show_what_the_estimator_believes(record: Record) -> None:
    """There is no ground truth; the estimate of a sample is for the time of its reference, one sample later."""
    estimating = DOWN.model_copy(
        update={
            "controller": "unified",
            "estimator": "ekf",
            "plant": PlantSettings(encoder_counts=20_000, delay_samples=1),
        }
    )
    assert estimating.lead_samples == 1
    directory = record(offset=(0.001, 0.0))
    series = series_of(directory, estimating)
    assert series.tracking_error[:, 0] == pytest.approx(np.full(11, 0.001), abs=1e-12)
    assert np.isnan(series.estimate_error).all()
    assert summary_of(directory, estimating).estimate_error_max_m is None


def test_errors_are_those_of_a_shifted_platform(record: Record) -> None:
    """1 mm to the right and 1 mm too low throughout; n = (-1, 0) on the way down, so h = -1 mm."""
    directory = record(offset=(0.001, -0.001), sigmas={4: 0.5, 5: 1.0})
    series = series_of(directory)
    assert series.vhc_error == pytest.approx(np.full(11, -0.001), abs=1e-12)
    assert series.tracking_error[3] == pytest.approx((0.001, -0.001), abs=1e-12)
    summary = summary_of(directory)
    assert summary.tracking_error_max_m == pytest.approx((0.001, 0.001), abs=1e-12)
    assert summary.tracking_error_rms_m == pytest.approx((0.001, 0.001), abs=1e-12)
    assert summary.tracking_error_peak_m == pytest.approx(math.sqrt(2.0) * 0.001, abs=1e-12)
    assert summary.vhc_error_max_m == pytest.approx(0.001, abs=1e-12)
    assert summary.sigma_max == 1.0
    assert summary.outcome == RunOutcome.SUCCEEDED


def test_constraint_errors_count_in_the_zones_only(record: Record) -> None:
    """sigma > 0 at sample 5 alone: the joint error is that of 1 mm beside the path at y(0.1 s) = 85 mm."""
    summary = summary_of(record(offset=(0.001, 0.0), sigmas={5: 1.0}))
    robot = DOWN.five_bar()
    beside, on_path = (inverse_geometry(robot, (1, -1), x, 0.085) for x in (0.001, 0.0))
    expected = max(abs(beside.q11 - on_path.q11), abs(beside.q21 - on_path.q21))
    assert expected > 0.001
    assert summary.vhc_error_joint_max_rad == pytest.approx(expected, rel=1e-9)


def test_without_a_zone_there_is_no_constraint_error(record: Record) -> None:
    summary = summary_of(record(offset=(0.001, 0.0)))
    assert summary.vhc_error_max_m is None
    assert summary.vhc_error_joint_max_rad is None
    assert summary.sigma_max == 0.0


def test_full_turns_of_the_joints_are_no_error(record: Record) -> None:
    series = series_of(record(turns=3))
    assert series.vhc_error_joint == pytest.approx(np.zeros((11, 2)), abs=1e-9)


def test_a_run_that_ends_beside_its_goal_is_off_its_reference(record: Record) -> None:
    """3 mm is fine on the way, for a tolerance of 5 mm, but not at the end (2 mm allowed)."""
    summary = summary_of(record(offset=(0.0, 0.002999)), DOWN.model_copy(update={"error_tolerance": 5e-3}))
    assert (summary.outcome, summary.within_tolerance) == (RunOutcome.OFF_REFERENCE, True)
    assert summary.not_completed_because == ["the platform ended 3.00 mm from its reference, allowed are 2 mm"]


def test_a_run_that_was_far_off_on_the_way_is_off_its_reference(record: Record) -> None:
    path = DOWN.plan().path
    stamp = sample_stamp_ns(3, RATE_HZ)
    there = path.at(3 / RATE_HZ)
    position, velocity = joints_at(0.059999, there.y, 0.0, 0.0)
    stray = serialize.joint_state(stamp, JOINTS, position, velocity, (0.0,) * 4)
    samples = [sample for sample in range(LAST + 1) if sample != 3]
    reference = serialize.joint_state(stamp, REFERENCE_NAMES, there[:4], there[2:])
    directory = record(samples=samples, extra=[(JOINT_STATES, stamp, stray), (REFERENCE, stamp, reference)])
    summary = summary_of(directory)
    assert "the platform was up to 60.00 mm from its reference, allowed are 50 mm" in summary.not_completed_because
    assert summary.outcome == RunOutcome.OFF_REFERENCE


def test_peaks_are_magnitudes_per_motor(record: Record) -> None:
    summary = summary_of(
        record(
            efforts={2: (0.5, -0.25), 4: (-1.5, 0.125)},
            commands={1: (0.5, -0.25), 3: (-12.0, 0.125), 5: (10.0, 10.5), 6: (10.0, -10.0)},
        )
    )
    assert summary.torque_peak_nm == (1.5, 0.25)
    assert summary.torque_requested_peak_nm == (12.0, 10.5)
    # samples 3 and 5 ask for more than 10 Nm, sample 6 for just 10 Nm
    assert summary.torque_saturated_samples == 2


def test_without_a_limit_nothing_saturates(record: Record) -> None:
    unlimited = DOWN.model_copy(update={"plant": DOWN.plant._replace(torque_limit=None)})
    assert summary_of(record(commands={3: (1e6, 0.0)}), unlimited).torque_saturated_samples is None


def test_what_was_not_recorded_is_null(record: Record) -> None:
    content = strict_json(summary_of(record(only=[JOINT_STATES], custom={})))
    assert content["torque_requested_peak_nm"] == [None, None]
    assert content["torque_peak_nm"] == [0.0, 0.0]
    assert content["tracking_error_max_m"] == [None, None]
    assert content["tracking_error_rms_m"] == [None, None]
    for name in (
        "tracking_error_peak_m",
        "vhc_error_max_m",
        "vhc_error_joint_max_rad",
        "sigma_max",
        "torque_saturated_samples",
        "estimate_error_max_m",
        "imu_acceleration_error_rms",
        "vision_error_rms_m",
        "vision_error_max_m",
        "vision_true_error_max_m",
        "cycle_time_ms",
        "overruns",
        "wall_s",
        "mode",
        "runner",
        "dropped_messages",
    ):
        assert content[name] is None, name
    assert (content["outcome"], content["completed"]) == ("off_reference", False)
    assert content["not_completed_because"] == ["the tracking error is not known at 11 of the 11 samples"]


def test_a_lost_message_leaves_nan_in_its_row_alone(record: Record) -> None:
    series = series_of(record(without=[(REFERENCE, 4), (TORQUE_COMMAND, 7)]))
    assert np.flatnonzero(np.isnan(series.reference[:, 0])).tolist() == [4]
    assert np.flatnonzero(np.isnan(series.torque_requested[:, 1])).tolist() == [7]
    assert not np.any(np.isnan(series.platform))


def test_an_unknown_tracking_error_is_not_taken_for_a_small_one(record: Record) -> None:
    summary = summary_of(record(without=[(REFERENCE, 4)]))
    assert summary.not_completed_because == ["the tracking error is not known at 1 of the 11 samples"]
    assert summary.tracking_error_peak_m == pytest.approx(0.0, abs=1e-12)


def test_the_first_of_several_messages_with_a_stamp_counts(record: Record) -> None:
    """A blender that stops says zero torque once more, under its last stamp."""
    last = sample_stamp_ns(LAST, RATE_HZ)
    zero = serialize.joint_state(last, ACTIVE_JOINTS, effort=(0.0, 0.0))
    directory = record(commands={LAST: (3.0, -2.0)}, extra=[(TORQUE_COMMAND, last + 1, zero)])
    assert series_of(directory).torque_requested[-1].tolist() == [3.0, -2.0]


def test_a_message_of_no_sample_is_left_out(record: Record) -> None:
    """The trajectory generator is one sample ahead, and something may be off the grid."""
    ahead = sample_stamp_ns(LAST + 1, RATE_HZ)
    far = serialize.joint_state(ahead, REFERENCE_NAMES, (9.0,) * 4, (9.0,) * 4)
    off_grid = serialize.joint_state(ahead + 7, REFERENCE_NAMES, (8.0,) * 4, (8.0,) * 4)
    series = series_of(record(extra=[(REFERENCE, ahead, far), (REFERENCE, ahead, off_grid)]))
    assert series.sample.tolist() == list(range(11))
    assert np.max(series.reference[:, 0]) < 1.0


def test_a_run_cut_short(record: Record) -> None:
    summary = summary_of(record(samples=range(6), faults=["plant_diverged: after sample 5"]))
    assert summary.outcome == RunOutcome.STOPPED
    assert summary.samples == 6
    assert summary.simulated_s == pytest.approx(0.1)
    assert summary.faults == ["plant_diverged"]
    assert summary.not_completed_because[:2] == [
        "plant_diverged: after sample 5",
        "6 of the 11 planned samples were recorded",
    ]


def test_a_run_that_never_began(record: Record) -> None:
    summary = summary_of(record(samples=(), faults=["nodes_missing: not ready within 20 s: blender"]))
    assert summary.outcome == RunOutcome.REFUSED
    assert summary.samples == 0
    content = strict_json(summary)
    assert content["faults"] == ["nodes_missing"]
    assert content["simulated_s"] is None
    assert content["torque_peak_nm"] == [None, None]


def test_missing_samples_leave_a_gap(record: Record) -> None:
    series = series_of(record(samples=(0, 1, 5, 6)))
    assert series.sample.tolist() == [0, 1, 5, 6]
    assert series.time == pytest.approx([0.0, 0.02, 0.1, 0.12])


def test_faults_are_named_once_in_their_order_and_told_in_full(record: Record) -> None:
    timing = RunTiming(faults=["node_died: blender ended with status 1", "candidate_missing: again"])
    faults = ["candidate_missing: no reference for sample 3", "command_stale: sample 9: waits"]
    summary = summary_of(record(faults=faults), timing=timing)
    assert summary.faults == ["candidate_missing", "command_stale", "node_died"]
    assert summary.fault_details == [*faults, *timing.faults]
    assert summary.outcome == RunOutcome.STOPPED


def test_the_old_word_is_deprecated_and_keeps_its_meaning(record: Record) -> None:
    """A motion that was made, but not within the tolerance."""
    summary = summary_of(record(offset=(0.0, 1e-3)), DOWN.model_copy(update={"error_tolerance": 5e-4}))
    assert summary.outcome == RunOutcome.OFF_REFERENCE
    with pytest.warns(DeprecationWarning, match=r"use Summary\.outcome"):
        assert summary.completed
    content = strict_json(summary)
    assert (content["outcome"], content["completed"]) == ("off_reference", True)


def test_times_between_samples(record: Record) -> None:
    """Recorded 2 ms apart, but 7 ms between samples 6 and 7: of ten times the median is 2 ms."""
    began = 1_700_000_000_000_000_000
    log_times = {sample: began + sample * 2_000_000 + (5_000_000 if sample > 6 else 0) for sample in range(LAST + 1)}
    summary = summary_of(record(log_times=log_times))
    # the 99th percentile is 0.91 of the way between the two largest, 2 and 7 ms
    assert summary.cycle_time_ms == CycleTime(2.0, pytest.approx(6.55), 7.0)


def test_the_wait_for_the_first_answer_is_no_cycle_time(record: Record) -> None:
    """Sample 0 is repeated until it is answered; the clock starts at its last repetition."""
    log_times = {sample: 9_000_000_000 + sample * PERIOD_NS for sample in range(LAST + 1)}
    position, velocity = joints_at(0.0, 0.15, 0.0, 0.0)
    repeated = serialize.joint_state(sample_stamp_ns(0, RATE_HZ), JOINTS, position, velocity, (0.0,) * 4)
    directory = record(log_times=log_times, extra=[(JOINT_STATES, 8_000_000_000, repeated)])
    cycle = summary_of(directory).cycle_time_ms
    assert cycle == CycleTime(20.0, 20.0, 20.0)


def test_an_offline_run_has_no_cycle_time(record: Record) -> None:
    """Its log times are its stamps."""
    assert summary_of(record(), timing=RunTiming(runner="offline")).cycle_time_ms is None


def test_timing_comes_from_the_launcher(record: Record) -> None:
    timing = RunTiming(runner="ros", mode="realtime", wall_s=1.5, overruns=3)
    summary = summary_of(record(custom={"dropped": "4"}), timing=timing)
    assert (summary.runner, summary.mode, summary.wall_s, summary.overruns) == ("ros", "realtime", 1.5, 3)
    assert summary.dropped_messages == 4


@pytest.mark.parametrize(
    ("mode", "missing", "outcome"),
    [("realtime", (3, 4), "succeeded"), ("lockstep", (3, 4), "stopped"), ("realtime", (LAST,), "stopped")],
)
def test_real_time_bridges_samples(
    record: Record, mode: Literal["realtime", "lockstep"], missing: tuple[int, ...], outcome: str
) -> None:
    """Missing ones are counted; only the last one has to be there."""
    directory = record(samples=[one for one in range(LAST + 1) if one not in missing])
    summary = summary_of(directory, timing=RunTiming(runner="ros", mode=mode, overruns=2))
    assert (summary.outcome, summary.overruns) == (outcome, 2)
    assert summary.missing_samples == len(set(missing) - {LAST})


@pytest.mark.parametrize(("lost", "outcome"), [(4, "succeeded"), (LAST, "off_reference")])
def test_real_time_counts_a_lost_reference_as_a_missing_sample(record: Record, lost: int, outcome: str) -> None:
    summary = summary_of(record(without=[(REFERENCE, lost)]), timing=RunTiming(runner="ros", mode="realtime"))
    assert (summary.outcome, summary.missing_samples, summary.within_tolerance) == (outcome, 1, True)


@pytest.mark.parametrize("mode", ["realtime", "lockstep"])
def test_a_run_has_to_stay_within_the_tolerance(record: Record, mode: Literal["realtime", "lockstep"]) -> None:
    directory, tight = record(offset=(0.0, 1.0004e-3)), DOWN.model_copy(update={"error_tolerance": 5e-4})
    summary = summary_of(directory, tight, RunTiming(runner="ros", mode=mode))
    assert summary.outcome == RunOutcome.OFF_REFERENCE
    reason = "the platform was up to 1.01 mm from its reference, tolerated are 0.5 mm"
    # in lockstep it is no reason, so that the deprecated word keeps its meaning
    assert summary.not_completed_because == ([reason] if mode == "realtime" else [])
    assert "at most 1.01 mm from the reference, tolerance 0.5 mm" in html_page(tight, summary, ())


@pytest.mark.parametrize(("beside", "outcome"), [(0.0, RunOutcome.SUCCEEDED), (1e-3, RunOutcome.OFF_REFERENCE)])
def test_a_run_that_is_late_on_its_path_succeeds_where_the_path_counts(
    record: Record, beside: float, outcome: RunOutcome
) -> None:
    """The robot is a sample behind, and beside the path by 1 mm or not."""
    by_path = DOWN.model_copy(update={"error_tolerance": 5e-4, "judge": PATH})
    recording = read_bag(record())
    series = read_series(recording, by_path)
    there = np.vstack([series.reference[:1], series.reference[:-2], series.reference[-1:]])[:, :4] + (beside, 0, 0, 0)
    late = replace(series, platform=there, tracking_error=there[:, :2] - series.reference[:, :2])
    summary = summarize(recording, late, by_path, RunTiming())
    assert (summary.outcome, summary.judge) == (outcome, "path")
    assert summary.tracking_error_peak_m is not None and summary.tracking_error_peak_m > 5e-3
    assert summary.path_error_peak_m == pytest.approx(beside, abs=1e-9)
    assert f"at most {1e3 * beside:.2f} mm from the path, tolerance 0.5 mm" in html_page(by_path, summary, ())


def test_undefined_and_infinite_figures_do_not_reach_the_json(record: Record) -> None:
    directory = record(
        efforts={2: (math.nan, math.inf), 3: (0.5, 0.5)},
        commands={2: (math.nan, -math.inf), 3: (0.25, 0.25)},
        sigmas={2: math.nan, 5: 0.75},
    )
    content = strict_json(summary_of(directory))
    assert content["torque_peak_nm"] == [0.5, None]
    assert content["torque_requested_peak_nm"] == [0.25, None]
    assert content["sigma_max"] == 0.75


def test_the_fields_of_the_summary(record: Record) -> None:
    """The figures that the design asks for, then what explains them."""
    assert list(strict_json(summary_of(record()))) == [
        "outcome",
        "completed",
        "faults",
        "samples",
        "assembly_mode_changes",
        "torque_peak_nm",
        "torque_requested_peak_nm",
        "tracking_error_max_m",
        "tracking_error_rms_m",
        "vhc_error_max_m",
        "vhc_error_joint_max_rad",
        "sigma_max",
        "torque_saturated_samples",
        "estimate_error_max_m",
        "imu_acceleration_error_rms",
        "vision_error_rms_m",
        "vision_error_max_m",
        "vision_true_error_max_m",
        "cycle_time_ms",
        "latency_ms",
        "overruns",
        "missing_samples",
        "simulated_s",
        "wall_s",
        "name",
        "controller",
        "mode",
        "runner",
        "not_completed_because",
        "fault_details",
        "tracking_error_peak_m",
        "planned_samples",
        "planned_mode_changes",
        "working_mode_changes",
        "planned_working_mode_changes",
        "dropped_messages",
        "error_tolerance_m",
        "within_tolerance",
        "stray_messages",
        "not_judged",
        "planned_crossings",
        "odds",
        "path_error_peak_m",
        "judge",
        "requested_odds",
    ]


@pytest.mark.parametrize(
    ("values", "changes"),
    [
        ([], 0),
        ([1.0], 0),
        ([1.0, 2.0, 3.0], 0),
        ([1.0, -1.0, 1.0], 2),
        ([1.0, 0.0, 1.0], 0),
        ([1.0, 0.0, -1.0], 1),
        ([0.0, 0.0], 0),
        ([1.0, math.nan, -1.0, math.nan, -2.0], 1),
        ([1e-300, -1e-300], 1),
    ],
)
def test_sign_changes(values: list[float], changes: int) -> None:
    assert sign_changes(np.array(values)) == changes


def test_peak_and_rms() -> None:
    values = np.array([3.0, -4.0, math.nan])
    assert peak(values) == 4.0
    assert rms(values) == pytest.approx(math.sqrt(12.5))
    assert rms(np.zeros(3)) == 0.0
    assert rms(np.array([1e200, 1e200])) == pytest.approx(1e200)
    for figure in (peak, rms):
        assert figure(np.array([])) is None
        assert figure(np.array([math.nan])) is None
        assert figure(np.array([math.inf])) is None


def test_a_bag_of_another_rate_is_refused(record: Record) -> None:
    stamp = sample_stamp_ns(0, RATE_HZ) + 1
    off_grid = serialize.joint_state(stamp, JOINTS, (0.0,) * 4, (0.0,) * 4, (0.0,) * 4)
    directory = record(samples=(), extra=[(JOINT_STATES, stamp, off_grid)])
    with pytest.raises(BagError, match="no stamp is on the grid of 50 Hz") as error:
        series_of(directory)
    assert "\n" not in str(error.value)


def test_a_bag_of_another_robot_is_refused(record: Record) -> None:
    stamp = sample_stamp_ns(0, RATE_HZ)
    other = serialize.joint_state(stamp, ("shoulder", "elbow"), (0.0, 0.0), (0.0, 0.0), (0.0, 0.0))
    directory = record(samples=(), extra=[(JOINT_STATES, stamp, other)])
    with pytest.raises(BagError, match="has no q11, q12, q21, q22, only shoulder, elbow"):
        series_of(directory)


def test_joints_are_found_by_their_names(record: Record) -> None:
    stamp = sample_stamp_ns(0, RATE_HZ)
    mixed = serialize.joint_state(
        stamp, ("q22", "q11", "q12", "q21"), (4.0, 1.0, 2.0, 3.0), (0.0,) * 4, (8.0, 5.0, 6.0, 7.0)
    )
    series = series_of(record(samples=(), extra=[(JOINT_STATES, stamp, mixed)]))
    assert series.joint_position.tolist() == [[1.0, 2.0, 3.0, 4.0]]
    assert series.torque_applied.tolist() == [[5.0, 7.0]]


def test_a_bag_without_joint_states_is_refused(record: Record) -> None:
    with pytest.raises(BagError, match="/joint_states: not in the bag"):
        series_of(record(only=[FAULTS]))


def test_a_missing_timing_file_knows_nothing(tmp_path: Path) -> None:
    assert read_timing(tmp_path / "timing.json") == RunTiming(
        runner=None, mode=None, wall_s=None, overruns=None, faults=[]
    )


@pytest.mark.parametrize("content", ["{", "[]", '{"runner": "guess"}', '{"wall_s": NaN}', '{"faults": "one"}', "\xff"])
def test_a_broken_timing_file_is_refused_in_one_line(tmp_path: Path, content: str) -> None:
    path = tmp_path / "timing.json"
    path.write_bytes(content.encode("latin-1"))
    with pytest.raises(InputError, match=r"timing\.json: ") as error:
        read_timing(path)
    assert "\n" not in str(error.value)


@pytest.mark.extra
def test_the_middle_crossing_offline(tmp_path: Path) -> None:
    """The motion of figure 4.5: two crossings, completed, with torques that the drives can give."""
    scenario = load_scenario("middle")
    write_bag(simulate(scenario), scenario, tmp_path / "bag")
    summary = summary_of(tmp_path / "bag", scenario, RunTiming(runner="offline", wall_s=1.0))
    assert summary.outcome == RunOutcome.SUCCEEDED
    assert summary.assembly_mode_changes == 2
    assert summary.sigma_max == 1.0
    assert summary.samples == 1001
    assert summary.torque_saturated_samples == 0
    # the thesis reports 1e-4
    assert summary.vhc_error_max_m is not None and summary.vhc_error_max_m < 1e-4
    assert summary.cycle_time_ms is None

    recording = read_bag(tmp_path / "bag")
    recorded = recording.field(IMU_ERROR, "data")
    assert recording.count(IMU_DATA) == 1001
    # worked out anew by stamp, and the same to the last bit
    assert read_series(recording, scenario).acceleration_error.tolist() == recorded.tolist()


FAULT, SIGNAL = "drive_fault: q21 (node 2)", "interrupted: stopped by a signal to the launcher"


@pytest.mark.parametrize(
    ("recorded", "launcher", "outcome"),
    [
        ([], [SIGNAL], RunOutcome.INTERRUPTED),
        ([FAULT], [FAULT, SIGNAL], RunOutcome.STOPPED),
        # the bag has the fault, of which the launcher has heard after the signal, or never
        ([FAULT], [SIGNAL, FAULT], RunOutcome.STOPPED),
        ([FAULT], [SIGNAL], RunOutcome.STOPPED),
        # the launcher alone has heard of it, since the bag could not be written
        ([], [FAULT, SIGNAL], RunOutcome.STOPPED),
    ],
)
def test_a_signal_after_the_first_fault_does_not_make_an_interrupted_run(
    recorded: list[str], launcher: list[str], outcome: RunOutcome
) -> None:
    assert outcome_of(300, False, False, recorded, launcher) is outcome
