# SPDX-License-Identifier: Apache-2.0
"""What is told of a run of the graph whose bag cannot be read: a summary with its outcome, in every case."""

from __future__ import annotations

import json
import signal
from collections.abc import Callable
from pathlib import Path

import pytest

from fivebar_bringup.graph.node_spec import Mode
from fivebar_bringup.motions.stand import stand
from fivebar_bringup.recorded.run_directory import RunDirectory, new_run_directory
from fivebar_bringup.recorded.summary import Summary
from fivebar_bringup.runs import run as running
from fivebar_bringup.runs.launcher import INTERRUPTED, GraphOutcome, RunOptions
from fivebar_bringup.runs.run import report_on, run_with_ros
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_description.interrupts import STOP_SIGNALS, keyboard_interrupts


def run_once(scenario: Scenario, out: Path) -> tuple[RunDirectory, Summary]:
    return run_with_ros(scenario, RunOptions(Mode.LOCKSTEP, out))


def rest(scenario: Scenario, out: Path) -> tuple[RunDirectory, Summary]:
    return stand(scenario, None, RunOptions(Mode.LOCKSTEP, out))


@pytest.mark.extra
@pytest.mark.parametrize("start", [run_once, rest])
@pytest.mark.parametrize("number", STOP_SIGNALS)
def test_a_run_that_is_interrupted_while_it_is_compiled_has_a_summary(
    start: Callable[[Scenario, Path], tuple[RunDirectory, Summary]],
    number: signal.Signals,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    compiled = []

    def interrupted(*_: object) -> None:
        signal.raise_signal(number)
        compiled.append("to the end")

    monkeypatch.setattr(running, "compile_for", interrupted)
    with keyboard_interrupts():
        run, summary = start(load_scenario("unified_middle"), tmp_path / "run")
    assert (summary.outcome, summary.faults, summary.samples) == ("interrupted", ["interrupted"], 0)
    assert json.loads(run.summary.read_text(encoding="utf-8")) == summary.as_dict()
    assert not compiled


DIED = "node_died: plant ended with status 1"


@pytest.mark.parametrize("with_page", [True, False])
@pytest.mark.parametrize(
    ("faults", "bag", "outcome", "names"),
    [
        ([], None, "stopped", ["recording_failed"]),
        ([DIED], b"", "stopped", ["node_died", "recording_failed"]),
        ([DIED], None, "refused", ["node_died"]),
        (["nodes_not_started: status 1"], None, "refused", ["nodes_not_started"]),
        ([INTERRUPTED], None, "interrupted", ["interrupted"]),
    ],
)
def test_a_run_without_a_readable_bag_has_a_summary(
    faults: list[str], bag: bytes | None, outcome: str, names: list[str], with_page: bool, tmp_path: Path
) -> None:
    scenario = load_scenario("middle")
    run = new_run_directory(tmp_path / "run", scenario)
    if bag is not None:
        run.bag.mkdir()
        (run.bag / "metadata.yaml").write_bytes(bag)
    summary = report_on(run, scenario, Mode.LOCKSTEP, GraphOutcome(1.0, None, None, faults), with_page)
    assert (summary.outcome, summary.faults, summary.samples) == (outcome, names, 0)
    assert json.loads(run.summary.read_text(encoding="utf-8")) == summary.as_dict()
    if "recording_failed" in names:
        assert f"recording_failed: {run.bag}" in summary.fault_details[-1]
