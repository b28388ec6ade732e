# SPDX-License-Identifier: Apache-2.0
"""The statuses that nodes publish as JSON on String topics: their fields, and readers that refuse everything else."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from fivebar_description.outside_text import Count, OutsideModel, Pair, one_line, read_object

LONGEST_REASON = 2000
"""Largest number of characters of a reason that is kept."""


class LatencyText(OutsideModel):
    """Latency of answers (ms), as `LatencyWatch.summary` returns it."""

    p50: float
    p99: float
    max: float


class RunStatusText(OutsideModel):
    """The fields of `run/status`; `pid` is the process that publishes it, by which its launcher knows it."""

    state: Literal["running", "completed", "failed"]
    sample: Count
    samples: Count
    overruns: Count = 0
    latency_ms: LatencyText | None = None
    pid: Count = 0


class ProgramStatusText(OutsideModel):
    """The fields of `program/status`."""

    state: Literal["idle", "running", "completed", "refused", "stopped"]
    program: str = ""
    step: str = ""
    line: Count = 0
    done: Count = 0
    of: Count = 0
    reason: str = ""
    pid: Count = 0


class RobotsText(OutsideModel):
    """How many of the drawn robots make a motion, or why that is not known."""

    unknown: str = ""
    chosen: str = ""
    how: str = ""
    successes: Count = 0
    robots: Count = 0
    interval_95: Pair | None = None

    @model_validator(mode="after")
    def _counts_robots(self) -> RobotsText:
        counted = self.interval_95 is not None and self.successes <= self.robots > 0
        if not counted and "unknown" not in self.model_fields_set:
            raise ValueError("expected successes, robots and interval_95, or unknown")
        return self


class BetterText(RobotsText):
    """The same of a duration (s) that is likelier to succeed."""

    duration_s: float


class OddsText(RobotsText):
    """How likely a motion is to succeed, and which duration would be better."""

    better: BetterText | None = None


class GoalStatusText(OutsideModel):
    """The fields of `goal/status`: goal and waypoints in m, `motors` in rad.

    A trajectory is told by what tells it from others in the bag; in bags of former releases by `knots`: times,
    coordinates and their derivatives.
    """

    state: Literal[
        "planning", "moving", "pausing", "paused", "resumed", "stopping", "arrived", "cancelled", "refused", "stopped"
    ]
    goal: list[float | None] = Field([], max_length=2)
    id: str = ""
    reason: str = ""
    first_sample: Count = 0
    last_sample: Count = 0
    waypoints: list[Pair] = Field([])
    durations_s: list[float] = Field([])
    blend_radius: list[float] = Field([])
    time_law: str = ""
    payload_kg: float = 0.0
    odds: OddsText = Field(default_factory=OddsText.model_construct)
    trajectory: str = ""
    motors: list[float] = Field([], max_length=2)
    knots: list[Annotated[list[float], Field(min_length=7, max_length=7)]] = Field([])
    slowing_s: float = 0.0
    path_time_s: float = 0.0
    rising_s: float = 0.0
    assembly_mode: float = 0.0


def _read(text: str, model: type[OutsideModel]) -> dict[str, Any]:
    content = read_object(text, model)
    if "reason" in content:
        content["reason"] = one_line(content["reason"], LONGEST_REASON)
    return content


def read_run_status(text: str) -> dict[str, Any]:
    """Return the content of a text of `run/status`.

    Raises:
        MessageError: it is not that of a run.
    """
    return _read(text, RunStatusText)


def read_program_status(text: str) -> dict[str, Any]:
    """Return the content of a text of `program/status`.

    Raises:
        MessageError: it is not that of a program.
    """
    return _read(text, ProgramStatusText)


def read_goal_status(text: str) -> dict[str, Any]:
    """Return the content of a text of `goal/status`.

    Raises:
        MessageError: it is not that of a request.
    """
    return _read(text, GoalStatusText)
