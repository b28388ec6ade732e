# SPDX-License-Identifier: Apache-2.0
"""The study of sensors' faults: what is injected, what counts as silent and as a wrong name, and its table."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_bringup.simulation.case import case_of
from fivebar_studies.robustness.effects import Condition, condition_of, with_keys
from fivebar_studies.robustness.robustness import robustness_report
from fivebar_studies.robustness.running import (
    FAR,
    NOTICED,
    REFUSED,
    SILENT,
    SURVIVED,
    WRONG_MODE,
    RobustnessRow,
    RobustnessSettings,
    judged,
    run_numbered,
)
from fivebar_studies.robustness.sensor_effects import FAULTS, drawn_faults, is_wrong_name
from fivebar_studies.robustness.tables import confusion_table, totals
from fivebar_studies.sweep.drawing import draw
from fivebar_studies.sweep.planning import planned, sampled_case
from fivebar_studies.sweep.rows import FAULT_DELAY


def row(fault: str, cause: str = "", left_time: float | None = None, fault_time: float | None = None) -> RobustnessRow:
    return RobustnessRow(0, fault, 1.0, "unified", 1.0, 0, cause, 0.1, left_time, fault_time, 1e-3, use=0.3)


ROWS = [
    row("", REFUSED),
    row(""),
    row("", "estimate_inconsistent", fault_time=0.5),
    row("slip", "encoder_frozen", fault_time=0.5),
    row("slip", "estimate_inconsistent", 0.46, 0.5),
    row("slip", WRONG_MODE),
    row("encoder_frozen", "encoder_frozen", fault_time=0.5),
]


def test_a_run_that_leaves_its_reference_without_a_fault_in_time_is_silent() -> None:
    noticed = [NOTICED, NOTICED, NOTICED]
    assert [row.verdict for row in ROWS] == [REFUSED, SURVIVED, *noticed, SILENT, NOTICED]
    late = row("slip", "tracking_lost", 0.4, 0.4 + FAULT_DELAY + 0.002)
    assert [late.verdict, row("slip", FAR, 0.4).verdict] == [SILENT, SILENT]
    assert [late.named, row("slip", FAR, 0.4).named] == ["tracking_lost", ""]


@pytest.mark.parametrize("fault", FAULTS)
def test_every_size_of_a_fault_is_a_robot_of_its_own(fault: str) -> None:
    scenario = load_scenario("middle_encoders")
    for size in FAULTS[fault].sizes:
        changed = with_keys(scenario, FAULTS[fault].change(size, condition_of(3, 0.2)))
        assert (changed.plant, changed.imu) != (scenario.plant, scenario.imu)
        # refuses none of them
        case_of(changed)


def test_equal_numbers_draw_equal_faults_one_of_each() -> None:
    one, other = (drawn_faults(np.random.default_rng(3), 0.4, 1.0) for _ in range(2))
    assert one == other
    assert [drawn.fault for drawn in one] == list(FAULTS)
    assert all(0.0 <= drawn.at.time < 1.0 for drawn in one)


@pytest.mark.parametrize(
    ("fault", "named", "wrong"),
    [
        ("slip", "estimate_inconsistent", False),
        ("slip", "encoder_frozen", True),
        ("encoder_frozen", "encoder_frozen", False),
        ("clip", "gyroscope_frozen", False),
        ("bias", "gyroscope_missing", True),
        ("", "tracking_lost", False),
        ("", "gyroscope_late", True),
    ],
)
def test_only_a_name_that_says_another_cause_is_wrong(fault: str, named: str, wrong: bool) -> None:
    assert is_wrong_name(fault, named) is wrong


def test_the_totals_have_intervals_and_leave_out_what_was_refused() -> None:
    found = totals(ROWS)
    assert [(one["count"], one["runs"]) for one in found.values()] == [(1, 4), (1, 4), (1, 2)]
    low, high = found["silent"]["interval_95"]
    assert 0.0 < low < 0.25 < found["silent"]["upper_bound_95"] < high < 0.9
    assert found["false_alarms"]["by_fitted_tail"] is None


def test_the_table_has_every_fault_and_marks_what_is_wrong() -> None:
    table = confusion_table(ROWS)
    assert [line[1].value for line in table.rows] == ["", *FAULTS]
    slip = dict(zip(table.columns, table.rows[1], strict=True))
    assert (slip["runs"].value, slip["silent"].value, slip["encoder_frozen"].good) == (3, 1, False)
    assert slip["estimate_inconsistent"].good is None
    report = robustness_report(RobustnessSettings(rig="good"), ROWS)
    assert "silent 1 of 4" in report.page
    assert report.content["confusion"][1]["silent"] == 1


@pytest.mark.extra
def test_a_crossing_is_made_soundly_and_with_each_fault_once() -> None:
    sound, *faulty = run_numbered(RobustnessSettings(seed=3, rig="good", robots=1, faulty=1), 0)
    assert (sound.effect, sound.verdict, sound.named) == ("", SURVIVED, "")
    # in units of limits that a sound robot does not come to
    assert 0.01 < sound.use < 1.0
    assert sound.use >= max(sound.misfit / 600.0, sound.offset / 1.3, sound.jump / 7.0)
    assert [row.effect for row in faulty] == list(FAULTS)
    (silent,) = (row for row in faulty if row.effect == "silent")
    assert silent.named == "gyroscope_missing"
    assert not [row for row in faulty if is_wrong_name(row.effect, row.named)]


@pytest.mark.parametrize(
    ("number", "duration", "fault", "size", "time", "verdict", "named"),
    [
        (20, 0.768, "bias", 0.5, 0.28, NOTICED, "estimate_inconsistent"),
        (18, 0.678, "clock", -0.005, 0.0, SURVIVED, ""),
        (0, 1.036, "drift", -0.007, 0.0, SURVIVED, ""),
    ],
    ids=["bias", "clock", "drift"],
)
def test_a_fault_of_the_gyroscope_is_silent_only_where_bias_and_clock_are_not_watched(
    number: int, duration: float, fault: str, size: float, time: float, verdict: str, named: str
) -> None:
    """Crossings of the rig middling, with a jump of 0.5 rad/s, an offset of 5 ms and a drift of 7 ms/s."""
    case = draw(101, number, "middling")._replace(duration=duration)
    crossings, samples, scenario = len(planned(case).crossings), sampled_case(case), case.scenario("unified")
    at = Condition(0, time, 1, 1 if size > 0.0 else -1)
    run = RobustnessRow(number, fault, size, "unified", duration, 0, time=time)

    def crossed(scenario: Scenario, limit: float | None) -> RobustnessRow:
        faulty = case_of(with_keys(scenario, FAULTS[fault].change(abs(size), at)), stop_at_fault=True)
        estimation = faulty.numbers.estimation
        assert estimation is not None
        if limit is not None:
            model = estimation.model._replace(bias_limit=limit)
            faulty = faulty._replace(numbers=faulty.numbers._replace(estimation=estimation._replace(model=model)))
        return judged(run, faulty, samples, crossings)

    ekf = scenario.ekf._replace(gyro_clock=0.0, gyro_bias_rate=1e-4)
    assert crossed(scenario.model_copy(update={"ekf": ekf}), math.inf).verdict == SILENT
    watched = crossed(scenario, None)
    assert (watched.verdict, watched.named) == (verdict, named)
    # before it is lost, or without
    assert watched.left_time is None
    assert watched.error < 5e-3
