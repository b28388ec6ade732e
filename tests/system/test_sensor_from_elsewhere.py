# SPDX-License-Identifier: Apache-2.0
"""A sensor that is not in the tree is used everywhere: by the nodes, without ROS, compiled, and in a sweep."""

from __future__ import annotations

import csv
import json
import os
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from bag_contents import contents
from fivebar_command import FivebarCommand

import fivebar_control
from fivebar_bringup.bag.reader import read_bag
from fivebar_bringup.bag.recording import Recording
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_bringup.simulation.case import case_of
from fivebar_bringup.simulation.engine import crossing, traced_crossing
from fivebar_bringup.simulation.engine_table import TraceRow
from fivebar_control.controller.estimator import estimator_of
from fivebar_control.estimation.compiled_estimator import CompiledEstimator
from fivebar_control.loop.sampled_plan import sampled
from fivebar_description.interface import EXTRA_READINGS, JOINT_STATES, TORQUE_COMMAND, Topic

ENCODERS = """
controller: unified
waypoints: [[0.0, 0.15], [0.0, 0.02]]
segment_duration: 1.0
plant: {torque_limit: 10.0, encoder_counts: 20000, delay_samples: 1, links: {l_11: 1.0e-4, l_22: -1.0e-4}}
estimator: ekf
tolerances: {length: 2.0e-4, zero: 1.0e-3}
"""
LINEAR = 'extra_sensor: {kind: "linear_encoder:SENSOR", x: 0.12, y: 0.28, latency: 0.004, rate_hz: 250, lost: 0.1}\n'
SAMPLES = 501


@pytest.fixture(scope="module")
def scenarios(folder: Path) -> Iterator[dict[str, Path]]:
    """Scenarios with the sensor, and from encoders alone, while every process finds the sensor's module."""
    files = {}
    for name, extra in (("with_linear_encoder", LINEAR), ("with_encoders_alone", "force: true\n")):
        files[name] = folder / f"{name}.yaml"
        files[name].write_text(f"name: {name}\n{ENCODERS}{extra}", encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", str(Path(__file__).parents[1] / "support"))
        yield files


@pytest.fixture(scope="module")
def bags(
    fivebar: Callable[..., FivebarCommand], folder: Path, scenarios: dict[str, Path]
) -> dict[tuple[str, str], Recording]:
    bags = {}
    for command, name in (
        ("run", "with_linear_encoder"),
        ("simulate", "with_linear_encoder"),
        ("simulate", "with_encoders_alone"),
    ):
        out = folder / f"{name}_{command}"
        call = fivebar(command, str(scenarios[name]), "--json", "--out", str(out))
        assert call.finish() == 0, call.stderr
        assert call.json()["outcome"] == "succeeded"
        bags[command, name] = read_bag(out / "bag")
    return bags


@pytest.mark.extra
@pytest.mark.parametrize("topic", [EXTRA_READINGS, TORQUE_COMMAND, JOINT_STATES], ids=lambda topic: topic.name)
def test_the_graph_and_the_offline_runner_agree_bit_for_bit(
    bags: dict[tuple[str, str], Recording], topic: Topic
) -> None:
    ros, offline = (contents(bags[command, "with_linear_encoder"], topic) for command in ("run", "simulate"))
    assert len(ros) >= (0.8 * SAMPLES / 2 if topic == EXTRA_READINGS else SAMPLES)
    assert ros == offline


@pytest.mark.extra
def test_the_compiled_engine_takes_the_same_readings(
    bags: dict[tuple[str, str], Recording], scenarios: dict[str, Path]
) -> None:
    loaded = load_scenario(str(scenarios["with_linear_encoder"]))
    plan = sampled(loaded.five_bar(), loaded.plan(), loaded.rate_hz, loaded.lead_samples)
    outcome, trace = traced_crossing(case_of(loaded), plan)
    assert (outcome.samples, outcome.fault) == (SAMPLES, 0)
    columns = [TraceRow._fields.index(name) for name in ("command1", "command2")]
    wanted = bags["simulate", "with_linear_encoder"].field(TORQUE_COMMAND, "effort")[:SAMPLES]
    np.testing.assert_allclose(trace[:, columns], wanted, rtol=0.0, atol=1e-9)


@pytest.mark.extra
def test_the_robot_is_known_several_times_better_with_it(folder: Path, bags: dict[tuple[str, str], Recording]) -> None:
    assert bags
    errors = {}
    for name in ("with_linear_encoder", "with_encoders_alone"):
        summary = json.loads((folder / f"{name}_simulate" / "summary.json").read_text(encoding="utf-8"))
        errors[name] = summary["estimate_error_max_m"]
    assert errors["with_linear_encoder"] < 0.3e-3 < 4.0 * errors["with_linear_encoder"] < errors["with_encoders_alone"]


@pytest.mark.extra
def test_a_sweep_draws_robots_that_have_it(
    fivebar: Callable[..., FivebarCommand], folder: Path, scenarios: dict[str, Path]
) -> None:
    rig = folder / "rig.yaml"
    rig.write_text(
        "words: calibrated encoders, with a linear encoder\n"
        "errors: {length: 2.0e-4, zero: 1.0e-3}\n"
        "scenario:\n"
        "  estimator: ekf\n"
        "  plant: {encoder_counts: 20000, delay_samples: 1}\n"
        f"  tolerances: {{length: 2.0e-4, zero: 1.0e-3}}\n  {LINEAR}",
        encoding="utf-8",
    )
    out = folder / "sweep"
    call = fivebar("sweep", "--rig", str(rig), "--controllers", "unified", "--cases", "8", "--json", "--out", str(out))
    assert call.finish() in (0, 1), call.stderr
    rows = list(csv.DictReader((out / "sweep.csv").open(encoding="utf-8")))
    feasible = [row for row in rows if row["status"] == "feasible"]
    assert len(feasible) >= 8
    assert sum(row["success"] == "1" for row in feasible) >= 6


@pytest.mark.extra
def test_machine_code_that_others_share_does_not_need_its_module(
    bags: dict[tuple[str, str], Recording], scenarios: dict[str, Path]
) -> None:
    """Else no run could load that code where the sensor's module is not to be found."""
    assert bags
    scenario = load_scenario(str(scenarios["with_linear_encoder"]))
    crossing(case_of(scenario), sampled(scenario.five_bar(), scenario.plan(), scenario.rate_hz, scenario.lead_samples))
    estimator_of(scenario, kind=CompiledEstimator).warm_up()
    folder = Path(os.environ.get("NUMBA_CACHE_DIR", Path(fivebar_control.__file__).parents[2]))
    naming = [path.name for path in folder.rglob("*.nbi") if b"linear_encoder" in path.read_bytes()]
    assert {"closed_loop", "compiled_estimator"} <= {name.partition(".")[0] for name in naming}
    assert not [name for name in naming if "expected_length" not in name]
