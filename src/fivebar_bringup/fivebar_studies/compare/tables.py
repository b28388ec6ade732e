# SPDX-License-Identifier: Apache-2.0
"""The tables of a comparison."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

from fivebar_bringup.pages.content import Cell, Entry, Table, table
from fivebar_bringup.recorded.outcome import RunOutcome
from fivebar_bringup.units import error_of, plain
from fivebar_control.laws.gains import Gains
from fivebar_studies.compare.cases import AS_GIVEN, ComparisonExtent, on_rig
from fivebar_studies.compare.results import ComparedRun, ComparisonRow
from fivebar_studies.compare.verdicts import lost, tight_words
from fivebar_studies.reproduce.measured import largest
from fivebar_studies.rigs.named import find_rig

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
    for scenario in extent.scenarios:
        for rig in extent.rigs_of(scenario):
            content = on_rig(scenario, rig, scenario.controller)
            gains, unified = Gains(**content["gains"]), {name: content["unified"][name] for name in ("kp", "kd")}
            described = "plant, estimator and gains as the scenario gives them"
            if rig != AS_GIVEN:
                described = find_rig(rig).described
            words = f"{gains.kp:g}, {gains.kd:g}; on the locus {gains.kp_vhc:g}, {gains.kd_vhc:g}"
            of_unified = Cell(f"{unified['kp']:g}, {unified['kd']:g}", unified)
            rows.append((scenario.name, rig, described, Cell(words, gains._asdict()), of_unified))
    return table(
        "rigs",
        "Rigs and gains",
        "Gains kp in 1/s² and kd in 1/s: of ctc, multi_model_ctc and the blended controllers, and of unified. Where a"
        " rig has no gains of its own, they are those of the scenario.",
        ("motion", "rig", "what it is", "kp, kd", "unified: kp, kd"),
        rows,
    )


def overview_table(results: Sequence[ComparedRun]) -> Table:
    """Return the worst metrics of each controller on each rig, over all motions and durations."""
    rows = []
    keys = dict.fromkeys((result.row.rig, result.row.controller) for result in results)
    for rig, controller in keys:
        runs = [run.row for run in results if (run.row.rig, run.row.controller) == (rig, controller)]
        tried = [run for run in runs if run.made]
        done = sum(run.outcome == RunOutcome.SUCCEEDED for run in runs)
        objected = sum(bool(run.screen_says) for run in tried)
        refused, stuck = (
            [run for run in runs if run.outcome == outcome]
            for outcome in (RunOutcome.REFUSED, RunOutcome.COULD_NOT_RUN)
        )
        margins = [-run.margin_nm for run in tried if run.margin_nm is not None]
        least = None if not margins else -max(margins)
        saturated = sum(run.torque_saturated_samples or 0 for run in tried)
        rows.append(
            (
                rig,
                controller,
                Cell(f"{done} of {len(tried)}" if tried else "–", done, done == len(tried) if tried else None),
                Cell(str(len(refused)), len(refused)),
                Cell(str(len(stuck)), len(stuck), False if stuck else None),
                _length(largest([run.tracking_error_peak_m for run in tried])),
                _length(largest([run.tracking_error_rms_m for run in tried])),
                _length(largest([run.vhc_error_max_m for run in tried])),
                _torque(largest([run.torque_peak_nm for run in tried])),
                _torque(largest([run.torque_requested_peak_nm for run in tried])),
                Cell(str(saturated), saturated, False if saturated else None),
                _torque(least),
                _energy(largest([run.energy_j for run in tried])),
                Cell(f"{objected} of {len(tried)}", objected),
                "; ".join(dict.fromkeys(run.why_not for run in (*stuck, *refused))),
            )
        )
    return table(
        "overview",
        "The worst of each controller on each rig",
        "Over all motions and durations: runs that succeeded, of those that were made; motions that planner or"
        " estimator refused, and that could not run with this controller; largest distance from the reference, its root"
        " mean square, and distance from the path in the blending zones; torque applied and requested; samples that"
        " requested more than the drives give, in all; least margin to the torque limit; mechanical energy,"
        " ∫|τᵢ q̇ᵢ₁| dt of both motors; motions that the planner's screen would refuse.",
        ("rig", "controller", "succeeded", "refused", "could not run", *METRICS, "refused by the screen", "why not"),
        rows,
    )


def run_tables(results: Sequence[ComparedRun]) -> list[Table]:
    """Return one table per rig and motion, run by run; results of one table stand together."""
    return [
        table(f"{motion}_{rig}", f"{motion} on the rig {rig}", "", _RUN_COLUMNS, map(_run, runs), True)
        for (motion, rig), runs in groupby(results, key=lambda result: (result.case.motion, result.case.rig))
    ]


def tight_table(results: Sequence[ComparedRun]) -> Table:
    """Return the runs under the tight torque limit."""
    rows = []
    for result in results:
        case, row = result.case, result.row
        rows.append(
            (
                case.motion,
                case.rig,
                case.controller,
                Cell(_pace(result), case.duration),
                Cell("–" if not row.made else "refused" if row.screen_says else "allowed", _allowed(row)),
                _outcome(row),
                _length(row.tracking_error_peak_m)._replace(good=False if lost(result) else None),
                _torque(row.torque_requested_peak_nm),
                Cell(_count(row.samples_at_limit), row.samples_at_limit),
                row.screen_says,
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


def _run(result: ComparedRun) -> tuple[Entry, ...]:
    case, row = result.case, result.row
    margin = _torque(row.margin_nm)
    if row.margin_share is not None:
        margin = margin._replace(text=f"{margin.text} ({row.margin_share:.0%})")
    return (
        case.controller,
        Cell(case.pace, case.duration),
        _outcome(row),
        _length(row.tracking_error_peak_m),
        _length(row.tracking_error_rms_m),
        _length(row.vhc_error_max_m),
        _torque(row.torque_peak_nm),
        _torque(row.torque_requested_peak_nm),
        Cell(
            _count(row.torque_saturated_samples),
            row.torque_saturated_samples,
            False if row.torque_saturated_samples else None,
        ),
        margin,
        _energy(row.energy_j),
        Cell("–" if not row.made else f"refused: {row.screen_says}" if row.screen_says else "allowed", row.screen_says),
    )


def _pace(result: ComparedRun) -> str:
    durations = [float(duration) for duration in result.row.segments_s.split()]
    if result.case.duration is not None or not durations:
        return result.case.pace
    low, high = min(durations), max(durations)
    return f"quickest: {low:.2f}–{high:.2f} s"


def _allowed(row: ComparisonRow) -> bool | None:
    return not row.screen_says if row.made else None


def _outcome(row: ComparisonRow) -> Cell:
    text = ": ".join(words for words in (row.outcome, row.why_not) if words)
    return Cell(text, text, row.outcome == RunOutcome.SUCCEEDED)


def _count(value: int | None) -> str:
    return "–" if value is None else str(value)


def _length(value: float | None) -> Cell:
    return Cell(error_of(value, "m"), value)


def _torque(value: float | None) -> Cell:
    return Cell(plain(value, "Nm"), value)


def _energy(value: float | None) -> Cell:
    return Cell(plain(value, "J"), value)
