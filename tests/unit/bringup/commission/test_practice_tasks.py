# SPDX-License-Identifier: Apache-2.0
"""Tasks of a hand as lines between two processes."""

from __future__ import annotations

import pytest

from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_commission.person import Lead, PutAt, Task, Turn
from fivebar_commission.practice_tasks import Led, task_line, task_of


@pytest.mark.parametrize("task", [Turn(1, -0.35), PutAt(0.0, 0.14)])
def test_a_task_is_read_as_it_was_written(task: Task) -> None:
    assert task_of(task_line(task)) == task


def test_a_motion_by_hand_goes_along_the_waypoints_of_its_scenario() -> None:
    scenario = load_scenario("middle")
    line = task_line(Lead(scenario))
    assert "\n" not in line
    led, path = task_of(line), scenario.plan().path
    assert isinstance(led, Led)
    assert led.duration == pytest.approx(path.duration, abs=0.011)
    for moment in (0.0, 0.3337, 0.5, 1.2, path.duration, path.duration + 1.0):
        found, wanted = led.at(moment), path.at(min(moment, path.duration))
        assert found[:2] == pytest.approx(wanted[:2], abs=1e-4)
        assert found[2:4] == pytest.approx(wanted[2:4], abs=2e-3)
