# SPDX-License-Identifier: Apache-2.0
"""The law without switching over whole runs: through Type 2, to and through Type 1, and on a robot not as believed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from engine_agreement import columns, expect_completed, outcome_of, prepared
from estimate_replay import summary_of

from fivebar_bringup.report.thesis import MIDDLE, MULTIPLE
from fivebar_bringup.runs.offline import run_offline
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_bringup.simulation.engine import traced_crossing
from fivebar_control.loop.sampled_plan import X, Y
from fivebar_description.strict_yaml import InputError
from fivebar_studies.rigs.named import find_rig

pytestmark = pytest.mark.extra

MOTIONS = {"middle": MIDDLE, "multiple": MULTIPLE}
CROSSINGS = {"middle": 2, "multiple": 8}
DURATIONS = (0.5, 1.0, 2.0, 3.0)

RIG: dict[str, Any] = {"estimator": "ekf", "plant": find_rig("realistic").plant}
LIGHT_AND_STIFF = {"mass_scale": 0.8, "friction_scale": 1.3}
HEAVY_AND_EASY = {"mass_scale": 1.2, "friction_scale": 0.7}


def scenario(motion: str, duration: float, **other: Any) -> Scenario:
    return Scenario(name="unified", controller="unified", waypoints=MOTIONS[motion], segment_duration=duration, **other)


def expect_within(run: Scenario, mode_changes: int, error: float, torque: float) -> None:
    """Run a scenario compiled; fail where it does not complete, or needs more error (m) or torque (Nm) than that."""
    outcome = outcome_of(run)
    expect_completed(outcome, run, mode_changes)
    assert 0.0 < outcome.error_peak <= error
    assert 0.0 < max(outcome.requested1, outcome.requested2) <= torque


@pytest.mark.parametrize("duration", DURATIONS)
@pytest.mark.parametrize("motion", MOTIONS)
def test_a_robot_as_believed(motion: str, duration: float) -> None:
    expect_within(scenario(motion, duration), CROSSINGS[motion], 0.2e-3, 1.0)


@pytest.mark.parametrize(
    ("motion", "duration"), [*(("middle", duration) for duration in DURATIONS), ("multiple", 0.5), ("multiple", 2.0)]
)
def test_the_rig_from_its_motor_encoders(motion: str, duration: float) -> None:
    expect_within(scenario(motion, duration, **RIG), CROSSINGS[motion], 0.4e-3, 1.5)


@pytest.mark.parametrize("plant", [LIGHT_AND_STIFF, HEAVY_AND_EASY], ids=["light and stiff", "heavy and easy"])
def test_the_observer_takes_the_error_of_a_wrong_model(plant: dict[str, float]) -> None:
    """With gains at which a robot not as believed is about 1 mm off, and with the default ones."""
    for gains, without, reached in (
        ({"kp": 900.0, "kd": 60.0}, 0.7e-3, 0.25e-3),
        ({}, 0.12e-3, 0.04e-3),
    ):
        errors = []
        for rate in (0.0, 40.0):
            run = scenario("middle", 1.0, plant=plant, unified={**gains, "observer_rate": rate})
            case, plan = prepared(run)
            outcome, trace = traced_crossing(case, plan)
            expect_completed(outcome, run, 2)
            away = columns(trace, "estimated_x", "estimated_y") - plan.rows[: len(trace), [X, Y]]
            errors.append(float(np.sqrt(np.mean(np.sum(away**2, axis=1)))))
        assert errors[0] > without
        assert errors[1] < reached


@pytest.mark.parametrize(
    ("name", "mode_changes", "error", "torque"),
    [
        ("type1_boundary", (0, 0), 5e-6, 0.6),
        ("type1_working_mode", (0, 2), 5e-6, 0.6),
        ("type2_and_type1", (3, 1), 0.1e-3, 0.7),
    ],
)
def test_shipped_motions_that_meet_type_1(
    name: str, mode_changes: tuple[int, int], error: float, torque: float
) -> None:
    run = load_scenario(name)
    summary, series = summary_of(run)
    assert summary.outcome == "succeeded", summary.not_completed_because
    assert (summary.assembly_mode_changes, summary.working_mode_changes) == mode_changes
    assert summary.planned_working_mode_changes == mode_changes[1]
    assert summary.tracking_error_peak_m is not None
    assert summary.tracking_error_peak_m <= error
    assert max(peak for peak in summary.torque_peak_nm if peak is not None) <= torque
    # leg 1 is stretched at the planned moments
    plan = run.plan()
    sine = np.sin(series.joint_position[:, 1])
    for meeting in plan.meetings:
        assert abs(np.interp(meeting.time, series.time, sine)) < 1e-3


@pytest.mark.parametrize("plant", [LIGHT_AND_STIFF, HEAVY_AND_EASY], ids=["light and stiff", "heavy and easy"])
@pytest.mark.parametrize("duration", [0.5, 3.0])
def test_a_robot_that_is_not_as_believed_still_changes_its_working_mode(
    duration: float, plant: dict[str, float]
) -> None:
    """Slowly too, where a leg that is not held on its way would fall back to the side from which it came."""
    content = load_scenario("type1_working_mode").model_dump(mode="json")
    content["segment_duration"] = duration
    content["plant"] |= plant
    run = Scenario.model_validate(content)
    expect_within(run, 0, 0.2e-3, 1.5)


def test_at_rest_on_the_boundary_the_stretched_leg_stays() -> None:
    """From 0.98 s to 1.02 s the reference rests there; the leg keeps to it although the platform does not feel it."""
    _, series = summary_of(load_scenario("type1_boundary"))
    resting = (series.time > 0.98) & (series.time < 1.02)
    assert np.max(np.abs(np.sin(series.joint_position[resting, 1]))) < 5e-3


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (
            {"controller": "multi_cartesian"},
            "controller multi_cartesian cannot meet Type 1",
        ),
        ({"estimator": "ekf"}, "estimator ekf follows the platform in one working mode: expected estimator none"),
        ({"working_modes": [[1, -1]]}, "1 given for 3 waypoints"),
        ({"working_mode": [-1, -1]}, "begins with"),
        ({"working_modes": [[1, -1], [1, 1], [1, -1]], "waypoints": [[0.0, 0.15], [-0.03, 0.13], [0.0, 0.15]]}, "IMU"),
    ],
)
def test_what_cannot_meet_type_1_is_refused(change: dict[str, Any], reason: str, tmp_path: Path) -> None:
    content = load_scenario("type1_working_mode").model_dump(mode="json") | change
    path = tmp_path / "changed.yaml"
    path.write_text(repr(content).replace("None", "null").replace("True", "true").replace("False", "false"))
    with pytest.raises(InputError, match=reason) as refusal:
        load_scenario(str(path))
    assert "\n" not in str(refusal.value)


@pytest.mark.extra
def test_the_page_of_a_motion_that_is_nowhere_straight(tmp_path: Path) -> None:
    """It keeps to no line, so there is no picture of the distance from one; the changes of working mode are stated."""
    directory, summary = run_offline(load_scenario("type1_working_mode"), tmp_path / "run", lambda sample, last: None)
    assert summary.outcome == "succeeded"
    assert (summary.vhc_error_max_m, summary.vhc_error_joint_max_rad) == (None, None)
    pictures = {path.stem for path in directory.path.rglob("*.png")}
    assert {"path", "hero", "torques", "tracking"} <= pictures
    assert "vhc_error" not in pictures
    page = (directory.path / "report.html").read_text(encoding="utf-8")
    assert "0 changes of assembly mode, 2 of working mode, no fault" in page
    assert "this controller does not" in page
