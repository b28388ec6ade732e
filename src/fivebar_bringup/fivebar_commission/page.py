# SPDX-License-Identifier: Apache-2.0
"""The report of a commissioning: one page with what each step has found, and what is left to do."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from fivebar_bringup.pages.content import Cell
from fivebar_bringup.pages.rendering import render
from fivebar_bringup.recorded.results import write_results
from fivebar_commission.record import PASSED, CommissionState
from fivebar_commission.step import GatedStep

PAGE = "commission.html"


def write_page(folder: Path, state: CommissionState, steps: Sequence[GatedStep[Any]]) -> None:
    """Write the page.

    Raises:
        InputError: the folder cannot be written to.
    """
    write_results(folder, {PAGE: html_page(state, steps)})


def html_page(state: CommissionState, steps: Sequence[GatedStep[Any]]) -> str:
    """Return the page of a state."""
    done = {step.step: step for step in state.steps}
    closed = next((step for step in state.steps if step.outcome != PASSED), None)
    passed = sum(step.outcome == PASSED for step in state.steps)
    rows = []
    for step in steps:
        record = done.get(step.name)
        good = None if record is None else record.outcome == PASSED
        outcome = "to be done" if record is None else record.outcome
        questions = "" if record is None else str(record.questions)
        rows.append((step.title, Cell(outcome, outcome, good), questions, step.cost, step.risk, step.gate))
    details = [
        (
            step.title,
            done[step.name].words,
            [(name, _text(value)) for name, value in done[step.name].figures.items()],
            done[step.name].pages,
        )
        for step in steps
        if step.name in done
    ]
    return render(
        "commissioning.html",
        package="fivebar_commission",
        title=f"{state.robot}: commissioning",
        setting=(
            f"allowed: {state.torque_nm:g} Nm, {state.speed_rad_s:g} rad/s"
            + (f" · simulated robot {state.practice}" if state.practice else f" · drives {state.drives}")
            + " by the clock" * state.realtime
        ),
        good=closed is None,
        word=f"{passed} of {len(steps)} steps passed" if closed is None else "stopped",
        words="" if closed is None else closed.words,
        totals=(
            f"{sum(step.questions for step in state.steps)} questions,"
            f" {sum(step.robot_s for step in state.steps):.0f} s on the robot,"
            f" {sum(step.wall_s for step in state.steps):.0f} s by the clock"
        ),
        rows=rows,
        details=details,
    )


def _text(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, list | tuple):
        return ", ".join(map(_text, value)) or "none"
    return str(value)
