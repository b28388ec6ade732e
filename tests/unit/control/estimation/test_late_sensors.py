# SPDX-License-Identifier: Apache-2.0
"""Crossings with an encoder on a passive joint, and with a gyroscope whose clock is not the robot's."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from estimate_replay import encoder_scenario

from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_bringup.simulation.offline import OfflineRun, simulate
from fivebar_control.model.kinematics import state_from_joints
from fivebar_description.strict_yaml import InputError, yaml_text

LENGTHS = {"links": {"l_11": 3e-4, "l_12": -3e-4, "l_21": 3e-4, "l_22": -3e-4}}
KNOWN = {"length": 3e-4, "zero": 3e-3}
GYRO = {"gyro_noise": 0.01, "gyro_bias": 0.01, "rate_hz": 250, "latency": 0.004}


def crossed(plant: dict[str, Any], **fields: Any) -> tuple[OfflineRun, float]:
    """Return a run through the locus, and the actual platform's largest distance from its reference (m)."""
    scenario = encoder_scenario("unified_middle", 0.5, plant=plant, **fields)
    scenario = scenario.model_copy(update={"waypoints": scenario.waypoints[:2], "segment_duration": 0.5})
    run, robot = simulate(scenario), scenario.actual_robot()
    off = []
    for sample in run.samples:
        state = state_from_joints(robot, *sample.exact.position, *sample.exact.velocity)
        # the reference was published a sample before its time
        wanted = scenario.plan().path.at(sample.number / scenario.rate_hz)
        off.append(math.hypot(state.x - wanted.x, state.y - wanted.y))
    return run, float(np.max(off))


@pytest.mark.parametrize("leg", [1, 2])
def test_an_encoder_on_a_passive_joint_makes_the_locus_ordinary(leg: int) -> None:
    """Without it such a robot is lost there."""
    encoder = {"leg": leg, "zero": 0.002, "eccentricity": 2e-4, "latency": 0.004, "lost": 0.05}
    run, error = crossed(LENGTHS, tolerances=KNOWN, sensors={"passive_encoder": encoder})
    assert run.faults == []
    assert error < 2e-3


@pytest.mark.parametrize("offset", [-0.005, 0.005])
def test_a_clock_of_its_own_does_no_harm_where_its_offset_is_estimated(offset: float) -> None:
    imu = {**GYRO, "clock_offset": offset}
    run, error = crossed({}, imu=imu, ekf={"gyro": True, "gyro_clock": 0.005}, tolerances={"length": 5e-5})
    assert run.faults == []
    assert error < 1e-3


@pytest.mark.parametrize("offset", [-0.015, 0.015])
def test_a_wrong_clock_is_a_fault_and_not_a_silent_pull(offset: float) -> None:
    imu = {**GYRO, "clock_offset": offset}
    run, _ = crossed({}, imu=imu, ekf={"gyro": True}, tolerances={"length": 5e-5})
    assert run.faults[0].startswith("estimate_inconsistent")
    assert "most likely first: the gyroscope's bias, sensitivity or mounting, or its clock" in run.faults[0]


@pytest.mark.parametrize("offset", [-0.007, 0.01])
def test_an_offset_of_the_clock_that_nobody_declared_is_estimated(offset: float) -> None:
    imu = {**GYRO, "clock_offset": offset}
    run, error = crossed({}, imu=imu, ekf={"gyro": True}, tolerances={"length": 5e-5})
    assert run.faults == []
    assert error < 5e-4


def test_the_lag_of_the_gyroscopes_low_pass_is_taken_off() -> None:
    """Of 10 ms here."""
    imu = {**GYRO, "gyro_bandwidth_hz": 16.0}
    run, error = crossed({}, imu=imu, ekf={"gyro": True}, tolerances={"length": 5e-5})
    assert run.faults == []
    assert error < 1e-3


def test_a_low_pass_whose_readings_are_too_old_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "any.yaml"
    slow = {**GYRO, "gyro_bandwidth_hz": 9.0}
    file.write_text(yaml_text({**load_scenario("gyro_middle").model_dump(mode="json"), "imu": slow}), encoding="utf-8")
    with pytest.raises(InputError, match=r"gyro_bandwidth_hz: 9: .* 17\.7 ms .* older than 20 ms"):
        load_scenario(str(file))


def test_a_wrong_reading_of_the_passive_joint_is_named() -> None:
    encoder = {"leg": 2, "zero": 0.2}
    run, _ = crossed({}, sensors={"passive_encoder": encoder}, tolerances={"length": 5e-5})
    assert "the passive joint's encoder differs from the predictions" in run.faults[0]


def test_only_an_estimator_can_read_it(tmp_path: Path) -> None:
    scenario = encoder_scenario("middle", 0.5, estimator="none", sensors={"passive_encoder": {"leg": 1}})
    file = tmp_path / "any.yaml"
    file.write_text(scenario.to_yaml(), encoding="utf-8")
    with pytest.raises(InputError, match=r"only the estimator reads it: expected estimator ekf"):
        load_scenario(str(file))
