"""Tasks of a hand as lines between two processes."""

from __future__ import annotations

import pytest

from fivebar_bringup.commission.person import Lead, PutAt, Task, Turn
from fivebar_bringup.commission.practice_tasks import task_line, task_of
from fivebar_bringup.scenarios.scenario_files import load_scenario


@pytest.mark.parametrize("task", [Turn(1, -0.35), PutAt(0.0, 0.14), Lead(load_scenario("middle"))])
def test_a_task_is_read_as_it_was_written(task: Task) -> None:
    line = task_line(task)
    assert "\n" not in line
    assert task_of(line) == task
