# SPDX-License-Identifier: Apache-2.0
"""Commands of the live page: emergency stop, reset, a plan and a motion. None of them sets a torque."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from pydantic import Field

from fivebar_description.joint_sample import MessageError
from fivebar_description.outside_text import OutsideModel, check_fields, read_object

STOP, RESET, PLAN, MOVE = "emergency_stop", "reset", "plan", "move"

LARGEST = 1e3
"""Largest coordinate (m) that is accepted."""

Coordinate = Annotated[float, Field(ge=-LARGEST, le=LARGEST)]


class PlainCommand(OutsideModel, extra="forbid"):
    """A command without a goal."""

    command: str


class GoalCommand(PlainCommand):
    """A command with a goal: x, y (m), and the sign of det A there, 0 for either."""

    x: Coordinate
    y: Coordinate
    assembly: Annotated[int, Field(ge=-1, le=1)]


MODELS: dict[str, type[OutsideModel]] = {STOP: PlainCommand, RESET: PlainCommand, PLAN: GoalCommand, MOVE: GoalCommand}


class CommandRefused(ValueError):
    """A message is not a valid command; says why."""


class Command(NamedTuple):
    """A command, with the goal of a plan or a motion."""

    name: str
    x: float = 0.0
    y: float = 0.0
    assembly: int = 0


def read_command(text: str | bytes) -> Command:
    """Return the command in a message of a page.

    Raises:
        CommandRefused: it is none, or has other fields than its own.
    """
    try:
        fields = read_object(text)
        name = fields.get("command")
        if not isinstance(name, str) or name not in MODELS:
            raise CommandRefused(f"expected one of the commands {', '.join(MODELS)}")
        check_fields(fields, MODELS[name])
    except MessageError as error:
        raise CommandRefused(str(error)) from None
    if MODELS[name] is PlainCommand:
        return Command(name)
    return Command(name, float(fields["x"]), float(fields["y"]), fields["assembly"])
