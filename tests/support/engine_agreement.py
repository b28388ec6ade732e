# SPDX-License-Identifier: Apache-2.0
"""The compiled loop beside the offline runner: a scenario in both, and what must agree."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import pytest

from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_bringup.simulation.case import Case, case_of
from fivebar_bringup.simulation.engine import crossing, traced_crossing
from fivebar_bringup.simulation.engine_table import TraceRow
from fivebar_bringup.simulation.offline import OfflineRun, simulate
from fivebar_bringup.simulation.run_metrics import RunMetrics
from fivebar_control.loop.closed_loop import FAULT_NAMES
from fivebar_control.loop.sampled_plan import Sampled, sampled
from fivebar_control.model.kinematics import state_from_joints
from fivebar_description.parameters import FiveBar

POSITION = 1e-9
"""m; what one source of equations and two plants must agree to."""

JOINTS = TraceRow._fields[:4]

SELDOM_COMPILED = ("ctc", "multi_cartesian", "multi_joint", "multi_model_ctc", "path")
"""Controllers without compiled runs in `make test`: each has a loop of its own, which takes 30 s to compile."""

COMPILED_ANYWAY = "unified"
"""The controller that takes the place of those where it does not matter which one it is."""


def long_if_seldom_compiled(controllers: Iterable[str]) -> list[Any]:
    """Return values of a test's parameter that leave `SELDOM_COMPILED` to the long tests."""
    return [
        pytest.param(name, marks=pytest.mark.extra if name in SELDOM_COMPILED else (), id=name) for name in controllers
    ]


def changed(name: str, plant: dict[str, Any] | None = None, **fields: Any) -> Scenario:
    """Return a shipped scenario with other values, by default with a controller that is compiled anyway."""
    content = load_scenario(name).model_dump(mode="json")
    if content["controller"] in SELDOM_COMPILED:
        content["controller"] = COMPILED_ANYWAY
    content |= fields
    content["plant"] |= plant or {}
    return Scenario.model_validate(content)


def prepared(scenario: Scenario, **options: Any) -> tuple[Case, Sampled]:
    plan = sampled(scenario.five_bar(), scenario.plan(), scenario.rate_hz, scenario.lead_samples)
    return case_of(scenario, **options), plan


def outcome_of(scenario: Scenario) -> RunMetrics:
    """Run a scenario compiled, which takes a hundredth of the time."""
    return crossing(*prepared(scenario))


def expect_completed(outcome: RunMetrics, scenario: Scenario, mode_changes: int) -> None:
    """Fail where a run has not reached its last sample without a fault, by so many changes of assembly mode."""
    assert FAULT_NAMES[outcome.fault] == ""
    assert outcome.samples == scenario.plan().path.samples(scenario.rate_hz) + 1
    assert outcome.mode_changes == mode_changes


def columns(trace: np.ndarray[Any, np.dtype[np.float64]], *names: str) -> np.ndarray[Any, np.dtype[np.float64]]:
    return trace[:, [TraceRow._fields.index(name) for name in names]]


def places(robot: FiveBar, joints: Any) -> np.ndarray[Any, np.dtype[np.float64]]:
    states = [state_from_joints(robot, *row, 0.0, 0.0, 0.0, 0.0) for row in np.asarray(joints).tolist()]
    return np.array([(state.x, state.y) for state in states])


def expect_agreement(scenario: Scenario, torque: float = 1e-9) -> tuple[OfflineRun, RunMetrics]:
    """Compare sample by sample: exact platform (m), commanded and applied torques (Nm), faults."""
    run = simulate(scenario)
    outcome, trace = traced_crossing(*prepared(scenario))
    assert outcome.samples == len(run.samples) == len(trace)
    exact = [sample.exact for sample in run.samples]
    if scenario.has_ground_truth or scenario.plant.encoder_counts is None:
        robot = scenario.five_bar()
        found, wanted = columns(trace, *JOINTS), [one.position for one in exact]
        np.testing.assert_allclose(places(robot, found), places(robot, wanted), rtol=0.0, atol=POSITION)
    for names, wanted in (
        (("command1", "command2"), [sample.command for sample in run.samples]),
        (("applied1", "applied2"), [(one.effort[0], one.effort[2]) for one in exact]),
    ):
        np.testing.assert_allclose(columns(trace, *names), wanted, rtol=0.0, atol=torque)
    used = [state_from_joints(scenario.five_bar(), *s.measured.position, *s.measured.velocity) for s in run.samples]
    np.testing.assert_allclose(
        columns(trace, "estimated_x", "estimated_y"), [(one.x, one.y) for one in used], rtol=0.0, atol=POSITION
    )
    assert [fault.partition(":")[0] for fault in run.faults] == [FAULT_NAMES[outcome.fault]] * (outcome.fault != 0)
    return run, outcome
