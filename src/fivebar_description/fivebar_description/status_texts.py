"""The statuses that nodes publish as JSON on String topics: their fields, and readers that refuse everything else."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fivebar_description.outside_text import (
    Field,
    either,
    is_count,
    is_none,
    is_number,
    is_text,
    list_of,
    one_line,
    one_of,
    read_object,
)

RUN_STATES = ("running", "completed", "failed")
"""States of a run."""

GOAL_STATES = (
    *("planning", "moving", "pausing", "paused", "resumed", "stopping"),
    *("arrived", "cancelled", "refused", "stopped"),
)
"""States of a request for a motion."""

PROGRAM_STATES = ("idle", "running", "completed", "refused", "stopped")
"""States of a program."""

LONGEST_REASON = 2000
"""Largest number of characters of a reason that is kept."""

PID = Field(is_count, "a process id")
"""The process that publishes a status, by which its launcher knows it."""

_PERCENTILES = ("p50", "p99", "max")

_NUMBERS = list_of(is_number)


def is_latency(value: Any) -> bool:
    """Return whether a value is what `LatencyWatch.summary` returns of answers (ms)."""
    return isinstance(value, dict) and all(is_number(value.get(name)) for name in _PERCENTILES)


def is_odds(value: Any) -> bool:
    """Return whether a value tells how likely a motion is to succeed, or why that is not known."""
    if not isinstance(value, dict):
        return False
    better = value.get("better")
    if better is not None and not (isinstance(better, dict) and is_number(better.get("duration_s"))):
        return False
    told = [one for one in (value, better) if one is not None]
    worded = all(is_text(one.get(name, "")) for one in told for name in ("unknown", "chosen", "how"))
    return worded and all(_counts_robots(one) for one in told if "unknown" not in one)


def _counts_robots(value: dict[str, Any]) -> bool:
    made, robots = value.get("successes", -1), value.get("robots", 0)
    interval = list_of(is_number, 2)(value.get("interval_95"))
    return interval and is_count(made) and is_count(robots) and bool(made <= robots > 0)


RUN_STATUS_FIELDS = {
    "state": Field(one_of(RUN_STATES), f"one of {', '.join(RUN_STATES)}", needed=True),
    "sample": Field(is_count, "a number of a sample", needed=True),
    "samples": Field(is_count, "a number of samples", needed=True),
    "overruns": Field(is_count, "a number of samples"),
    "latency_ms": Field(either(is_none, is_latency), f"null or {', '.join(_PERCENTILES)} in ms"),
    "pid": PID,
}

PROGRAM_STATUS_FIELDS = {
    "state": Field(one_of(PROGRAM_STATES), f"one of {', '.join(PROGRAM_STATES)}", needed=True),
    "program": Field(is_text, "a name"),
    "step": Field(is_text, "the place of a step"),
    "line": Field(is_count, "a number"),
    "done": Field(is_count, "a number"),
    "of": Field(is_count, "a number"),
    "reason": Field(is_text, "a text"),
    "pid": PID,
}

GOAL_STATUS_FIELDS = {
    "state": Field(one_of(GOAL_STATES), f"one of {', '.join(GOAL_STATES)}", needed=True),
    "goal": Field(list_of(either(is_none, is_number), 0, 1, 2), "coordinates in m"),
    "id": Field(is_text, "a text"),
    "reason": Field(is_text, "a text"),
    "first_sample": Field(is_count, "a number of a sample"),
    "last_sample": Field(is_count, "a number of a sample"),
    "waypoints": Field(list_of(list_of(is_number, 2)), "pairs of coordinates in m"),
    "durations_s": Field(_NUMBERS, "durations in s"),
    "blend_radius": Field(_NUMBERS, "radii in m"),
    "time_law": Field(is_text, "a name"),
    "payload_kg": Field(is_number, "a mass in kg"),
    "odds": Field(is_odds, "successes, robots and interval_95, or unknown"),
    "knots": Field(list_of(list_of(is_number, 7)), "times, coordinates and their derivatives"),
    "slowing_s": Field(is_number, "a time in s"),
    "path_time_s": Field(is_number, "a time in s"),
    "rising_s": Field(is_number, "a time in s"),
    "assembly_mode": Field(is_number, "-1, 0 or 1"),
}


def _read(text: str, fields: Mapping[str, Field]) -> dict[str, Any]:
    content = read_object(text, fields)
    if "reason" in content:
        content["reason"] = one_line(content["reason"], LONGEST_REASON)
    return content


def read_run_status(text: str) -> dict[str, Any]:
    """Return the content of a text of `run/status`.

    Raises:
        MessageError: it is not that of a run.
    """
    return _read(text, RUN_STATUS_FIELDS)


def read_program_status(text: str) -> dict[str, Any]:
    """Return the content of a text of `program/status`.

    Raises:
        MessageError: it is not that of a program.
    """
    return _read(text, PROGRAM_STATUS_FIELDS)


def read_goal_status(text: str) -> dict[str, Any]:
    """Return the content of a text of `goal/status`.

    Raises:
        MessageError: it is not that of a request.
    """
    return _read(text, GOAL_STATUS_FIELDS)
