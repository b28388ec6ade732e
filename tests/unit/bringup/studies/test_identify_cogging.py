# SPDX-License-Identifier: Apache-2.0
"""The bag of the bench's exciting motion: `fivebar identify --cogging` finds the motors that its scenario simulates."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from fivebar_bringup.cli.main import app
from fivebar_bringup.recorded.run_directory import new_run_directory
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_bringup.simulation.offline import simulate, write_bag


@pytest.mark.extra
def test_the_benchs_exciting_motion_tells_scale_friction_and_cogging(tmp_path: Path) -> None:
    scenario = load_scenario("motkin_excitation")
    finished = simulate(scenario)
    assert not finished.faults
    run = new_run_directory(tmp_path / "moved", scenario)
    write_bag(finished, scenario, run.bag)
    result = CliRunner().invoke(app, ["identify", str(run.path), "--cogging", "12,24", "--json"])
    assert result.exit_code == 0, result.output
    motors, plant, robot = json.loads(result.stdout)["motors"], scenario.plant.motors, scenario.five_bar()
    for found, error, leg in zip(motors, (plant.constant_1, plant.constant_2), robot[:2], strict=True):
        gain = 1.0 + error
        assert abs(found["gain"]["value"] - gain) < 2.0 * found["gain"]["half_width"] < 5e-3
        # as commanded, which the torque constant scales
        assert found["coulomb"]["value"] == pytest.approx(leg.coulomb / gain, rel=2e-3)
        there, none = found["cogging"]
        assert there["amplitude"]["value"] == pytest.approx(plant.cogging / gain, rel=2e-3)
        assert none["amplitude"]["value"] < 1e-6
