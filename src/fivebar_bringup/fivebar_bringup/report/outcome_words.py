# SPDX-License-Identifier: Apache-2.0
"""The outcome of a run in words: for the last lines of a command and the first one of the page."""

from __future__ import annotations

import math

from fivebar_bringup.recorded.outcome import RunOutcome
from fivebar_bringup.recorded.summary import Summary
from fivebar_control.trajectory.path_distance import KEPT_TO, TIMED, judged_distance
from fivebar_control.trajectory.refusal import ELBOWS_UNKNOWN, place
from fivebar_description.robot_file import UNKNOWN
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


def outcome_rows(summary: Summary) -> list[tuple[str, str]]:
    """Return the rows that a person looks for first in a run, with units: names and texts."""
    extent = f"{summary.samples} of {summary.planned_samples} samples, {_changes(summary)}"
    rows = [("motion", extent if summary.simulated_s is None else f"{summary.simulated_s:.2f} s, {extent}")]
    peak, limit = _judged_peak(summary), f"tolerance {summary.error_tolerance_m * 1e3:g} mm"
    x, y = summary.tracking_error_rms_m
    timed = summary.judge == TIMED
    # the root mean square is that of the distance from the timed reference
    rms = f", root mean square {in_millimetres(math.hypot(x, y))}" if timed and x is not None and y is not None else ""
    rows.append(
        (
            "error" if timed else "error from the path",
            "not known" if peak is None else f"at most {in_millimetres(peak)}{rms}, {limit}",
        )
    )
    if summary.estimate_error_max_m is not None:
        rows.append(("estimate", f"at most {in_millimetres(summary.estimate_error_max_m)} from the platform"))
    torque = f"at most {_of_both(summary.torque_peak_nm)} Nm of motors 1 and 2"
    if summary.torque_saturated_samples:
        asked = _of_both(summary.torque_requested_peak_nm)
        torque += f"; {summary.torque_saturated_samples} samples asked for more than the limit, up to {asked} Nm"
    rows.append(("torque", torque))
    if (odds := odds_of(summary)) is not None:
        rows.append(("odds", odds))
    if (requested := requested_odds_of(summary)) is not None:
        rows.append(("odds of requested motions", requested))
    rows.append(("faults", ", ".join(summary.faults) or "none"))
    if warnings := _warnings(summary):
        rows.append(("warnings", "; ".join(warnings)))
    return rows


def odds_of(summary: Summary) -> str | None:
    """Return how likely the motion was to succeed, in words; None where its planner has not found that out."""
    if summary.odds is None:
        return None
    # here, because few runs have odds
    from fivebar_bringup.odds.odds import odds_words

    return odds_words(summary.odds["successes"], summary.odds["robots"], *summary.odds["interval_95"])


def requested_odds_of(summary: Summary) -> str | None:
    """Return how likely the requested motions were to succeed, in words; None where that is not known of any."""
    if not summary.requested_odds:
        return None
    from fivebar_bringup.odds.odds import told_odds

    told = [
        f"to {place(*request['goal'])} {told_odds(request['odds'], short=True)}" for request in summary.requested_odds
    ]
    return "; ".join(dict.fromkeys(told))


def _of_both(pair: tuple[float | None, float | None]) -> str:
    return " and ".join("–" if figure is None else f"{figure:.2f}" for figure in pair)


def _warnings(summary: Summary) -> list[str]:
    """Return what else about a run calls for attention."""
    counted = {
        "late": summary.overruns,
        "missing": summary.missing_samples,
        "not recorded": summary.dropped_messages,
        "malformed": summary.stray_messages,
    }
    kinds = {"late": "samples", "missing": "samples", "not recorded": "messages", "malformed": "messages"}
    elbows = [
        f"{ELBOWS_UNKNOWN} at {place(crossing.x, crossing.y)}"
        for crossing in summary.planned_crossings
        if crossing.elbows_pass == UNKNOWN
    ]
    return [
        *(f"{count} {kinds[word]} {word}" for word, count in counted.items() if count),
        *elbows,
        *summary.not_judged,
    ]


def _distance(summary: Summary) -> str:
    text = f"at most {in_millimetres(_judged_peak(summary))} from the {KEPT_TO[summary.judge]}"
    if summary.overruns is not None:
        samples = "sample" if summary.overruns == 1 else "samples"
        text += f", {summary.overruns} {samples} late and {summary.missing_samples} missing"
    return f"{text}, tolerance {summary.error_tolerance_m * 1e3:g} mm"


def _judged_peak(summary: Summary) -> float | None:
    return judged_distance(summary.judge, summary.tracking_error_peak_m, summary.path_error_peak_m)


def mode_changes(assembly: int, working: int | None = None, joined: str = " and") -> str:
    """Return how often a robot has changed its assembly mode and, where that counts, its working mode."""
    text = f"{assembly} {'change' if assembly == 1 else 'changes'} of assembly mode"
    return text if working is None else f"{text}{joined} {working} of working mode"


def _changes(summary: Summary) -> str:
    return mode_changes(summary.assembly_mode_changes, summary.working_mode_changes or None, ",")
