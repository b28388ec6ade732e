# SPDX-License-Identifier: Apache-2.0
"""What runs a scenario screens it first: nothing that is admitted fails on a perfect robot, half of the rest does."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from engine_agreement import long_if_seldom_compiled
from random_scenarios import NAMES, anywhere, near_the_locus, run_of
from typer.testing import CliRunner

from fivebar_bringup.cli.main import app
from fivebar_bringup.runs.admission import load_admitted, refuse_unfit
from fivebar_bringup.runs.screening import screened
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_bringup.simulation.case import case_of
from fivebar_bringup.simulation.engine import crossing
from fivebar_control.laws.registry import CONTROLLERS
from fivebar_control.loop.sampled_plan import sampled
from fivebar_control.planning.figures import ERROR, MODE_CHANGES, NEAREST, REQUEST, TORQUE, UNCERTAINTY, WRONG_MODE
from fivebar_control.safety.stages import NO_FAULT
from fivebar_control.trajectory.planner import PlanRefused
from fivebar_description.scenario_file import shipped_scenarios
from fivebar_description.strict_yaml import InputError
from fivebar_sim.effects.links import LinkErrors

HOLE = """
name: hole
controller: {controller}
waypoints: [[0.0, 0.15], [0.0, 0.0845]]
"""
"""A rest 1 um before the locus: no change of assembly mode, so no crossing and no zone."""


ROBOTS = 16


def scenario_file(directory: Path, controller: str, more: str = "") -> str:
    path = directory / "hole.yaml"
    path.write_text(HOLE.format(controller=controller) + more, encoding="utf-8")
    return str(path)


@pytest.mark.parametrize(
    "controller", [pytest.param(name, marks=pytest.mark.extra if name == "mpc" else ()) for name in CONTROLLERS]
)
def test_a_rest_just_before_the_locus_is_refused(tmp_path: Path, controller: str) -> None:
    scenario = load_scenario(scenario_file(tmp_path, controller))
    assert scenario.plan().crossings == ()
    verdict = screened(scenario, scenario.plan())
    assert not verdict.feasible
    nearest = verdict.figure(NEAREST)
    if controller == "lqr":
        # what the motion asks for, which this law commands
        torque = verdict.figure(TORQUE)
        assert torque is not None
        assert not torque.kept
    elif CONTROLLERS[controller].needs_no_zones:
        # what counts is what becomes of the run: it comes to rest 1.6 mm beside the goal, in the other mode
        assert nearest is None
        error = verdict.figure(ERROR)
        assert error is not None
        assert not error.kept
    else:
        assert nearest is not None
        assert nearest.value == pytest.approx(8.2e-5, rel=0.01)
        assert nearest.time == pytest.approx(1.0, abs=1e-5)


@pytest.mark.parametrize("command", ["simulate", "run", "stand"])
def test_a_refusal_is_one_line_with_place_figure_and_limit(tmp_path: Path, command: str) -> None:
    controller = "unified" if command == "stand" else "multi_cartesian"
    done = CliRunner().invoke(app, [command, scenario_file(tmp_path, controller), "--out", str(tmp_path / "out")])
    assert done.exit_code == 2
    assert done.stdout == ""
    assert done.stderr.count("\n") == 1
    assert " is " in done.stderr
    assert "at (0.00" in done.stderr
    assert "m after" in done.stderr
    assert "expected at" in done.stderr
    assert "force: true" in done.stderr
    assert not (tmp_path / "out").exists()


def test_real_drives_are_not_started_for_it_either(tmp_path: Path) -> None:
    arguments = ["--hardware", "socketcan", "--activate", "--out", str(tmp_path / "out")]
    done = CliRunner().invoke(app, ["run", scenario_file(tmp_path, "multi_cartesian"), *arguments])
    assert done.exit_code == 2
    assert "1/cond(A)" in done.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.extra
def test_who_forces_it_sees_the_torque_request_stop_the_robot(tmp_path: Path) -> None:
    forced = scenario_file(tmp_path, "multi_cartesian", "force: true\n")
    done = CliRunner().invoke(app, ["simulate", forced, "--no-page", "--out", str(tmp_path / "out")])
    assert done.exit_code == 1
    assert "torque_excessive" in done.stdout
    # there is no page to look at
    assert "report.html" not in done.stdout


LONG_MOTIONS = (
    "calibration_below",
    "excitation_encoders",
    "excitation_resonance",
    "motkin_calibration",
    "motkin_calibration_below",
    "motkin_excitation",
    "multiple_encoders",
    "multiple_joint",
)
"""Scenarios whose motion takes a second or more to screen and is like that of another one."""


@pytest.mark.parametrize(
    "name",
    [pytest.param(one, marks=pytest.mark.extra if one in LONG_MOTIONS else ()) for one in shipped_scenarios()],
)
def test_shipped_scenarios_are_admitted(name: str) -> None:
    assert load_admitted(name).force == (name == "ctc_middle")


def test_the_one_that_is_forced_would_be_refused() -> None:
    scenario = load_scenario("ctc_middle").model_copy(update={"force": False})
    with pytest.raises(
        PlanRefused, match=r"undefined on the Type 2 locus is .* m after 0\.502 s, expected at least 0\.01"
    ):
        refuse_unfit(scenario)


def test_a_wider_tolerance_admits_a_larger_predicted_error() -> None:
    scenario = load_scenario("multi_model_criterion")
    refuse_unfit(scenario)
    strict = scenario.model_copy(update={"error_tolerance": 0.004})
    with pytest.raises(PlanRefused, match=rf"{ERROR} is 0\.00204 m .*expected at most 0\.002 m"):
        refuse_unfit(strict)


def test_there_must_be_such_a_scenario() -> None:
    with pytest.raises(InputError, match=r"expected one of .*, or a path to a \.yaml file"):
        load_admitted("no_such_scenario")


@pytest.mark.extra
@pytest.mark.parametrize("controller", long_if_seldom_compiled(CONTROLLERS))
def test_the_prediction_is_the_run_on_the_other_plant(controller: str) -> None:
    """The prediction integrates the controllers' equations in the plane, the engine's plant both chains of joints."""
    waypoints = ((0.0, 0.15), (0.03, 0.12)) if controller == "ctc" else ((0.0, 0.15), (0.01, 0.04))
    # a law that leaves the timing to the motion is later the quicker that is
    duration = 1.0 if controller == "path" else 0.6
    scenario = Scenario(name="one", controller=controller, waypoints=waypoints, segment_duration=duration)
    plan = scenario.plan()
    verdict = screened(scenario, plan)
    assert verdict.feasible
    outcome, failures = run_of(scenario, plan)
    assert not failures
    error, request, changes = (verdict.figure(name) for name in (ERROR, REQUEST, MODE_CHANGES))
    assert error is not None
    assert request is not None
    assert changes is not None
    assert error.value == pytest.approx(outcome.error_peak, abs=1e-6)
    assert request.value == pytest.approx(max(outcome.requested1, outcome.requested2), rel=1e-3)
    assert changes.value == 0.0


@pytest.mark.extra
@pytest.mark.parametrize(("draw", "seed", "count"), [(anywhere, 11, 50), (near_the_locus, 12, 50)])
def test_what_is_admitted_succeeds_and_half_of_what_is_refused_fails(
    draw: Callable[[int, int], Scenario], seed: int, count: int
) -> None:
    """On a robot as modelled: within 2 mm, in the planned mode, no fault, no saturation; the planner's part aside."""
    admitted, refused, failed = 0, 0, 0
    for number in range(count):
        scenario = draw(seed, number)
        try:
            plan = scenario.plan()
        except PlanRefused:
            continue
        verdict = screened(scenario, plan)
        outcome, failures = run_of(scenario, plan)
        if verdict.feasible:
            admitted += 1
            assert not failures, f"{number}: {scenario.controller}: {failures}, {outcome.error_peak * 1e3:.2f} mm"
        else:
            refused += 1
            failed += bool(failures)
    assert min(admitted, refused) >= len(NAMES)
    assert failed >= math.ceil(refused / 2)


def tolerant(**changes: Any) -> Scenario:
    """Return a slow crossing on a robot that is known within tolerances, from its encoders alone."""
    content = {
        "name": "tolerant",
        "controller": "unified",
        "waypoints": ((0.0, 0.12), (0.0, 0.05)),
        "segment_duration": 0.8,
        "unified": {"kp": 2500.0, "kd": 100.0, "weight": 0.3},
        "plant": {"encoder_counts": 20_000, "torque_limit": 2.0, "delay_samples": 1},
        "estimator": "ekf",
        "tolerances": {"length": 2e-4, "zero": 1e-3},
    }
    return Scenario.model_validate(content | changes)


@pytest.mark.extra
def test_a_crossing_that_the_tolerances_do_not_allow_is_refused_with_what_would() -> None:
    with pytest.raises(PlanRefused) as refusal:
        refuse_unfit(tolerant())
    text = str(refusal.value)
    assert re.search(
        rf"{UNCERTAINTY} is 0\.00.* m after 0\.4.* s, expected at most 0\.002 m; within the limits with"
        r" a gyroscope on the distal link of leg 2 \(ekf: {gyro: true}\),"
        r" or an encoder on the passive joint of leg 1 \(sensors: {passive_encoder: {leg: 1}}\),"
        r" or 2 times the speed \(there .* m/s\),"
        r" or lengths known to ±0\.1 mm \(with force: true",
        text,
    )
    refuse_unfit(tolerant(force=True))


@pytest.mark.parametrize(
    "changes",
    [
        {"ekf": {"gyro": True}},
        {"tolerances": {"length": 1e-4, "zero": 1e-3}},
        {"segment_duration": 0.4},
        {"error_tolerance": 0.01},
        {"risk": {"position": 1.0}},
    ],
)
def test_what_the_advice_names_is_admitted_and_so_is_a_wider_tolerance(changes: dict[str, Any]) -> None:
    refuse_unfit(tolerant(**changes))


def test_a_motion_that_asks_for_too_much_torque_is_refused_with_the_time_law_that_asks_for_less() -> None:
    content = {
        "name": "steep",
        "controller": "unified",
        "waypoints": ((0.0, 0.15), (0.0, 0.02)),
        "segment_duration": 0.24,
        "plant": {"torque_limit": 2.0},
    }
    with pytest.raises(PlanRefused, match=r"reference torque is .*; within the limits with time_law: optimal \(with"):
        refuse_unfit(Scenario.model_validate(content))
    refuse_unfit(Scenario.model_validate(content | {"time_law": "optimal"}))
    with pytest.raises(PlanRefused) as refusal:
        refuse_unfit(Scenario.model_validate(content | {"segment_duration": 0.1}))
    assert "time_law" not in str(refusal.value)


@pytest.mark.parametrize("changes", [{"tolerances": {"gyro_scale": 0.05}}, {"estimator": "none"}])
def test_without_tolerances_or_an_estimator_nothing_more_is_judged(changes: dict[str, Any]) -> None:
    scenario = tolerant(**changes)
    verdict = screened(scenario, scenario.plan())
    assert verdict.feasible
    assert {WRONG_MODE, UNCERTAINTY}.isdisjoint(figure.name for figure in verdict.figures)


@pytest.mark.extra
@pytest.mark.parametrize("gyro", [False, True])
def test_robots_within_the_tolerances_fare_as_predicted(gyro: bool) -> None:
    """What is refused leaves the tolerance on half of the robots at least, what is admitted on none of these."""
    bound = 4e-4
    scenario = tolerant(tolerances={"length": bound}, ekf={"gyro": gyro}, imu={"gyro_noise": 0.01})
    plan = scenario.plan()
    verdict = screened(scenario, plan)
    assert verdict.feasible is gyro
    samples = sampled(scenario.five_bar(), plan, scenario.rate_hz, scenario.lead_samples)
    left = 0
    for seed in range(ROBOTS):
        errors = np.random.default_rng((29, seed)).uniform(-bound, bound, 4).tolist()
        plant = scenario.plant._replace(links=LinkErrors(*errors), seed=seed)
        outcome = crossing(case_of(scenario.model_copy(update={"plant": plant})), samples)
        left += outcome.fault != NO_FAULT or outcome.error_peak > scenario.error_tolerance
    assert left == 0 if gyro else left >= ROBOTS / 2


@pytest.mark.parametrize(
    ("limit", "reason"),
    [
        (
            "safety: {workspace: [-0.01, 0.01, 0.0, 0.1]}",
            "distance of the reference from the edge of the workspace is -0.05 m at (0.0000, 0.1500) m",
        ),
        ("tracking_error_limit: 1.0e-6", "predicted distance from the reference is 3"),
    ],
)
def test_what_the_last_node_would_stop_is_refused_beforehand(tmp_path: Path, limit: str, reason: str) -> None:
    path = tmp_path / "limited.yaml"
    motion = "name: limited\ncontroller: unified\nwaypoints: [[0.0, 0.15], [0.0, 0.02], [0.0, 0.15]]\n"
    path.write_text(f"{motion}{limit}\n")
    with pytest.raises(PlanRefused, match=re.escape(reason)):
        load_admitted(str(path))
    path.write_text(f"{motion}safety: {{workspace: [-0.01, 0.01, 0.0, 0.16]}}\n")
    assert load_admitted(str(path)).safety.area.y_max == 0.16


@pytest.mark.extra
def test_who_forces_it_beyond_the_tolerance_has_not_succeeded(tmp_path: Path) -> None:
    """The whole motion is made without a fault, but 0.034 mm off its reference."""
    file, out = tmp_path / "tight.yaml", tmp_path / "out"
    made = load_scenario("unified_middle").model_copy(update={"error_tolerance": 3e-5, "force": True})
    file.write_text(made.to_yaml(), encoding="utf-8")
    done = CliRunner().invoke(app, ["simulate", str(file), "--no-page", "--out", str(out)])
    assert done.exit_code == 1
    last = done.stdout.splitlines()[-1]
    assert last == f"off_reference, at most 0.04 mm from the reference, tolerance 0.03 mm: look at {out}"
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    assert (summary["outcome"], summary["completed"], summary["within_tolerance"]) == ("off_reference", True, False)
    again = CliRunner().invoke(app, ["report", str(out)])
    assert again.exit_code == 1
    assert "<strong>The run ended off its reference</strong>" in (out / "report.html").read_text(encoding="utf-8")
