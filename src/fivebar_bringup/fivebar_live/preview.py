# SPDX-License-Identifier: Apache-2.0
"""Plans a motion requested on the live page as the graph would, without running it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from fivebar_control.planning.orders import Conditions, PlanningRequest
from fivebar_control.planning.planning_process import PlanningProcess
from fivebar_live.commands import Command


class Preview:
    """Plans one motion at a time; no method waits for a plan."""

    def __init__(self, conditions: Conditions, working_mode: Sequence[int]) -> None:
        """Plan under the graph's conditions for requests, in the robot's working mode (two signs)."""
        self._planning = PlanningProcess(conditions, gives_way=True)
        self._working_mode = (working_mode[0], working_mode[1])
        self._goal: Command | None = None

    @property
    def busy(self) -> bool:
        """Whether a motion is being planned."""
        return self._goal is not None

    def ask(self, goal: Command, start: tuple[float, float]) -> None:
        """Plan a motion from where the reference rests (m)."""
        self._goal = goal
        self._planning.ask(PlanningRequest(start, self._working_mode, (goal.x, goal.y), goal.assembly, 0.0))

    def answer(self) -> dict[str, Any] | None:
        """Return the plan or its refusal in the page's format, once; None while there is none."""
        planned = None if self._goal is None else self._planning.answer()
        if planned is None or self._goal is None:
            return None
        goal, self._goal = self._goal, None
        return answer_to(goal, planned.refused, planned.course.waypoints, planned.durations)

    def close(self) -> None:
        """End the planning."""
        self._planning.close()


def answer_to(
    goal: Command,
    refused: str,
    waypoints: Sequence[tuple[float, float]] = (),
    durations: Sequence[float] = (),
) -> dict[str, Any]:
    """Return an answer in the page's format: a motion (m, s), or the reason why there is none."""
    return {"plan": {"refused": refused, "waypoints": waypoints, "durations": durations, "goal": goal._asdict()}}
