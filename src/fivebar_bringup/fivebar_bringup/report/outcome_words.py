"""What became of a run in words: for the last line of a command and the first one of the page."""

from __future__ import annotations

from fivebar_bringup.recorded.outcome import RunOutcome
from fivebar_bringup.recorded.summary import Summary
from fivebar_description.rounding import in_millimetres

SENTENCES = {
    RunOutcome.SUCCEEDED: "The run succeeded",
    RunOutcome.OFF_REFERENCE: "The run ended off its reference",
    RunOutcome.STOPPED: "The run was stopped",
    RunOutcome.REFUSED: "The run was refused, nothing has moved",
    RunOutcome.INTERRUPTED: "The run was interrupted",
}
"""How the sentence about each outcome begins."""

ENDED = (RunOutcome.SUCCEEDED, RunOutcome.OFF_REFERENCE)
"""Outcomes of runs whose whole motion was made."""


def outcome_details(summary: Summary) -> str:
    """Return what follows the word of an outcome in the last line: the error where the motion was made, and reasons."""
    details = f", {_distance(summary)}" if summary.outcome in ENDED else ""
    reasons = "; ".join(summary.not_completed_because)
    return f"{details}: {reasons}" if reasons else details


def outcome_sentence(summary: Summary) -> tuple[str, str]:
    """Return a sentence about the outcome of a run in two parts: the one to be stressed, and what is known besides."""
    if summary.outcome not in ENDED:
        return SENTENCES[summary.outcome], ""
    parts = [f"all {summary.samples} samples", _changes(summary), "no fault", _distance(summary)]
    return SENTENCES[summary.outcome], f": {', '.join(parts)}"


def _distance(summary: Summary) -> str:
    text = f"at most {in_millimetres(summary.tracking_error_peak_m)} from the reference"
    if summary.overruns is not None:
        samples = "sample" if summary.overruns == 1 else "samples"
        text += f", {summary.overruns} {samples} late and {summary.missing_samples} missing"
    return f"{text}, tolerance {summary.error_tolerance_m * 1e3:g} mm"


def _changes(summary: Summary) -> str:
    count = summary.assembly_mode_changes
    text = f"{count} {'change' if count == 1 else 'changes'} of assembly mode"
    return f"{text}, {summary.working_mode_changes} of working mode" if summary.working_mode_changes else text
