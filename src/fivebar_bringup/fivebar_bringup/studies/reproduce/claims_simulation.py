"""Claims of section 4.2: both lists of candidate controllers on the middle and the multiple crossing."""

from __future__ import annotations

from fivebar_bringup.pages.content import Picture
from fivebar_bringup.report.thesis import CARTESIAN
from fivebar_bringup.studies.reproduce.cases import (
    DELAY,
    JOINT,
    NOMINAL,
    PERTURBED,
    SHOWN,
    ReproductionCase,
    ReproductionExtent,
)
from fivebar_bringup.studies.reproduce.joint_law import OBLIQUE, shares_as_printed
from fivebar_bringup.studies.reproduce.own_figures import draw_pairs
from fivebar_bringup.studies.reproduce.rows import Claim, ClaimRow, by_duration, largest, of, runs_of, torque_row
from fivebar_bringup.studies.reproduce.runner import Results
from fivebar_bringup.studies.reproduce.tables import MODE_CHANGES
from fivebar_bringup.studies.reproduce.verdicts import (
    PairedRuns,
    counted,
    more_accurate,
    order_of_magnitude,
    shown_necessary,
    shown_unnecessary,
)
from fivebar_bringup.units import error_of

UNKNOWN_DURATION = (
    "Durations and gains are not in the text; the verdict is on the worst of"
    " {durations} s per segment, the figure shows {shown:g} s."
)

LONGEST_MULTIPLE = 1.0
"""Longest segments (s) of the multiple crossing for which the adaptive gain is tried on and off: slower is easier."""


def _remark(extent: ReproductionExtent, more: str = "") -> str:
    durations = ", ".join(f"{duration:g}" for duration in extent.durations)
    return f"{UNKNOWN_DURATION.format(durations=durations, shown=SHOWN)} {more}".strip()


def _shown(controller: str, motion: str) -> ReproductionCase:
    return ReproductionCase(controller, motion, SHOWN)


def _path(number: str, motion: str, description: str) -> Claim:
    def needs(extent: ReproductionExtent) -> dict[ReproductionCase, tuple[str, ...]]:
        cases = [case for controller in (JOINT, CARTESIAN) for case in extent.grid(controller, (motion,))]
        return of(cases, _shown(CARTESIAN, motion), ("path",))

    def make(extent: ReproductionExtent, results: Results) -> ClaimRow:
        runs = runs_of(list(needs(extent)), results)
        planned = MODE_CHANGES[motion]
        changes = [run.summary.assembly_mode_changes if run.summary else 0 for run in runs]
        crossings = _shown(CARTESIAN, motion).scenario().plan().crossings
        places = dict.fromkeys(f"({crossing.x * 1e3:.1f}, {crossing.y * 1e3:.1f})" for crossing in crossings)
        return ClaimRow(
            f"Figure {number}",
            f"Path of the {motion} crossing",
            description,
            f"{', '.join(map(str, sorted(set(changes))))} changes of assembly mode in {len(runs)} runs of both"
            f" controllers; the locus is met at {', '.join(places)} mm",
            {"mode_changes": changes, "crossings_mm": list(places)},
            counted(changes, planned, "changes of assembly mode"),
            _remark(extent),
            [results[_shown(CARTESIAN, motion)].picture("path", f"Path of the {motion} crossing.")],
        )

    return Claim(number, needs, make)


def _torque(number: str, controller: str, motion: str, statement: str) -> Claim:
    def needs(extent: ReproductionExtent) -> dict[ReproductionCase, tuple[str, ...]]:
        return of(extent.grid(controller, (motion,)), _shown(controller, motion), ("torques",))

    def make(extent: ReproductionExtent, results: Results) -> ClaimRow:
        runs = runs_of(extent.grid(controller, (motion,)), results)
        return torque_row(
            f"Figure {number}",
            f"Torques of {controller}, {motion} crossing",
            statement,
            runs,
            _remark(extent),
            results[_shown(controller, motion)].picture("torques", "Motor torques."),
        )

    return Claim(number, needs, make)


def _constraint(number: str, controller: str, motion: str, reported: float, statement: str) -> Claim:
    joint = controller == JOINT
    name, unit = ("constraint_error_joint", "rad") if joint else ("constraint_error", "m")

    def needs(extent: ReproductionExtent) -> dict[ReproductionCase, tuple[str, ...]]:
        return of(extent.grid(controller, (motion,)), _shown(controller, motion), ("vhc_error",))

    def make(extent: ReproductionExtent, results: Results) -> ClaimRow:
        runs = runs_of(extent.grid(controller, (motion,)), results)
        errors = by_duration(runs, name)
        distance = largest([run.constraint_error for run in runs])
        more = (
            f"The unit of the error is not given; in rad it is the larger figure, as a distance it is"
            f" {error_of(distance, 'm')}."
            if joint
            else ""
        )
        return ClaimRow(
            f"Figure {number}",
            f"Error of the virtual constraint of {controller}, {motion} crossing",
            statement,
            f"{error_of(largest(list(errors.values())), unit)} at most: "
            + ", ".join(f"{error_of(error, unit)} at {duration}" for duration, error in errors.items()),
            {f"constraint_error_max_{unit}": errors, "constraint_error_max_m": distance},
            order_of_magnitude(largest(list(errors.values())), reported, unit),
            _remark(extent, more),
            [results[_shown(controller, motion)].picture("vhc_error", "Error of the virtual constraint.")],
        )

    return Claim(number, needs, make)


def _supervisor() -> Claim:
    def needs(extent: ReproductionExtent) -> dict[ReproductionCase, tuple[str, ...]]:
        cases = [case for controller in (JOINT, CARTESIAN) for case in extent.grid(controller)]
        return of(cases, _shown(CARTESIAN, "multiple"), ("supervisor",))

    def make(extent: ReproductionExtent, results: Results) -> ClaimRow:
        runs = runs_of(list(needs(extent)), results)
        excess = [(run.zones or 0) - MODE_CHANGES[run.case.motion] for run in runs]
        sigmas = [run.summary.sigma_max if run.summary else None for run in runs]
        whole = sum(sigma == 1.0 for sigma in sigmas)
        rest = largest([run.sigma_at_rest for run in runs])
        both = [
            extra if sigma == 1.0 and run.sigma_at_rest == 0.0 else -1
            for extra, sigma, run in zip(excess, sigmas, runs, strict=True)
        ]
        return ClaimRow(
            "Section 4.1.2",
            "The supervisor switches by the condition of A",
            "σ is 0 far from the locus and 1 on it, and the block works for switching (sections 4.1.2, 4.2)",
            f"one blending zone per crossing in {sum(extra == 0 for extra in excess)} of {len(runs)} runs; σ reaches 1"
            f" in {whole} of them and is {rest} at rest",
            {"zones_beyond_crossings": excess, "sigma_max": sigmas, "sigma_at_rest_max": rest},
            counted(both, 0, "zones beyond its crossings, with σ = 1 in them and 0 at rest"),
            "The printed table of 4.1.2 has its ends exchanged against its own sentence; the sentence is what is used."
            " Each crossing has a zone of its own width, so that σ = 1 lasts 40 ms.",
            [results[_shown(CARTESIAN, "multiple")].picture("supervisor", "Weight σ and what it follows from.")],
        )

    return Claim("4.1.2", needs, make)


def _plants(extent: ReproductionExtent) -> tuple[str, ...]:
    return (NOMINAL, *(plant for plant in PERTURBED if plant in extent.perturbed), DELAY)


def _tried(extent: ReproductionExtent, controller: str) -> list[ReproductionCase]:
    """Return a controller's cases on all plants; of the multiple crossing only those that do not take long."""
    cases = [case for plant in _plants(extent) for case in extent.grid(controller, plant=plant)]
    return [case for case in cases if case.motion == "middle" or case.duration <= LONGEST_MULTIPLE]


def _adaptive_gain_joint() -> Claim:
    def with_it(extent: ReproductionExtent) -> list[ReproductionCase]:
        return _tried(extent, JOINT)

    def needs(extent: ReproductionExtent) -> dict[ReproductionCase, tuple[str, ...]]:
        cases = with_it(extent)
        return of([*cases, *(case._replace(adaptive_gain=False) for case in cases)])

    def make(extent: ReproductionExtent, results: Results) -> ClaimRow:
        pairs = []
        for case in with_it(extent):
            first, second = results[case], results[case._replace(adaptive_gain=False)]
            pairs.append(
                PairedRuns(
                    f"{case.motion}, {case.duration:g} s, {case.plant}",
                    first.completed,
                    second.completed,
                    first.constraint_error_joint,
                    second.constraint_error_joint,
                )
            )
        worst_with = largest([pair.error_with for pair in pairs])
        worst_without = largest([pair.error_without for pair in pairs])
        judgement = shown_necessary(pairs)
        return ClaimRow(
            "Section 4.2, first list",
            "The joint-space law needs the adaptive gain",
            "the adaptive gain was necessary for the first list, because the model of the joint-space law is less"
            " accurate (section 4.2, before figure 4.6)",
            f"{sum(pair.completed_without for pair in pairs)} of {len(pairs)} runs completed without it,"
            f" {sum(pair.completed_with for pair in pairs)} with it; worst constraint error"
            f" {error_of(worst_without, 'rad')} without and {error_of(worst_with, 'rad')} with",
            {
                "runs": len(pairs),
                "completed_with": sum(pair.completed_with for pair in pairs),
                "completed_without": sum(pair.completed_without for pair in pairs),
                "error_max_with_rad": worst_with,
                "error_max_without_rad": worst_without,
                "pairs": [pair._asdict() for pair in pairs],
            },
            judgement,
            f"Tried on these plants: {', '.join(_plants(extent))}; the multiple crossing with segments of up to"
            f" {LONGEST_MULTIPLE:g} s. The law here has the terms that 3.14 and 3.18 lose in print (the velocity along"
            " the path while crossing), so it is exact on the locus where the constraint holds, and the simulated robot"
            " has no elasticity, play or drive dynamics; what made the adaptive gain necessary on the real robot may"
            " lie in either.",
            [Picture("adaptive_gain", "Every run with the adaptive gain and without it.", draw_pairs(pairs))],
        )

    return Claim("adaptive gain, joint", needs, make)


def _adaptive_gain_cartesian() -> Claim:
    def cases(extent: ReproductionExtent) -> list[ReproductionCase]:
        return _tried(extent, CARTESIAN)

    def make(extent: ReproductionExtent, results: Results) -> ClaimRow:
        runs = runs_of(cases(extent), results)
        errors = {
            motion: largest([run.constraint_error for run in runs if run.case.motion == motion])
            for motion in MODE_CHANGES
        }
        return ClaimRow(
            "Section 4.2, second list",
            "The Cartesian law needs no adaptive gain",
            "the adaptive gain was not necessary for the second list; errors of order 10⁻⁴ m (middle) and 10⁻³ m"
            " (multiple) without it (section 4.2)",
            f"{sum(run.completed for run in runs)} of {len(runs)} runs completed without it; constraint error"
            f" {error_of(errors['middle'], 'm')} (middle) and {error_of(errors['multiple'], 'm')} (multiple)",
            {
                "runs": len(runs),
                "completed": sum(run.completed for run in runs),
                "constraint_error_max_m": errors,
            },
            shown_unnecessary([run.completed for run in runs], list(errors.values()), 1e-4, "m"),
            "On the same plants as above; the smaller of the two orders is asked of both motions.",
        )

    return Claim("adaptive gain, cartesian", lambda extent: of(cases(extent)), make)


def _accuracy() -> Claim:
    def pairs(extent: ReproductionExtent) -> list[tuple[ReproductionCase, ReproductionCase]]:
        return [(case._replace(controller=JOINT, adaptive_gain=False), case) for case in _tried(extent, CARTESIAN)]

    def make(extent: ReproductionExtent, results: Results) -> ClaimRow:
        errors = [(results[one].constraint_error, results[other].constraint_error) for one, other in pairs(extent)]
        ratios = [joint / cartesian for joint, cartesian in errors if joint is not None and cartesian]
        motions = {(case.motion, case.duration): case for case, _ in pairs(extent)}
        own = [share for case in motions.values() for share in shares_as_printed(case.scenario())]
        oblique = shares_as_printed(OBLIQUE)
        return ClaimRow(
            "Sections 2.4, 4.3",
            "The Cartesian law is more accurate than the joint-space law",
            "the Cartesian form is mathematically more consistent, its model more accurate (sections 3.2, 4.2, 4.3)",
            f"as printed the joint-space law holds these motions with {min(own):.2f} to {max(own):.2f} of its gain, and"
            f" an oblique crossing that the planner accepts with {min(oblique):.2f}; as corrected, without adaptive"
            f" gain, its constraint error is {min(ratios):.2f} to {max(ratios):.2f} times the Cartesian one's over"
            f" {len(ratios)} runs",
            {"ratios": ratios, "stiffness_as_printed": own, "stiffness_as_printed_oblique": oblique},
            more_accurate(ratios, [*own, *oblique]),
            "The statement holds for the law as printed: its gains act on the motors' angles, and the angles that"
            " belong to a distance from the path change along it (docs/theory.md, section 12). Simulated with the exact"
            " model on that oblique crossing, it left the path by 1.19 mm and the Cartesian law by 0.27 mm. Here the"
            " gains act on the distance: it left the path by 0.27 mm, too, and both laws ask for the same torque to"
            " first order. It remains the longer computation.",
        )

    return Claim("accuracy", lambda extent: of([case for pair in pairs(extent) for case in pair]), make)


CLAIMS = (
    _supervisor(),
    _path(
        "4.5", "middle", "A→B→A along x = 0, from 0.15 to 0.02 m and back, crosses the singularity twice (section 4.2)"
    ),
    _torque(
        "4.6", JOINT, "middle", "the robot crosses with finite torques; the figure's values are not in the text (4.2)"
    ),
    _constraint("4.7", JOINT, "middle", 1e-4, "almost zero, of order 10⁻⁴ (section 4.2)"),
    _adaptive_gain_joint(),
    _torque("4.8", CARTESIAN, "middle", "the robot crosses with finite torques (section 4.2)"),
    _constraint("4.9", CARTESIAN, "middle", 1e-4, "almost zero, of order 10⁻⁴ m (section 4.2)"),
    _adaptive_gain_cartesian(),
    _accuracy(),
    _path("4.10", "multiple", "A→B→A→B→A→C→D→A→E→F→A, crossings also away from x = 0 (section 4.2)"),
    _torque("4.11", CARTESIAN, "multiple", "the robot crosses with finite torques (section 4.2)"),
    _constraint("4.12", CARTESIAN, "multiple", 1e-3, "of order 10⁻³ m (section 4.2)"),
)
