"""The study of sensors' faults: what is injected, what counts as silent and as a wrong name, and its table."""

from __future__ import annotations

import numpy as np
import pytest

from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_bringup.simulation.case import case_of
from fivebar_bringup.studies.sensor_faults.faults import FAULTS, Injected, Moment, drawn_faults, is_wrong_name
from fivebar_bringup.studies.sensor_faults.running import (
    SURVIVED,
    SensorFaultRow,
    SensorFaultSettings,
    run_numbered,
)
from fivebar_bringup.studies.sensor_faults.sensor_faults import confusion_table, sensor_faults_report, totals


def row(fault: str, verdict: str, named: str = "") -> SensorFaultRow:
    return SensorFaultRow(0, "unified", fault, 0, 1.0, 0.1, verdict, named, None, None, 1e-3, 1.0, 0.1, 1.0, 0.5, 0.3)


ROWS = [
    row("", "refused"),
    row("", "survived"),
    row("", "noticed", "estimate_inconsistent"),
    row("slip", "noticed", "encoder_frozen"),
    row("slip", "noticed", "estimate_inconsistent"),
    row("slip", "silent"),
    row("encoder_frozen", "noticed", "encoder_frozen"),
]


@pytest.mark.parametrize("fault", FAULTS)
def test_every_size_of_a_fault_is_a_robot_of_its_own(fault: str) -> None:
    scenario = load_scenario("middle_encoders")
    for size in FAULTS[fault].sizes:
        changed = Injected(fault, size, Moment(0.2, 2, -1)).on(scenario)
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
    report = sensor_faults_report(SensorFaultSettings(), ROWS)
    assert "silent 1 of 4" in report.page
    assert report.content["confusion"][1]["silent"] == 1


@pytest.mark.extra
def test_a_crossing_is_made_soundly_and_with_each_fault_once() -> None:
    sound, *faulty = run_numbered(SensorFaultSettings(seed=3, rig="good", robots=1, faulty=1), 0)
    assert (sound.fault, sound.verdict, sound.named) == ("", SURVIVED, "")
    # in units of limits that a sound robot does not come to
    assert 0.01 < sound.use < 1.0
    assert sound.use >= max(sound.misfit / 600.0, sound.offset / 1.3, sound.jump / 7.0)
    assert [row.fault for row in faulty] == list(FAULTS)
    (silent,) = (row for row in faulty if row.fault == "silent")
    assert silent.named == "gyroscope_missing"
    assert not [row for row in faulty if is_wrong_name(row.fault, row.named)]
