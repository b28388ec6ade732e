# SPDX-License-Identifier: Apache-2.0
"""Tasks for a hand at a robot, as lines of text between two processes."""

from __future__ import annotations

import json
from typing import Any, NamedTuple

from fivebar_commission.person import Lead, PutAt, Task, Turn
from fivebar_control.model.state import Platform

DONE = "done"
"""The answer to a task that is done."""

READY = "ready"
"""Said once, when tasks are taken."""

LED_RATE_HZ = 100
"""Rows a second of a motion by hand."""


class Led(NamedTuple):
    """A motion by hand: places (m) and velocities (m/s) of the platform, `LED_RATE_HZ` of them a second."""

    rows: list[list[float]]

    @property
    def duration(self) -> float:
        """How long it takes (s)."""
        return (len(self.rows) - 1) / LED_RATE_HZ

    def at(self, time: float) -> Platform:
        """Return where the platform is to be at a time (s)."""
        place = min(max(0.0, time * LED_RATE_HZ), len(self.rows) - 1.0)
        number = min(int(place), len(self.rows) - 2)
        share = place - number
        x, y, vx, vy = (
            value + share * (next_value - value)
            for value, next_value in zip(self.rows[number], self.rows[number + 1], strict=True)
        )
        return Platform(x, y, vx, vy, 0.0, 0.0)


def task_line(task: Task) -> str:
    """Return a task as a line without its end."""
    content: dict[str, Any]
    match task:
        case Turn(motor, angle):
            content = {"turn": [motor, angle]}
        case PutAt(x, y):
            content = {"put": [x, y]}
        case Lead(scenario):
            # planned here: whoever serves drives has no time for it
            path = scenario.plan().path
            rows = [path.at(number / LED_RATE_HZ)[:4] for number in range(path.samples(LED_RATE_HZ) + 1)]
            content = {"lead": rows}
    return json.dumps(content)


def task_of(line: str) -> Turn | PutAt | Led:
    """Return the task of a line."""
    match json.loads(line):
        case {"turn": [int(motor), float(angle)]}:
            return Turn(motor, angle)
        case {"put": [float(x), float(y)]}:
            return PutAt(x, y)
        case {"lead": list(rows)}:
            return Led(rows)
    raise AssertionError(f"no task: {line}")
