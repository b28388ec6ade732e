# SPDX-License-Identifier: Apache-2.0
"""The odds of a run's motions, as their planner has found them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from fivebar_bringup.bag.recording import Recording
from fivebar_bringup.recorded.results import read_json
from fivebar_description.interface import GOAL_STATUS
from fivebar_description.status_texts import read_goal_status
from fivebar_description.strict_yaml import StrictModel

Share = Annotated[float, Field(ge=0.0, le=1.0)]


class RunOdds(StrictModel):
    """The content of odds.json.

    Attributes:
        successes, robots: how many of the drawn robots have made the motion in simulation.
        share: of these robots.
        interval_95: of the success probability, with 95 % confidence.
        chosen: in what the motion differs from the planner's first choice, in words; "" for nothing.
    """

    successes: Annotated[int, Field(ge=0)]
    robots: Annotated[int, Field(ge=1)]
    share: Share
    interval_95: Annotated[tuple[Share, Share], Field(strict=False)]
    chosen: str = ""


def read_odds(path: Path) -> dict[str, Any] | None:
    """Read odds.json; None for a run whose odds are not known.

    Raises:
        InputError: the file cannot be read, or has unexpected content.
    """
    return read_json(path, RunOdds).model_dump(mode="json") if path.exists() else None


def requested_odds(recording: Recording) -> list[dict[str, Any]]:
    """Return the odds of the requested motions that a run has made, with goals and first samples, in order of time."""
    if not recording.count(GOAL_STATUS):
        return []
    statuses = recording.read_texts(GOAL_STATUS, read_goal_status, needed=False)
    fields = ("goal", "first_sample", "durations_s", "odds")
    return [{name: status.get(name) for name in fields} for status in statuses if "odds" in status]
