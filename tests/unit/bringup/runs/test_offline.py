# SPDX-License-Identifier: Apache-2.0
"""A run without ROS that a signal ends: it leaves what it has."""

from __future__ import annotations

import json
import os
import signal
from pathlib import Path

import pytest

from fivebar_bringup.bag.reader import read_bag
from fivebar_bringup.recorded.outcome import EXIT_STATUS
from fivebar_bringup.runs.offline import run_offline
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_description.interface import JOINT_STATES, TORQUE_COMMAND
from fivebar_description.interrupts import STOP_SIGNALS, keyboard_interrupts

LAST = 50
"""Sample after which the signal comes."""


@pytest.mark.extra
@pytest.mark.parametrize("number", STOP_SIGNALS)
def test_an_interrupted_run_leaves_its_samples(number: signal.Signals, tmp_path: Path) -> None:
    def progress(done: int, total: int) -> None:
        if done == LAST:
            os.kill(os.getpid(), number)

    with keyboard_interrupts():
        run, summary = run_offline(load_scenario("middle"), tmp_path / "run", progress, with_page=False)
    assert (summary.outcome, summary.faults, EXIT_STATUS[summary.outcome]) == ("interrupted", ["interrupted"], 1)
    assert summary.samples == LAST + 1
    assert json.loads(run.summary.read_text(encoding="utf-8")) == summary.as_dict()
    bag = read_bag(run.bag)
    assert bag.count(JOINT_STATES) == LAST + 1
    assert not bag.field(TORQUE_COMMAND, "effort")[-1].any()
