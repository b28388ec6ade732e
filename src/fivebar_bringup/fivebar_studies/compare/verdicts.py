# SPDX-License-Identifier: Apache-2.0
"""Requirements on the unified law, and whether the measured runs meet them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from fivebar_bringup.units import engineering, error_of, plain
from fivebar_studies.compare.cases import TIGHT_LIMIT
from fivebar_studies.compare.results import ComparedRun
from fivebar_studies.reproduce.measured import largest

UNIFIED = "unified"


class Bound(NamedTuple):
    """Largest distance from the reference (m), and largest applied torque (Nm)."""

    error: float
    torque: float


BOUNDS = {"ideal": Bound(0.4e-3, 1.0), "realistic": Bound(0.8e-3, 1.5)}
"""Bounds by rig, for DexTAR; errors of other robots go with their size, torques with theirs. Every run has to be
completed as well."""

IN_PROPORTION = ", of DexTAR, in proportion to size and torque of other robots"


class Requirement(NamedTuple):
    """A requirement, the measured values, and whether it is met; None where the comparison does not cover it."""

    title: str
    expected: str
    measured: str
    met: bool | None


def findings(results: Sequence[ComparedRun], tight: Sequence[ComparedRun]) -> list[Requirement]:
    """Judge the runs of the unified law.

    Args:
        results: of the compared runs.
        tight: of the runs under the tight torque limit.
    """
    return [*(_on_rig(rig, bound, results) for rig, bound in BOUNDS.items()), _under_tight_limit(tight)]


def lost(result: ComparedRun) -> bool:
    """Return whether a run failed, or left the error that its rig is expected to keep."""
    bound = BOUNDS.get(result.case.rig)
    error = result.row.tracking_error_peak_m
    return not result.row.completed or (bound is not None and (error is None or error > bound.error * result.case.size))


def _on_rig(rig: str, bound: Bound, results: Sequence[ComparedRun]) -> Requirement:
    runs = [result for result in results if result.case.controller == UNIFIED and result.case.rig == rig]
    title = f"{UNIFIED} on the rig {rig}"
    expected = (
        f"all runs completed, at most {engineering(bound.error, 'm')} from the reference,"
        f" at most {plain(bound.torque, 'Nm')}"
    )
    runs_of_others = any(run.case.size != 1.0 or run.case.torque != 1.0 for run in runs)
    if not runs:
        return Requirement(title, expected, "not part of this comparison", None)
    expected += IN_PROPORTION if runs_of_others else ""
    with_run = [run for run in runs if run.row.made]
    if not with_run:
        return Requirement(title, expected, f"nothing ran: {runs[0].row.why_not}", None)
    done = sum(result.row.completed for result in runs)
    error, torque = (
        largest([run.row.tracking_error_peak_m for run in runs]),
        largest([run.row.torque_peak_nm for run in runs]),
    )
    measured = (
        f"{done} of {len(runs)} completed, {error_of(error, 'm')}{_where(runs, error, 'tracking_error_peak_m')},"
        f" {plain(torque, 'Nm')}{_where(runs, torque, 'torque_peak_nm')}"
    )
    met = done == len(runs) and all(_within(run, bound) for run in runs)
    return Requirement(title, expected, measured, met)


def _within(run: ComparedRun, bound: Bound) -> bool:
    error, torque = run.row.tracking_error_peak_m, run.row.torque_peak_nm
    kept = error is not None and error <= bound.error * run.case.size
    return kept and torque is not None and torque <= bound.torque * run.case.torque


def _under_tight_limit(tight: Sequence[ComparedRun]) -> Requirement:
    runs = [result for result in tight if result.case.controller == UNIFIED]
    asked = [run for run in runs if run.case.duration is not None]
    quickest = [run for run in runs if run.case.duration is None]
    title = f"{UNIFIED} with {tight_words(runs)} per motor"
    expected = (
        "every motion that is lost under the limit (not completed, or with an error above that of the rig) is refused"
        " by the planner's screen; slowed down to the quickest pace that the screen allows, every motion is completed"
        " within the error of its rig"
    )
    if not asked or not quickest:
        return Requirement(title, expected, "not part of this comparison", None)
    if not any(run.row.made for run in runs):
        return Requirement(title, expected, f"nothing ran: {runs[0].row.why_not}", None)
    refused = [run for run in asked if run.row.screen_says or not run.row.made]
    unsaved = [run for run in asked if lost(run)]
    missed = [run for run in unsaved if run not in refused]
    slowed_lost = [run for run in quickest if lost(run)]
    failed = (
        f"{len(unsaved)} of {len(asked)} motions failed at the requested pace ({_paces(unsaved)}), of which the screen"
        f" would have refused {len(unsaved) - len(missed)}"
        if unsaved
        else f"all {len(asked)} motions succeeded at the requested pace"
    )
    measured = (
        f"{failed}; the screen would have refused {len(refused)} in all. At the quickest pace that the screen allows"
        f" {len(quickest) - len(slowed_lost)} of {len(quickest)} succeeded, with an error of at most"
        f" {error_of(largest([run.row.tracking_error_peak_m for run in quickest]), 'm')}"
    )
    return Requirement(title, expected, measured, not missed and not slowed_lost)


def tight_words(runs: Sequence[ComparedRun]) -> str:
    """Return the tight torque limits of runs with their unit, one for each robot; without runs that of DexTAR."""
    limits = {run.case.torque_limit for run in runs if run.case.torque_limit is not None} or {TIGHT_LIMIT}
    return " and ".join(f"{limit:.3g}" for limit in sorted(limits)) + " Nm"


def _where(runs: Sequence[ComparedRun], value: float | None, figure: str) -> str:
    """Return in which run a figure has a value, in brackets; nothing where it is not known."""
    runs_there = [run for run in runs if value is not None and getattr(run.row, figure) == value]
    return f" ({_paces(runs_there[:1])})" if runs_there else ""


def _paces(runs: Sequence[ComparedRun]) -> str:
    return ", ".join(f"{run.case.motion} {run.case.pace}" for run in runs) or "none"
