# SPDX-License-Identifier: Apache-2.0
"""What the live page says of a run: finished, stopped, interrupted and stale are told from each other."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from fivebar_bringup.pages.scripts import page_scripts
from fivebar_bringup.recorded.outcome import RunOutcome
from fivebar_bringup.recorded.summary import Summary
from fivebar_bringup.report.replay import SCRIPTS
from fivebar_live.ending import ended_message, ended_text
from fivebar_live.page import live_page
from fivebar_live.run_state import node_level, run_state

ENDED = "drives_off: the plant has ended"
NOT_ACTIVE = "drives_off: dextar_bridge is not active"


@pytest.mark.parametrize(
    ("run", "faults", "drives", "silence", "word"),
    [
        ({}, [], None, None, "waiting"),
        ({}, [], None, 0.5, "waiting"),
        ({}, [], NOT_ACTIVE, 0.5, "off"),
        ({"state": "running", "sample": 7}, [], "ok", 0.5, "running"),
        ({"state": "running", "sample": 7}, [], None, 0.5, "running"),
        # before the first sample, as while a bridge waits to be activated
        ({"state": "running", "sample": 0}, [], NOT_ACTIVE, 0.5, "off"),
        ({"state": "completed", "sample": 500}, [], ENDED, 0.5, "finished"),
        ({"state": "completed", "sample": 500}, [], ENDED, 60.0, "finished"),
        ({"state": "completed", "sample": 500}, [], NOT_ACTIVE, 60.0, "finished"),
        # a fault at the blender; the plant goes on to its last sample
        ({"state": "completed", "sample": 500}, ["tracking_lost: 51 mm"], ENDED, 60.0, "stopped"),
        ({"state": "failed", "sample": 7}, ["plant_diverged: after sample 7"], ENDED, 60.0, "stopped"),
        ({"state": "running", "sample": 7}, [], ENDED, 0.5, "interrupted"),
        ({"state": "failed", "sample": 7}, [], NOT_ACTIVE, 60.0, "interrupted"),
        ({"state": "running", "sample": 7}, [], "ok", 4.0, "stale"),
        ({}, [], None, 4.0, "stale"),
    ],
)
def test_the_state_of_a_run(
    run: dict[str, Any], faults: list[str], drives: str | None, silence: float | None, word: str
) -> None:
    state = run_state(run, faults, drives, silence)
    assert state.word == word
    assert state.text.startswith(word) or word == "off"


@pytest.mark.parametrize(
    ("age", "word", "level"),
    [
        (2.0, "running", "ok"),
        (4.0, "running", "stale"),
        (4.0, "stopped", "stale"),
        (2.0, "finished", "ok"),
        (4.0, "finished", "ended"),
        (4.0, "interrupted", "ended"),
    ],
)
def test_a_node_that_is_silent_after_the_run_has_ended_is_not_stale(age: float, word: Any, level: str) -> None:
    assert node_level("ok", age, word) == level


@pytest.mark.parametrize(
    ("outcome", "judge", "reasons", "text"),
    [
        ("succeeded", "timed", [], "finished: succeeded, at most 0.04 mm from the reference, tolerance 2 mm"),
        ("succeeded", "path", [], "finished: succeeded, at most 0.02 mm from the path, tolerance 2 mm"),
        ("off_reference", "timed", [], "finished: off_reference, at most 0.04 mm from the reference, tolerance 2 mm"),
        ("stopped", "timed", ["tracking_lost: 51 mm"], "stopped: tracking_lost: 51 mm"),
    ],
)
def test_the_end_is_told_with_the_report(
    tmp_path: Path, outcome: str, judge: str, reasons: list[str], text: str
) -> None:
    report = tmp_path / "report.html"
    report.write_text("<h1>µ</h1>", encoding="utf-8")
    peaks = {"tracking_error_peak_m": 3.355e-5, "path_error_peak_m": 1.2e-5}
    values = {"judge": judge, "error_tolerance_m": 0.002, "overruns": None}
    made = SimpleNamespace(outcome=RunOutcome(outcome), not_completed_because=reasons, **peaks, **values)
    line = ended_text(cast(Summary, made), report)
    assert line.count("\n") == 1
    assert ended_message(line) == {"outcome": outcome, "text": text, "report": str(report), "html": "<h1>µ</h1>"}
    assert json.loads(ended_text(cast(Summary, made), None))["report"] is None


def test_the_page_allows_the_scripts_of_the_report_that_it_opens() -> None:
    allowed = live_page()
    for digest in page_scripts(SCRIPTS, {}, "data").policy.split()[1:]:
        assert digest.strip("'") in allowed
