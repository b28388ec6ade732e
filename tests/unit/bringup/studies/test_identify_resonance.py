# SPDX-License-Identifier: Apache-2.0
"""The chirp of an elastic plant, its bag, the command, and a crossing with the robot file that the command leaves."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest
from typer.testing import CliRunner

from fivebar_bringup.cli.main import app
from fivebar_bringup.recorded.run_directory import RunDirectory, new_run_directory
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_bringup.simulation.case import case_of
from fivebar_bringup.simulation.engine import crossing
from fivebar_bringup.simulation.offline import simulate, write_bag
from fivebar_bringup.simulation.run_metrics import RunMetrics
from fivebar_control.loop.sampled_plan import sampled
from fivebar_control.model.kinematics import state_from_platform
from fivebar_control.model.singularity import inverse_condition
from fivebar_control.safety.stages import NO_FAULT
from fivebar_description.robot_file import read_robot
from fivebar_description.transmission import Transmission

SOFT = Transmission(frequency=60.0, damping=0.04, rotor_share=0.7)


@pytest.fixture(scope="module")
def chirped(tmp_path_factory: pytest.TempPathFactory) -> RunDirectory:
    scenario = load_scenario("excitation_resonance")
    scenario = scenario.model_copy(
        update={
            "segment_duration": 6.0,
            "law": {**scenario.law, "sweep": 3.0},
            "plant": scenario.plant._replace(transmission=SOFT),
        }
    )
    run = new_run_directory(tmp_path_factory.mktemp("chirp") / "run", scenario)
    finished = simulate(scenario)
    assert not finished.faults
    write_bag(finished, scenario, run.bag)
    return run


def identified(run: RunDirectory, out: Path, *more: str) -> tuple[int, str, str]:
    result = CliRunner().invoke(app, ["identify", str(run.path), "--resonance", "--out", str(out), *more])
    return result.exit_code, result.stdout, result.stderr


def across(robot: str) -> RunMetrics:
    """Return what the middle crossing of the elastic robot comes to, from encoders and gyroscope."""
    scenario = Scenario.model_validate(
        {
            "name": "across",
            "controller": "unified",
            "robot": robot,
            "waypoints": [[0.0, 0.15], [0.0, 0.02]],
            "plant": {
                "torque_limit": 2.0,
                "encoder_counts": 20000,
                "torque_quantum": 0.002,
                "delay_samples": 1,
                "transmission": SOFT._replace(rotor_share=0.85)._asdict(),
            },
            "imu": {"gyro_noise": 0.01, "rate_hz": 250, "latency": 0.004},
            "estimator": "ekf",
            "ekf": {"gyro": True},
        }
    )
    plan = sampled(scenario.five_bar(), scenario.plan(), scenario.rate_hz, scenario.lead_samples)
    return crossing(case_of(scenario, stop_at_fault=True), plan)


@pytest.mark.extra
def test_the_command_finds_the_transmissions_and_leaves_a_tuned_robot_file(
    chirped: RunDirectory, tmp_path: Path
) -> None:
    status, printed, _ = identified(chirped, tmp_path / "out", "--json")
    assert status == 0
    content = json.loads(printed)
    assert content == json.loads((tmp_path / "out" / "resonance.json").read_text(encoding="utf-8"))
    for leg in content["legs"]:
        assert leg["frequency"]["value"] == pytest.approx(SOFT.frequency, rel=0.04)
        assert leg["rotor_share"]["value"] == pytest.approx(SOFT.rotor_share, abs=0.06)
    tuned = tmp_path / "out" / "tuned.yaml"
    lowest = min(leg["frequency"]["value"] for leg in content["legs"])
    assert read_robot(str(tuned)).tuning.bandwidth == pytest.approx(0.1 * 2.0 * math.pi * lowest, abs=0.06)
    assert content["tuning"] == {"bandwidth": read_robot(str(tuned)).tuning.bandwidth, "disturbance_rate": 0.1}


@pytest.mark.extra
def test_with_the_tuned_file_the_transmissions_swing_less(chirped: RunDirectory, tmp_path: Path) -> None:
    status, _, _ = identified(chirped, tmp_path / "out")
    assert status == 0
    default, recommended = across("dextar"), across(str(tmp_path / "out" / "tuned.yaml"))
    # both cross, the defaults with readings that hardly fit and torques that shake the links
    assert default.misfit > 3.0 * recommended.misfit
    assert default.requested1 > 1.3 * recommended.requested1
    assert recommended.fault == NO_FAULT
    assert recommended.mode_changes == 1
    assert recommended.error_peak < 5e-4


@pytest.mark.extra
def test_the_command_prints_a_table_and_refuses_what_it_cannot_do(chirped: RunDirectory, tmp_path: Path) -> None:
    status, printed, _ = identified(chirped, tmp_path / "out")
    assert status == 0
    assert "on locked rotors the links swing at" in printed
    assert "unified: bandwidth at most" in printed
    status, _, complaint = identified(chirped, tmp_path / "other", "--cogging", "12")
    assert status == 2
    assert "--resonance: expected without --cogging" in complaint


def test_the_shipped_chirp_is_small_far_from_the_locus_and_within_the_drives_limit() -> None:
    scenario = load_scenario("excitation_resonance")
    plan, robot = scenario.plan(), scenario.five_bar()
    assert plan.crossings == ()
    for time in (0.0, 20.0):
        assert inverse_condition(state_from_platform(robot, (1, -1), *plan.path.at(time)[:4])) > 0.4
    assert scenario.plant.torque_limit is not None
    assert scenario.law["amplitude"] < scenario.plant.torque_limit
