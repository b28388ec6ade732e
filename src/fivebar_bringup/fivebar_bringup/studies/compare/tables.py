"""The tables of a comparison."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

from fivebar_bringup.pages.content import Cell, Entry, Table, table
from fivebar_bringup.recorded.outcome import RunOutcome
from fivebar_bringup.studies.compare.cases import AS_GIVEN, ComparisonExtent, on_rig
from fivebar_bringup.studies.compare.results import ComparisonResult
from fivebar_bringup.studies.compare.verdicts import lost, tight_words
from fivebar_bringup.studies.reproduce.rows import largest
from fivebar_bringup.studies.rigs.named import find_rig
from fivebar_bringup.units import error_of, plain
from fivebar_control.laws.gains import Gains

METRICS = (
    "error",
    "error rms",
    "error in zones",
    "applied",
    "requested",
    "saturated",
    "margin",
    "energy",
)
"""Columns with the metrics of a run."""


def rigs_table(extent: ComparisonExtent) -> Table:
    """Return the description and the gains of each rig."""
    rows = []
    for given in extent.given:
        for rig in extent.rigs_of(given):
            content = on_rig(given, rig, given.controller)
            gains, unified = Gains(**content["gains"]), {name: content["unified"][name] for name in ("kp", "kd")}
            described = "plant, estimator and gains as the scenario gives them"
            if rig != AS_GIVEN:
                described = find_rig(rig).described
            words = f"{gains.kp:g}, {gains.kd:g}; on the locus {gains.kp_vhc:g}, {gains.kd_vhc:g}"
            of_unified = Cell(f"{unified['kp']:g}, {unified['kd']:g}", unified)
            rows.append((given.name, rig, described, Cell(words, gains._asdict()), of_unified))
    return table(
        "rigs",
        "Rigs and gains",
        "Gains kp in 1/s² and kd in 1/s: of ctc, multi_model_ctc and the blended controllers, and of unified. Where a"
        " rig has no gains of its own, they are those of the scenario.",
        ("motion", "rig", "what it is", "kp, kd", "unified: kp, kd"),
        rows,
    )


def overview_table(results: Sequence[ComparisonResult]) -> Table:
    """Return the worst metrics of each controller on each rig, over all motions and durations."""
    rows = []
    keys = list(dict.fromkeys((result.case.rig, result.case.controller) for result in results))
    for rig, controller in keys:
        runs = [result for result in results if (result.case.rig, result.case.controller) == (rig, controller)]
        made = [run for run in runs if run.made]
        done = sum(run.outcome is RunOutcome.SUCCEEDED for run in runs)
        refused = sum(bool(run.objections) for run in made)
        margins = [-run.margin for run in made if run.margin is not None]
        least = None if not margins else -max(margins)
        saturated = sum(run.saturated or 0 for run in made)
        rows.append(
            (
                rig,
                controller,
                Cell(f"{done} of {len(runs)}", done, done == len(runs)),
                _length(largest([run.tracking_error for run in made])),
                _length(largest([run.tracking_rms for run in made])),
                _length(largest([run.constraint_error for run in made])),
                _torque(largest([run.applied for run in made])),
                _torque(largest([run.requested for run in made])),
                Cell(str(saturated), saturated, False if saturated else None),
                _torque(least),
                _energy(largest([run.energy for run in made])),
                Cell(f"{refused} of {len(made)}", refused),
            )
        )
    return table(
        "overview",
        "The worst of each controller on each rig",
        "Over all motions and durations: runs that succeeded; largest distance from the reference, its root mean"
        " square, and distance from the path in the blending zones; torque applied and requested; samples that"
        " requested more than the drives give, in all; least margin to the torque limit; mechanical energy,"
        " ∫|τᵢ q̇ᵢ₁| dt of both motors; motions that the planner's screen would refuse.",
        ("rig", "controller", "succeeded", *METRICS, "refused by the screen"),
        rows,
    )


def run_tables(results: Sequence[ComparisonResult]) -> list[Table]:
    """Return one table per rig and motion, run by run; results of one table stand together."""
    return [
        table(f"{motion}_{rig}", f"{motion} on the rig {rig}", "", _RUN_COLUMNS, map(_run, runs), True)
        for (motion, rig), runs in groupby(results, key=lambda result: (result.case.motion, result.case.rig))
    ]


def tight_table(results: Sequence[ComparisonResult]) -> Table:
    """Return the runs under the tight torque limit."""
    rows = []
    for result in results:
        case, said = result.case, result.objections
        rows.append(
            (
                case.motion,
                case.rig,
                case.controller,
                Cell(_pace(result), case.duration),
                Cell("–" if not result.made else "refused" if said else "allowed", not said if result.made else None),
                _outcome(result),
                _length(result.tracking_error)._replace(good=False if lost(result) else None),
                _torque(result.requested),
                Cell(_count(result.at_limit), result.at_limit),
                "; ".join(said),
            )
        )
    return table(
        "tight",
        f"With {tight_words(results)} per motor",
        "Run at the requested pace, whether or not the screen allows it, to see the effect of the limit alone; and at"
        " the quickest pace that the screen allows, found segment by segment. The screen allows the reference 85 % of"
        " the limit. unified respects the limit and requests no more. The column before the last counts the samples"
        " with a motor at its limit.",
        ("motion", "rig", "controller", "T", "screen", "outcome", "error", "requested", "at the limit", "why"),
        rows,
    )


_RUN_COLUMNS = ("controller", "T", "outcome", *METRICS, "screen")


def _run(result: ComparisonResult) -> tuple[Entry, ...]:
    case = result.case
    margin = _torque(result.margin)
    if result.margin_share is not None:
        margin = margin._replace(text=f"{margin.text} ({result.margin_share:.0%})")
    said = "; ".join(result.objections)
    return (
        case.controller,
        Cell(case.pace, case.duration),
        _outcome(result),
        _length(result.tracking_error),
        _length(result.tracking_rms),
        _length(result.constraint_error),
        _torque(result.applied),
        _torque(result.requested),
        Cell(_count(result.saturated), result.saturated, False if result.saturated else None),
        margin,
        _energy(result.energy),
        Cell("–" if not result.made else f"refused: {said}" if said else "allowed", said),
    )


def _pace(result: ComparisonResult) -> str:
    if result.case.duration is not None or not result.durations:
        return result.case.pace
    low, high = min(result.durations), max(result.durations)
    return f"quickest: {low:.2f}–{high:.2f} s"


def _outcome(result: ComparisonResult) -> Cell:
    text = ": ".join(one for one in (result.outcome.value, "; ".join(result.why_not)) if one)
    return Cell(text, text, result.outcome is RunOutcome.SUCCEEDED)


def _count(value: int | None) -> str:
    return "–" if value is None else str(value)


def _length(value: float | None) -> Cell:
    return Cell(error_of(value, "m"), value)


def _torque(value: float | None) -> Cell:
    return Cell(plain(value, "Nm"), value)


def _energy(value: float | None) -> Cell:
    return Cell(plain(value, "J"), value)
