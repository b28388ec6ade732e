# SPDX-License-Identifier: Apache-2.0
"""The tables of the page, as numbers and as words."""

from __future__ import annotations

from collections.abc import Sequence

from fivebar_bringup.pages.content import Cell, Entry, Line, Table, table
from fivebar_bringup.report.thesis import CARTESIAN
from fivebar_bringup.units import error_of, plain
from fivebar_control.trajectory.time_laws import CRITERION, QUINTIC
from fivebar_studies.reproduce.cases import (
    CTC,
    DEFAULT,
    EPSILONS,
    JOINT,
    MIN_NORM,
    MULTI_MODEL,
    NOMINAL,
    ReproductionCase,
    ReproductionExtent,
    fixed,
)
from fivebar_studies.reproduce.runner import ReproductionResult, Results
from fivebar_studies.reproduce.verdicts import IMU_RATIO

MODE_CHANGES = {"middle": 2, "multiple": 8}
CONSTRAINT_BOUND = {"middle": 2e-5, "multiple": 1e-4}
"""Largest error of the constraint (m) that the two blended controllers may have with default settings."""

TRACKING_BOUND = 2.5e-3
"""Largest distance from the reference (m)."""

TORQUE_BOUND = 1.2
"""Largest torque (Nm)."""

LAWS = (
    (CTC, QUINTIC),
    (MULTI_MODEL, QUINTIC),
    (MULTI_MODEL, CRITERION),
    (JOINT, QUINTIC),
    (CARTESIAN, QUINTIC),
)
"""Controllers that are compared, with their time laws."""

SHORT = (0.3, 0.5, 1.0)
"""Durations (s) of the motions that cross far from half of their way."""


def crossing_cases(extent: ReproductionExtent) -> list[ReproductionCase]:
    """Return the cases of table (a)."""
    cases = _blended(extent)
    for variant in (MIN_NORM, *(fixed(epsilon) for epsilon in EPSILONS)):
        cases += [case._replace(variant=variant) for case in cases if case.variant == DEFAULT]
    cases += printed_law_cases(extent)
    return cases


def printed_law_cases(extent: ReproductionExtent) -> list[ReproductionCase]:
    """Return the cases with the law and the zone as the thesis prints them: least torque, fixed epsilon."""
    return [case for epsilon in EPSILONS for case in extent.grid(CARTESIAN, variant=fixed(epsilon, MIN_NORM))]


def comparison_cases(extent: ReproductionExtent) -> list[ReproductionCase]:
    """Return the cases of table (b) on the thesis' motions."""
    plants = (NOMINAL, *extent.perturbed)
    return [
        case
        for plant in plants
        for controller, time_law in LAWS
        for case in extent.grid(controller, plant=plant, time_law=time_law)
    ]


def far_cases() -> list[ReproductionCase]:
    """Return the cases of table (b) on motions that cross far from half of their way."""
    return [
        ReproductionCase(controller, motion, duration, time_law=time_law)
        for motion in ("early", "late")
        for duration in SHORT
        for controller, time_law in LAWS
    ]


def imu_cases(extent: ReproductionExtent) -> list[ReproductionCase]:
    """Return the cases of table (c)."""
    return extent.grid(CARTESIAN, imu=True)


def within_bounds(result: ReproductionResult) -> bool:
    """Return whether a run of table (a) keeps all bounds."""
    summary = result.summary
    if summary is None or summary.not_completed_because:
        return False
    motion = result.case.motion
    metrics = (result.constraint_error, result.tracking_error, result.requested)
    bounds = (CONSTRAINT_BOUND[motion], TRACKING_BOUND, TORQUE_BOUND)
    return summary.assembly_mode_changes == MODE_CHANGES[motion] and all(
        metric is not None and metric <= bound for metric, bound in zip(metrics, bounds, strict=True)
    )


def crossing_table(extent: ReproductionExtent, results: Results) -> Table:
    """Return table (a)."""
    rows = []
    for case in _blended(extent):
        result = results[case]
        good = within_bounds(result)
        rows.append(
            (
                *_motion_cells(case),
                completed_cell(result),
                Cell(_count(_changes(result)), _changes(result)),
                _bounded(result.constraint_error, CONSTRAINT_BOUND[case.motion], "m"),
                _bounded(result.tracking_error, TRACKING_BOUND, "m"),
                _bounded(result.requested, TORQUE_BOUND, "Nm"),
                Cell("yes" if good else "no", good, good),
            )
        )
    return table(
        "crossings",
        "(a) Every crossing with the default zones and resolution",
        "Bounds: 2 and 8 changes of assembly mode, constraint error 20 µm (middle) and 100 µm (multiple), 2.5 mm from"
        " the reference, 1.2 Nm.",
        (
            "controller",
            "motion",
            "T",
            "completed",
            "mode changes",
            "constraint error",
            "tracking error",
            "torque asked",
            "within bounds",
        ),
        rows,
    )


def variants_table(extent: ReproductionExtent, results: Results) -> Table:
    """Return the runs of table (a) with other zones and resolutions."""
    variants = (DEFAULT, MIN_NORM, *(fixed(epsilon) for epsilon in EPSILONS))
    return _side_by_side(
        "variants",
        "(a) The same with other zones and resolutions",
        "Largest torque requested and largest distance from the reference. min_norm: the resolution with the least"
        " torque (3.35), which leaves friction along tₛ uncompensated. ε: zones of a fixed half width.",
        variants,
        _blended(extent),
        results,
    )


def printed_table(extent: ReproductionExtent, results: Results) -> Table:
    """Return the runs of table (a) with the law and the zone as printed in the thesis."""
    variants = (DEFAULT, *(fixed(epsilon, MIN_NORM) for epsilon in EPSILONS))
    return _side_by_side(
        "printed",
        "(a) The law and the zone as printed: least torque and a fixed half width",
        "Largest torque requested and largest distance from the reference, beside those of the defaults.",
        variants,
        extent.grid(CARTESIAN),
        results,
    )


def _side_by_side(
    name: str, title: str, note: str, variants: Sequence[str], cases: Sequence[ReproductionCase], results: Results
) -> Table:
    rows = (
        (*_motion_cells(case), *(_variant(results[case._replace(variant=variant)]) for variant in variants))
        for case in cases
    )
    return table(name, title, note, ("controller", "motion", "T", *variants), rows)


def _blended(extent: ReproductionExtent) -> list[ReproductionCase]:
    return [case for controller in (JOINT, CARTESIAN) for case in extent.grid(controller)]


def _motion_cells(case: ReproductionCase) -> tuple[Entry, ...]:
    return case.controller, case.motion, Cell(f"{case.duration:g} s", case.duration)


def comparison_overview(extent: ReproductionExtent, results: Results) -> Table:
    """Return table (b) in short: for every law and plant the worst of all runs."""
    rows: list[Line] = []
    for plant in (NOMINAL, *extent.perturbed):
        for controller, time_law in LAWS:
            runs = [results[case] for case in extent.grid(controller, plant=plant, time_law=time_law)]
            done = sum(run.completed for run in runs)
            rows.append(
                (
                    plant,
                    _law(controller, time_law),
                    Cell(f"{done} of {len(runs)}", done, done == len(runs)),
                    *(_worst(runs, name, unit) for name, unit in FIGURES),
                    Cell(str(total := sum(run.saturated or 0 for run in runs)), total, None if total == 0 else False),
                )
            )
    return table(
        "comparison",
        "(b) Controllers beside each other: the worst of all runs",
        "Middle and multiple crossing with every duration. Requested is the law's torque, applied that of the drives"
        " (at most 10 Nm), saturated the number of samples that requested more.",
        (
            "plant",
            "controller",
            "completed",
            "requested",
            "applied",
            "tracking error",
            "constraint error",
            "saturated",
        ),
        rows,
    )


FIGURES = (("requested", "Nm"), ("applied", "Nm"), ("tracking_error", "m"), ("constraint_error", "m"))


def comparison_tables(extent: ReproductionExtent, results: Results) -> list[Table]:
    """Return table (b) run by run, one table per plant."""
    return [
        _run_by_run(
            f"comparison_{number}",
            f"(b) Run by run: {plant}",
            "",
            [
                results[case]
                for controller, time_law in LAWS
                for case in extent.grid(controller, plant=plant, time_law=time_law)
            ],
            folded=True,
        )
        for number, plant in enumerate((NOMINAL, *extent.perturbed))
    ]


def far_table(results: Results) -> Table:
    """Return table (b) on motions that cross far from half of their way."""
    return _run_by_run(
        "far_from_half_way",
        "(b) Crossing far from half of the way",
        "From 0.105 to 0.02 m (early, the locus comes after 24 % of the way) and from 0.15 to 0.07 m (late, 82 %). The"
        " fifth-order polynomial asks for |m tₛᵀẍ| on the locus, which no law can give there; the criterion time law"
        " asks for none.",
        [results[case] for case in far_cases()],
    )


def imu_table(extent: ReproductionExtent, results: Results) -> Table:
    """Return table (c)."""
    rows = []
    for case in imu_cases(extent):
        noisy, perfect = results[case], results[case._replace(imu=False)]
        ratio = noisy.imu_ratio
        rows.append(
            (
                case.motion,
                Cell(f"{case.duration:g} s", case.duration),
                completed_cell(noisy),
                _number(noisy.row.acceleration_outside_zones_m_s2, "m/s²"),
                _number(noisy.row.noise_floor_m_s2, "m/s²"),
                Cell("–" if ratio is None else f"{ratio:.3f}", ratio, ratio is not None and ratio <= IMU_RATIO),
                _number(perfect.row.acceleration_outside_zones_m_s2, "m/s²"),
            )
        )
    return table(
        "imu",
        "(c) Acceleration check with the simulated IMU",
        "multi_cartesian; noise 0.05 m/s² per axis, bias, 100 Hz bandwidth, mounted 17 mm off and turned (scenario"
        " imu_middle). The error counts outside the blending zones; the noise floor is the error by noise alone on"
        " the same samples; allowed is 1.2 times as much. The last column is the same motion with a perfect IMU:"
        " the remaining error is true motion of the platform, the computed torque law converging after a crossing.",
        ("motion", "T", "completed", "error", "noise floor", "ratio", "perfect IMU"),
        rows,
    )


def _run_by_run(name: str, title: str, note: str, runs: Sequence[ReproductionResult], folded: bool = False) -> Table:
    rows = []
    for run in runs:
        case = run.case
        rows.append(
            (
                _law(case.controller, case.time_law),
                case.motion,
                Cell(f"{case.duration:g} s", case.duration),
                completed_cell(run),
                _number(run.row.crossing_residual_n, "N"),
                _number(run.requested, "Nm"),
                _number(run.applied, "Nm"),
                Cell(_count(run.saturated), run.saturated, None if not run.saturated else False),
                _number(run.tracking_error, "m"),
                _number(run.constraint_error, "m"),
            )
        )
    return table(
        name,
        title,
        note,
        (
            "controller",
            "motion",
            "T",
            "completed",
            "|m tₛᵀẍ|",
            "requested",
            "applied",
            "saturated",
            "tracking error",
            "constraint error",
        ),
        rows,
        folded,
    )


def completed_cell(result: ReproductionResult) -> Cell:
    """Return whether a run was completed, or why not."""
    if result.completed:
        return Cell("yes", "yes", True)
    return Cell(f"no: {result.why_not}", f"no: {result.why_not}", False)


def _law(controller: str, time_law: str) -> str:
    return f"{controller} ({time_law})" if controller == MULTI_MODEL else controller


def _changes(result: ReproductionResult) -> int | None:
    return None if result.summary is None else result.summary.assembly_mode_changes


def _count(value: int | None) -> str:
    return "–" if value is None else str(value)


def _number(value: float | None, unit: str) -> Cell:
    text = plain(value, unit) if unit in ("Nm", "m/s²", "N") else error_of(value, unit)
    if unit == "N" and value is not None and value < 1e-9:
        text = "0 N"
    return Cell(text, value)


def _bounded(value: float | None, bound: float, unit: str) -> Cell:
    return _number(value, unit)._replace(good=value is not None and value <= bound)


def _worst(runs: Sequence[ReproductionResult], name: str, unit: str) -> Cell:
    known = [value for run in runs if (value := getattr(run, name)) is not None]
    return _number(max(known, default=None), unit)


def _variant(result: ReproductionResult) -> Cell:
    values = f"{plain(result.requested, 'Nm')}, {error_of(result.tracking_error, 'm')}"
    content = {
        "completed": result.completed,
        "requested": result.requested,
        "tracking_error": result.tracking_error,
        "why_not": result.why_not,
    }
    return Cell(values if result.completed else f"lost: {values}", content, None if result.completed else False)
