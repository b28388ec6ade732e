# SPDX-License-Identifier: Apache-2.0
"""Carries out a program: issues its instructions one after the other, each when the one before it is over.

Nothing here imports ROS: who carries it out passes the time and the outcome of the moves.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from enum import StrEnum
from typing import Any

from fivebar_control.planning.program import Action, Carry, Follow, Instruction, Move, Wait

SETTLING = 0.1
"""Time (s) for which the robot rests with another payload before it goes on: by then all nodes have received it."""


class ProgramState(StrEnum):
    """How far a program has come."""

    IDLE = "idle"
    RUNNING = "running"
    COMPLETED = "completed"
    REFUSED = "refused"
    STOPPED = "stopped"


ENDED = (ProgramState.COMPLETED, ProgramState.REFUSED, ProgramState.STOPPED)


class ProgramRun:
    """A program that is carried out."""

    def __init__(self, name: str, instructions: Sequence[Instruction], done: int = 0) -> None:
        """Begin with an instruction; those before it, whose number is `done`, have been carried out."""
        self.name = name
        self.state = ProgramState.RUNNING
        self.reason = ""
        self._instructions = tuple(instructions)
        self._next = done
        self._under_way: Move | Follow | None = None
        self._until = 0.0
        self._ending = False

    @property
    def present(self) -> Instruction | None:
        """The instruction that was issued last, None before the first."""
        return self._instructions[self._next - 1] if self._next else None

    def due(self, now: float) -> Iterator[Action]:
        """Issue what is due at a time (s), one action after the other; a move or a rest is waited for."""
        while self.state is ProgramState.RUNNING and self._under_way is None and now >= self._until:
            if self._ending or self._next == len(self._instructions):
                self.state = ProgramState.STOPPED if self._ending else ProgramState.COMPLETED
                return
            action = self._instructions[self._next].action
            self._next += 1
            if isinstance(action, Wait):
                self._until = now + action.seconds
            elif isinstance(action, Carry):
                self._until = now + SETTLING
            elif isinstance(action, Move | Follow):
                self._under_way = action
            yield action

    def on_goal(self, status: dict[str, Any]) -> None:
        """Take the status of a request; those of other requests than the present move are ignored."""
        move = self._under_way
        if self.state is not ProgramState.RUNNING or move is None:
            return
        if isinstance(move, Move) and status.get("goal") != [move.x, move.y]:
            return
        if status["state"] == "arrived":
            self._under_way = None
        elif status["state"] in ("refused", "stopped", "cancelled"):
            state = ProgramState.REFUSED if status["state"] == "refused" else ProgramState.STOPPED
            self._end(state, str(status.get("reason", "")))

    def stop(self, reason: str) -> None:
        """End it at once, as after a fault."""
        if self.state is ProgramState.RUNNING:
            self._end(ProgramState.STOPPED, reason)

    def end_after_this(self, reason: str) -> None:
        """End it when what is under way is over."""
        self._ending, self.reason = True, reason

    def status(self) -> dict[str, Any]:
        """Return how far it has come, as plain values."""
        at = self.present
        content: dict[str, Any] = {"state": self.state.value, "program": self.name}
        if at is not None:
            content |= {"step": at.number, "line": at.line, "rounds": [list(counted) for counted in at.rounds]}
            # only moves with via points report these
            fields = {key: value for key, value in at.action._asdict().items() if value != ()}
            content["action"] = {type(at.action).__name__: fields}
        content |= {"done": self._next, "of": len(self._instructions)}
        if self.reason:
            content["reason"] = self.reason
        return content

    def _end(self, state: ProgramState, reason: str) -> None:
        at = self.present
        self.state = state
        self.reason = f"{at.place}: {reason}" if at is not None else reason
