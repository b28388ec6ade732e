# SPDX-License-Identifier: Apache-2.0
"""The first crossing of the robot, slow to fast, each stopped at the first sign."""

from __future__ import annotations

from fivebar_bringup.recorded.outcome import RunOutcome
from fivebar_bringup.report.outcome_words import outcome_details
from fivebar_bringup.scenario import Scenario
from fivebar_commission.session import Session
from fivebar_commission.step import Findings, GateClosed, GatedStep, fault_or_outcome
from fivebar_commission.steps.rehearsal import chosen_crossings
from fivebar_description.rounding import in_millimetres


def run_slow(session: Session) -> Findings:
    """Make the slowest of the chosen crossings."""
    return _crossed(session, chosen_crossings(session)[:1])


def run_fast(session: Session) -> Findings:
    """Make the others, from slow to fast."""
    left = chosen_crossings(session)[1:]
    if not left:
        return Findings("one duration only is likely enough to succeed, which has been made")
    return _crossed(session, left)


def _crossed(session: Session, scenarios: list[Scenario]) -> Findings:
    figures: dict[str, object] = {}
    pages, words = list[str](), list[str]()
    for scenario in scenarios:
        folder, summary = session.run(scenario, "crossing", page=True)
        name = f"there and back in {sum(scenario.durations()):.2f} s"
        pages.append(str(folder.page.relative_to(session.folder)))
        peak, limit = summary.tracking_error_peak_m, summary.error_tolerance_m
        figures[f"{name}: largest error, mm"] = None if peak is None else round(1e3 * peak, 3)
        figures[f"{name}: largest torques, Nm"] = list(summary.torque_peak_nm)
        if summary.outcome is not RunOutcome.SUCCEEDED:
            became = f"{summary.outcome}{outcome_details(summary)}"
            raise GateClosed(fault_or_outcome(summary), f"{name}: {became}: look at {folder.path}", figures)
        words.append(f"{name}: at most {in_millimetres(peak or 0.0)} off, tolerance {in_millimetres(limit)}")
    return Findings("; ".join(words), figures, tuple(pages))


FIRST = GatedStep(
    name="crossing",
    title="The first crossing",
    does="makes the slowest of the likely crossings, there and back",
    cost="a minute",
    risk="the first passage through the locus: without torque at the first fault, and 4 mm off; a hand on the emergency"
    " stop",
    gate="no fault, and never more than the tolerance off",
    run=run_slow,
)

FASTER = GatedStep(
    name="faster",
    title="Faster crossings",
    does="makes the other likely crossings, from slow to fast",
    cost="two minutes",
    risk="as before, quicker",
    gate="no fault, and never more than the tolerance off",
    run=run_fast,
)
