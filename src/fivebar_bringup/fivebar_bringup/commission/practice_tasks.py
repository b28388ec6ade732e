"""What a hand is to do to a robot, as a line of text between two processes."""

from __future__ import annotations

import json
from typing import Any

from fivebar_bringup.commission.person import Lead, PutAt, Task, Turn
from fivebar_bringup.scenario import Scenario
from fivebar_description.strict_yaml import validate

DONE = "done"
"""The answer to a task that is done."""

READY = "ready"
"""Said once, when tasks are taken."""


def task_line(task: Task) -> str:
    """Return a task as a line without its end."""
    content: dict[str, Any]
    match task:
        case Turn(motor, angle):
            content = {"turn": [motor, angle]}
        case PutAt(x, y):
            content = {"put": [x, y]}
        case Lead(scenario):
            content = {"lead": scenario.model_dump(mode="json")}
    return json.dumps(content)


def task_of(line: str) -> Task:
    """Return the task of a line."""
    match json.loads(line):
        case {"turn": [int(motor), float(angle)]}:
            return Turn(motor, angle)
        case {"put": [float(x), float(y)]}:
            return PutAt(x, y)
        case {"lead": content}:
            return Lead(validate(content, Scenario, "task"))
    raise AssertionError(f"no task: {line}")
