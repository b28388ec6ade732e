# SPDX-License-Identifier: Apache-2.0
"""Messages of a command to the viewer that it started, and of this to the pages: what became of the run."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fivebar_bringup.report.outcome_words import ENDED, outcome_details

if TYPE_CHECKING:
    from fivebar_bringup.recorded.summary import Summary


def ended_text(summary: Summary, report: Path | None) -> str:
    """Return the line in which a command tells what became of its run, and where its report is, if there is one."""
    finished = "finished: " if summary.outcome in ENDED else ""
    text = f"{finished}{summary.outcome}{outcome_details(summary)}"
    place = None if report is None else str(report.absolute())
    return json.dumps({"outcome": summary.outcome, "text": text, "report": place}) + "\n"


def ended_message(line: str) -> dict[str, Any]:
    """Return the content of that line for a page, with the report itself: the server ends before anyone reads it."""
    content: dict[str, Any] = json.loads(line)
    report = content["report"]
    return {**content, "html": None if report is None else Path(report).read_text(encoding="utf-8")}
