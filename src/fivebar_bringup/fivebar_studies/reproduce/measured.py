# SPDX-License-Identifier: Apache-2.0
"""The quantities of the claims: what the runs of each come to in words and numbers, and the verdict by its rule."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np

from fivebar_bringup.pages.content import Picture
from fivebar_bringup.report.thesis import CARTESIAN
from fivebar_bringup.units import engineering, error_of, plain
from fivebar_control.trajectory.time_laws import CRITERION, QUINTIC
from fivebar_description.camera import CameraSettings
from fivebar_description.optional import CAMERA_ACCURACY, CAMERA_ON, optional_part
from fivebar_description.robot_file import load_robot
from fivebar_studies.reproduce.cases import (
    CTC,
    DEFAULT,
    DELAY,
    EPSILONS,
    JOINT,
    MIN_NORM,
    MULTI_MODEL,
    NOMINAL,
    PERTURBED,
    SHOWN,
    ReproductionCase,
    ReproductionExtent,
    fixed,
)
from fivebar_studies.reproduce.cosimulation import THESIS_ERROR, CoSimulation, co_simulate, draw_cosimulation
from fivebar_studies.reproduce.free_dynamics import free_dynamics, rotated
from fivebar_studies.reproduce.joint_law import OBLIQUE, shares_as_printed
from fivebar_studies.reproduce.own_figures import PointGroup, draw_free_dynamics, draw_pairs, draw_peaks, draw_residuals
from fivebar_studies.reproduce.runner import ReproductionResult, Results
from fivebar_studies.reproduce.tables import LAWS, MODE_CHANGES
from fivebar_studies.reproduce.verdicts import (
    FINITE_TORQUE,
    Judgement,
    PairedRuns,
    as_printed,
    counted,
    finite_torque,
    more_accurate,
    near_noise,
    only_one_side_finite,
    order_of_magnitude,
    quartiles,
    shown_necessary,
    shown_unnecessary,
    some_fail,
    some_not_across,
    some_setting_works,
    undecided,
    vanishing,
    within,
)

Law = tuple[str, str]
"""A controller and a time law."""


class ClaimRuns(NamedTuple):
    """The runs of a claim.

    Attributes:
        extent: how much is run.
        results: of all runs by their case.
        runs: those of the claim.
        shown: the one of which there are figures; None for none.
    """

    extent: ReproductionExtent
    results: Results
    runs: Sequence[ReproductionResult]
    shown: ReproductionResult | None = None

    def picture(self, name: str, caption: str) -> Picture:
        """Return a figure of the run that is shown."""
        assert self.shown is not None, "a claim with figures names their run"
        return self.shown.picture(name, caption)

    @property
    def completed(self) -> int:
        """How many runs were completed."""
        return sum(run.completed for run in self.runs)

    def largest(self, name: str) -> float | None:
        """Return the largest value of a metric, such as `requested` or `row.zones`; None where one is not known."""
        return largest([attrgetter(name)(run) for run in self.runs])

    def by_duration(self, name: str) -> dict[str, float | None]:
        """Return a metric of runs that differ only in the duration."""
        return {f"{run.case.duration:g} s": attrgetter(name)(run) for run in self.runs}

    def by_law(self) -> dict[Law, list[ReproductionResult]]:
        """Return the runs by controller and time law."""
        by_law: dict[Law, list[ReproductionResult]] = {}
        for run in self.runs:
            by_law.setdefault((run.case.controller, run.case.time_law), []).append(run)
        return by_law


class Measured(NamedTuple):
    """The result of a claim.

    Attributes:
        words: what was found.
        numbers: the values behind it.
        judgement: verdict, rule and reason.
        remark: context for the reader.
        pictures: figures of this reproduction.
    """

    words: str
    numbers: Mapping[str, Any]
    judgement: Judgement
    remark: str = ""
    pictures: Sequence[Picture] = ()


def largest(values: Sequence[float | None]) -> float | None:
    """Return the largest value; None where one is missing, which may be the largest."""
    known = [value for value in values if value is not None]
    return max(known, default=None) if len(known) == len(values) else None


ROUNDING = 1e-9
"""Part of the largest force that the free dynamics may leave along t_s by rounding."""

RESIDUAL = -1e-4
"""kg m^2. A uniform distal link of 75 g, whose mass the grouped parameters put on both its ends, has that much less
inertia than they say (m l^2 / 6)."""

FIG_3_2 = ReproductionCase(motion="fig_3_2", duration=SHOWN)

STEEP = ReproductionCase(MULTI_MODEL, "early", 0.3)

LONGEST_MULTIPLE = 1.0
"""Longest segments (s) of the multiple crossing for which the adaptive gain is tried on and off: slower is easier."""

SLOW_ENOUGH = 1.0
"""Shortest segments (s) on which the acceleration error is judged."""

RIG = "A simulation in the place of the experiment: nothing here was measured on a robot."

STATIC_LIMIT, MOVING_LIMIT = 5e-5, 2e-4
"""Required accuracy of the camera (m): for a robot at rest, and for one that moves."""

SPEED = 0.3
"""Speed of the platform (m/s), for the accuracy in motion: somewhat more than the crossings' 0.24 m/s."""

PICTURES = 24
"""For each accuracy."""

RENDERED = "Rendered pictures of 1280 x 960 px over 400 mm, exposed for 1 ms; nothing was measured with a real camera."

NAMES: dict[Law, str] = {
    (CTC, QUINTIC): "ctc",
    (MULTI_MODEL, QUINTIC): "multi_model_ctc",
    (MULTI_MODEL, CRITERION): "multi_model_ctc, criterion",
    (JOINT, QUINTIC): "multi_joint",
    (CARTESIAN, QUINTIC): "multi_cartesian",
}

THESIS_MOTIONS = ("middle", "multiple")


# the model


@cache
def _cosimulation() -> CoSimulation:
    return co_simulate(load_robot("dextar"))


@cache
def _distributed() -> CoSimulation:
    robot = load_robot("dextar")
    leg1, leg2 = (leg._replace(residual=leg.residual + RESIDUAL) for leg in (robot.leg1, robot.leg2))
    return co_simulate(robot, duration=6.5, rate_hz=50, actual=robot._replace(leg1=leg1, leg2=leg2))


def model_torque(motor: int) -> Measured:
    """Return the difference of the torques of motor 0 or 1 between the closed form and Pinocchio."""
    run = _cosimulation()
    error = float(np.abs(run.difference[:, motor]).max())
    distributed = float(np.abs(_distributed().difference[:, motor]).max())
    caption = "Torque of the closed-form model minus that of Pinocchio along the thesis' motion, friction off."
    return Measured(
        f"{error:.1e} Nm at most between the closed form and Pinocchio over {run.time[-1]:g} s",
        {
            "error_max_nm": error,
            "torque_max_nm": float(np.abs(run.analytic[:, motor]).max()),
            "error_with_distributed_inertia_nm": distributed,
        },
        order_of_magnitude(error, THESIS_ERROR, "Nm"),
        "The other side is Pinocchio with the robot's URDF in the place of ADAMS with the CAD model. Both are forms"
        " of one rigid model with the same parameters, so this is an identity of equations and says nothing of a"
        f" robot. With {RESIDUAL:g} kg m² of inertia on each distal link, which the grouped parameters leave out,"
        f" the torques differ by up to {engineering(distributed, 'Nm')}. The motion is prescribed at every sample,"
        " so no error of an integration is in it.",
        [Picture("cosimulation", caption, draw_cosimulation(run))] if motor == 0 else [],
    )


def criterion_of_free_dynamics(runs: ClaimRuns) -> Measured:
    """Return the force along t_s on the locus under random torques."""
    dynamics = free_dynamics([ReproductionCase(motion=motion) for motion in ("middle", "multiple", "fig_3_2")])
    return Measured(
        f"|m tₛᵀẍ| is {dynamics.along:.1e} N at most in the {dynamics.states} states of planned crossings under"
        f" {dynamics.torques} random torques each, where |m ẍ| goes up to {dynamics.force:.3g} N",
        {
            "along_ts_max_n": dynamics.along,
            "force_max_n": dynamics.force,
            "states": dynamics.states,
            "torques": dynamics.torques,
        },
        vanishing(dynamics.along, dynamics.force, ROUNDING, "N"),
        "Accelerations by Pinocchio, which shares no equation with the controllers. Beside the locus the force grows in"
        " proportion to the distance, so the zero is one of the locus and not of the method.",
        [Picture("free_dynamics", "Force along tₛ over the distance from the locus.", draw_free_dynamics(dynamics))],
    )


def crossing_beside(runs: ClaimRuns) -> Measured:
    """Return constraint error and torque of crossings at the posture of figure 3.2."""
    crossing = FIG_3_2.scenario().plan().crossings[0]
    error, torque = runs.largest("constraint_error"), runs.largest("requested")
    return Measured(
        f"planned crossings at ({crossing.x:.5f}, {crossing.y:.5f}) m; constraint error"
        f" {error_of(error, 'm')}, torque {plain(torque, 'Nm')} at most",
        {
            "x_m": crossing.x,
            "y_m": crossing.y,
            "constraint_error_max_m": error,
            "torque_requested_max_nm": torque,
            "durations_s": list(runs.extent.durations),
        },
        _finite(runs.runs),
        "The thesis shows the posture only; here the robot is driven through it, along tₛ and back.",
        [runs.picture("hero", "The robot on its way through the posture of figure 3.2.")],
    )


def rotation(runs: ClaimRuns) -> Measured:
    """Return A as rotated by the printed matrix, and by its transpose."""
    forces = rotated()

    def matrix(values: np.ndarray) -> str:
        rows = (", ".join(f"{round(value, 3) + 0.0:.3f}" for value in row) for row in values.tolist())
        return "[" + "; ".join(rows) + "]"

    return Measured(
        f"with the printed R(β): {matrix(forces.as_printed)}; with its transpose: {matrix(forces.transposed)}",
        {
            "difference_as_printed": forces.difference_as_printed,
            "difference_transposed": forces.difference_transposed,
            "second_row_transposed": forces.second_row,
        },
        as_printed(forces.difference_as_printed, 1e-3),
        "Two slips: R must be transposed, and the second column has lost its sign, since stretched distal links point"
        f" in opposite directions. What is meant holds: with Rᵀ the second row is zero within {forces.second_row:.0e}."
        " The controllers here use the singular vectors of A, which need no angle.",
    )


# section 4.2: both lists of candidate controllers on the middle and the multiple crossing


def _unknown_durations(extent: ReproductionExtent, more: str = "") -> str:
    durations = ", ".join(f"{duration:g}" for duration in extent.durations)
    words = (
        "Durations and gains are not in the text; the verdict is on the worst of"
        f" {durations} s per segment, the figure shows {SHOWN:g} s."
    )
    return f"{words} {more}".strip()


def _finite(runs: Sequence[ReproductionResult]) -> Judgement:
    return finite_torque([run.completed for run in runs], [run.requested for run in runs])


def path(runs: ClaimRuns) -> Measured:
    """Return the changes of assembly mode of runs of a motion."""
    assert runs.shown is not None
    motion = runs.shown.case.motion
    changes = [run.summary.assembly_mode_changes if run.summary else 0 for run in runs.runs]
    crossings = runs.shown.case.scenario().plan().crossings
    places = dict.fromkeys(f"({crossing.x * 1e3:.1f}, {crossing.y * 1e3:.1f})" for crossing in crossings)
    return Measured(
        f"{', '.join(map(str, sorted(set(changes))))} changes of assembly mode in {len(runs.runs)} runs of both"
        f" controllers; the locus is met at {', '.join(places)} mm",
        {"mode_changes": changes, "crossings_mm": list(places)},
        counted(changes, MODE_CHANGES[motion], "changes of assembly mode"),
        _unknown_durations(runs.extent),
        [runs.picture("path", f"Path of the {motion} crossing.")],
    )


def torque(runs: ClaimRuns) -> Measured:
    """Return the requested torques of runs that differ in the duration."""
    peaks = runs.by_duration("requested")
    return Measured(
        f"largest torque {plain(largest(list(peaks.values())), 'Nm')}: "
        + ", ".join(f"{plain(peak, 'Nm')} at {duration}" for duration, peak in peaks.items()),
        {"torque_requested_max_nm": peaks},
        _finite(runs.runs),
        _unknown_durations(runs.extent),
        [runs.picture("torques", "Motor torques.")],
    )


def constraint(runs: ClaimRuns, reported: float, joint: bool) -> Measured:
    """Return the errors of the virtual constraint, in angles (rad) or distances (m), against what is reported."""
    name, unit = ("constraint_error_joint", "rad") if joint else ("constraint_error", "m")
    errors, distance = runs.by_duration(name), runs.largest("constraint_error")
    worst = largest(list(errors.values()))
    more = (
        f"The unit of the error is not given; in rad it is the larger figure, as a distance it is"
        f" {error_of(distance, 'm')}."
        if joint
        else ""
    )
    return Measured(
        f"{error_of(worst, unit)} at most: "
        + ", ".join(f"{error_of(error, unit)} at {duration}" for duration, error in errors.items()),
        {f"constraint_error_max_{unit}": errors, "constraint_error_max_m": distance},
        order_of_magnitude(worst, reported, unit),
        _unknown_durations(runs.extent, more),
        [runs.picture("vhc_error", "Error of the virtual constraint.")],
    )


def supervisor(runs: ClaimRuns) -> Measured:
    """Return how often sigma rises, and what it is on the locus and at rest."""
    excess = [(run.row.zones or 0) - MODE_CHANGES[run.case.motion] for run in runs.runs]
    sigmas = [run.summary.sigma_max if run.summary else None for run in runs.runs]
    whole, rest = sum(sigma == 1.0 for sigma in sigmas), runs.largest("row.sigma_at_rest")
    both = [
        extra if sigma == 1.0 and run.row.sigma_at_rest == 0.0 else -1
        for extra, sigma, run in zip(excess, sigmas, runs.runs, strict=True)
    ]
    return Measured(
        f"one blending zone per crossing in {sum(extra == 0 for extra in excess)} of {len(excess)} runs; σ reaches 1"
        f" in {whole} of them and is {rest} at rest",
        {"zones_beyond_crossings": excess, "sigma_max": sigmas, "sigma_at_rest_max": rest},
        counted(both, 0, "zones beyond its crossings, with σ = 1 in them and 0 at rest"),
        "The printed table of 4.1.2 has its ends exchanged against its own sentence; the sentence is what is used."
        " Each crossing has a zone of its own width, so that σ = 1 lasts 40 ms.",
        [runs.picture("supervisor", "Weight σ and what it follows from.")],
    )


def _plants(extent: ReproductionExtent) -> tuple[str, ...]:
    return (NOMINAL, *(plant for plant in PERTURBED if plant in extent.perturbed), DELAY)


def on_all_plants(extent: ReproductionExtent, controller: str) -> list[ReproductionCase]:
    """Return a controller's cases on all plants; of the multiple crossing only those that do not take long."""
    cases = [case for plant in _plants(extent) for case in extent.grid(controller, plant=plant)]
    return [case for case in cases if case.motion == "middle" or case.duration <= LONGEST_MULTIPLE]


def with_and_without(cases: Sequence[ReproductionCase]) -> list[ReproductionCase]:
    """Return cases with the adaptive gain, and the same without it."""
    return [*cases, *(case._replace(adaptive_gain=False) for case in cases)]


def adaptive_gain_joint(runs: ClaimRuns) -> Measured:
    """Return completed runs and errors of the joint-space law with the adaptive gain and without it."""
    half = len(runs.runs) // 2
    pairs = [
        PairedRuns(
            f"{run.case.motion}, {run.case.duration:g} s, {run.case.plant}",
            run.completed,
            without.completed,
            run.constraint_error_joint,
            without.constraint_error_joint,
        )
        for run, without in zip(runs.runs[:half], runs.runs[half:], strict=True)
    ]
    worst_with = largest([pair.error_with for pair in pairs])
    worst_without = largest([pair.error_without for pair in pairs])
    done_with, done_without = (
        sum(getattr(pair, name) for pair in pairs) for name in ("completed_with", "completed_without")
    )
    return Measured(
        f"{done_without} of {len(pairs)} runs completed without it, {done_with} with it; worst constraint error"
        f" {error_of(worst_without, 'rad')} without and {error_of(worst_with, 'rad')} with",
        {
            "runs": len(pairs),
            "completed_with": done_with,
            "completed_without": done_without,
            "error_max_with_rad": worst_with,
            "error_max_without_rad": worst_without,
            "pairs": [pair._asdict() for pair in pairs],
        },
        shown_necessary(pairs),
        f"Tried on these plants: {', '.join(_plants(runs.extent))}; the multiple crossing with segments of up to"
        f" {LONGEST_MULTIPLE:g} s. The law here has the terms that 3.14 and 3.18 lose in print (the velocity along"
        " the path while crossing), so it is exact on the locus where the constraint holds, and the simulated robot"
        " has no elasticity, play or drive dynamics; what made the adaptive gain necessary on the real robot may"
        " lie in either.",
        [Picture("adaptive_gain", "Every run with the adaptive gain and without it.", draw_pairs(pairs))],
    )


def adaptive_gain_cartesian(runs: ClaimRuns) -> Measured:
    """Return completed runs and errors of the Cartesian law, which has no adaptive gain."""
    errors = {
        motion: largest([run.constraint_error for run in runs.runs if run.case.motion == motion])
        for motion in MODE_CHANGES
    }
    return Measured(
        f"{runs.completed} of {len(runs.runs)} runs completed without it; constraint error"
        f" {error_of(errors['middle'], 'm')} (middle) and {error_of(errors['multiple'], 'm')} (multiple)",
        {"runs": len(runs.runs), "completed": runs.completed, "constraint_error_max_m": errors},
        shown_unnecessary([run.completed for run in runs.runs], list(errors.values()), 1e-4, "m"),
        "On the same plants as above; the smaller of the two orders is asked of both motions.",
    )


def joint_and_cartesian(extent: ReproductionExtent) -> list[tuple[ReproductionCase, ReproductionCase]]:
    """Return pairs of cases that differ in the law, the joint-space one without adaptive gain."""
    return [(case._replace(controller=JOINT, adaptive_gain=False), case) for case in on_all_plants(extent, CARTESIAN)]


def accuracy(runs: ClaimRuns) -> Measured:
    """Return the ratios of the errors of both laws, and the stiffness of the joint-space law as printed."""
    joint, cartesian = runs.runs[::2], runs.runs[1::2]
    errors = [
        (by_joints.constraint_error, by_platform.constraint_error)
        for by_joints, by_platform in zip(joint, cartesian, strict=True)
    ]
    ratios = [of_joint / of_cartesian for of_joint, of_cartesian in errors if of_joint is not None and of_cartesian]
    motions = {(run.case.motion, run.case.duration): run.case for run in joint}
    own = [share for case in motions.values() for share in shares_as_printed(case.scenario())]
    oblique = shares_as_printed(OBLIQUE)
    return Measured(
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


# section 4.3, on a simulated rig: exact encoders, and an IMU with noise, bias, bandwidth and mounting


def rig_torque(runs: ClaimRuns) -> Measured:
    """Return the requested torques on the rig."""
    simulated = torque(runs)
    return simulated._replace(
        judgement=undecided(simulated.judgement, "the claim is about the robot, of which a simulation says nothing"),
        remark=f"{RIG} The IMU does not take part in the control, so these torques are those of the simulation above.",
        pictures=[runs.picture("torques", "Motor torques on the simulated rig.")],
    )


def rig_acceleration(runs: ClaimRuns) -> Measured:
    """Return the acceleration error by the IMU against the noise of the sensor."""
    assert runs.shown is not None
    judged = [run for run in runs.runs if run.case.duration >= SLOW_ENOUGH]
    ratios, whole = runs.by_duration("imu_ratio"), runs.by_duration("imu_ratio_whole")
    remark = f"{RIG} Judged for segments of {SLOW_ENOUGH:g} s and more."
    for run in runs.runs:
        if run.case.duration < SLOW_ENOUGH:
            remark += (
                f" At {run.case.duration:g} s the ratio is {run.imu_ratio or 0.0:.2f}: there the platform itself"
                " accelerates otherwise than desired while the computed torque law converges behind each zone, and"
                " the check shows it (table c)."
            )
    shown = runs.shown.row
    return Measured(
        f"{plain(shown.acceleration_outside_zones_m_s2, 'm/s²')} rms outside the zones at {SHOWN:g} s, noise floor"
        f" {plain(shown.noise_floor_m_s2, 'm/s²')}; ratio "
        + ", ".join(f"{ratio or 0.0:.3f} at {duration}" for duration, ratio in ratios.items())
        + "; over the whole run "
        + ", ".join(f"{ratio or 0.0:.3f} at {duration}" for duration, ratio in whole.items()),
        {
            "error_outside_zones_m_s2": runs.by_duration("row.acceleration_outside_zones_m_s2"),
            "noise_floor_m_s2": runs.by_duration("row.noise_floor_m_s2"),
            "ratio": ratios,
            "ratio_whole_run": whole,
        },
        near_noise([run.imu_ratio for run in judged], [run.imu_ratio_whole for run in judged]),
        remark,
        [runs.picture("acceleration", "Measured minus desired magnitude of the acceleration.")],
    )


# methods: computed torque alone, the printed law, and the multi-model method that came before


def _middle(spread: tuple[float, float, float] | None) -> str:
    """Return median and quartiles of torques (Nm) with two digits: more do not come again with other samples."""
    if spread is None:
        return "–"
    low, middle, high = (f"{float(f'{value:.2g}'):g} Nm" for value in spread)
    return f"median {middle}, quartiles {low} and {high}"


def _residual(runs: Sequence[ReproductionResult]) -> float | None:
    """Return the largest force (N) along t_s for which a reference asks on the locus."""
    return largest([run.row.crossing_residual_n for run in runs])


def _group(name: str, runs: Sequence[ReproductionResult], over_residual: bool) -> PointGroup:
    with_torque = [run for run in runs if run.requested is not None]
    x = tuple(run.row.crossing_residual_n or 0.0 for run in with_torque) if over_residual else ()
    return PointGroup(
        name, x, tuple(run.requested or 0.0 for run in with_torque), tuple(run.completed for run in with_torque)
    )


def finite_against_computed_torque(runs: ClaimRuns) -> Measured:
    """Return the torques of the blended laws, and those of computed torque alone."""
    laws = runs.by_law()
    blended, alone = [*laws[JOINT, QUINTIC], *laws[CARTESIAN, QUINTIC]], laws[CTC, QUINTIC]
    peak, residual = largest([run.requested for run in blended]), _residual(blended)
    asked = [run.requested for run in alone]
    done, samples = sum(run.completed for run in alone), sum(run.saturated or 0 for run in alone)
    spread = quartiles(asked)
    peaks = draw_peaks([_group(NAMES[law], laws[law], False) for law in LAWS])
    caption = "Largest torque requested in every run on the nominal plant, middle and multiple crossing."
    return Measured(
        f"blended laws: {plain(peak, 'Nm')} at most in {len(blended)} runs"
        f" whose references ask for up to {engineering(residual, 'N')} along tₛ on the locus; computed torque"
        f" alone: {_middle(spread)}",
        {
            "blended_torque_requested_max_nm": peak,
            "ctc_torque_requested_nm": asked,
            "ctc_torque_requested_quartiles_nm": spread,
            "ctc_completed": done,
            "ctc_saturated_samples": samples,
            "reference_residual_max_n": residual,
        },
        only_one_side_finite(_finite(blended), asked),
        "What computed torque asks for depends on where the sample nearest to the locus falls, hence median and"
        f" quartiles. In an ideal simulation with drives limited to 10 Nm it still gets through {done} of"
        f" {len(alone)} times, with {samples} saturated samples in all: the requested torque distinguishes them"
        " here, and under perturbed friction also the completion (table b).",
        [Picture("torque_peaks", caption, peaks)],
    )


ENOUGH_DURATIONS = 3
"""Durations of a motion from which on a threshold counts as tried."""


def printed_law(runs: ClaimRuns) -> Measured:
    """Return how many runs are completed with least torque and a fixed zone, of each width."""
    variants: dict[str, list[ReproductionResult]] = {}
    for run in runs.runs:
        variants.setdefault(run.case.variant, []).append(run)
    done = {}
    for epsilon in EPSILONS:
        tried = variants[fixed(epsilon, MIN_NORM)]
        good = [run.completed and (run.requested or 0.0) <= FINITE_TORQUE for run in tried]
        done[f"ε = {epsilon:g}"] = (sum(good), len(good))
    ours, durations = variants[DEFAULT], {run.case.duration for run in runs.runs}
    judged = some_setting_works(done)
    if len(durations) < ENOUGH_DURATIONS:
        judged = undecided(judged, "a threshold has to suit several durations")
    places = ", ".join(f"{number} of {total} at {name}" for name, (number, total) in done.items())
    return Measured(
        f"completed within 10 Nm: {places}; with friction fully compensated and zones of 40 ms"
        f" {sum(run.completed for run in ours)} of {len(ours)}",
        {"completed_by_epsilon": {name: list(value) for name, value in done.items()}},
        judged,
        "The least torque leaves friction along tₛ uncompensated, so the platform slows down in the zone; the wider"
        " the zone and the slower the motion, the more. A threshold that suits one speed loses another, hence the"
        " defaults here: friction compensated in full, and a width per crossing from the planned speed (table a).",
    )


def multi_model_with_criterion(runs: ClaimRuns) -> Measured:
    """Return completed runs and torques of the multi-model method on trajectories that meet the criterion."""
    residual, peak = _residual(runs.runs), runs.largest("requested")
    return Measured(
        f"{runs.completed} of {len(runs.runs)} runs completed with {plain(peak, 'Nm')} at most; the"
        f" references ask for {residual or 0.0:.0e} N along tₛ on the locus; tracking error"
        f" {error_of(runs.largest('tracking_error'), 'm')}",
        {
            "completed": runs.completed,
            "runs": len(runs.runs),
            "torque_requested_max_nm": peak,
            "reference_residual_max_n": residual,
        },
        _finite(runs.runs),
        "On the thesis' motions and on two that cross far from half of their way.",
        [runs.picture("criterion", "A reference that meets the criterion."), runs.picture("torques", "Its torques.")],
    )


def multi_model_without_criterion(runs: ClaimRuns) -> Measured:
    """Return how the multi-model method fails where the trajectory does not meet the criterion."""
    laws = runs.by_law()
    failed = {law: [run for run in of_law if not run.completed or run.saturated] for law, of_law in laws.items()}
    quintic, criterion, cartesian = (MULTI_MODEL, QUINTIC), (MULTI_MODEL, CRITERION), (CARTESIAN, QUINTIC)
    broken, kept = laws[quintic], laws[criterion]
    on_thesis = [run for run in failed[quintic] if run.case.motion in THESIS_MOTIONS]
    residual = _residual(broken)
    peaks = {NAMES[law]: largest([run.requested for run in of_law]) for law, of_law in laws.items()}
    near = [run.row for run in broken if run.case.motion in THESIS_MOTIONS]
    fractions = [
        fraction for row in near for fraction in (row.least_fraction, row.largest_fraction) if fraction is not None
    ]
    return Measured(
        f"with the fifth-order polynomial {len(failed[quintic])} of {len(broken)} runs are not"
        f" completed or ask for more than 10 Nm, {plain(peaks[NAMES[quintic]], 'Nm')} at worst, where"
        f" the reference asks for up to {engineering(residual, 'N')} along tₛ; with the criterion"
        f" {len(failed[criterion])} of {len(kept)}",
        {
            **{f"failed_or_saturated, {NAMES[law]}": [run.case.label for run in lost] for law, lost in failed.items()},
            "torque_requested_max_nm": peaks,
        },
        some_fail(len(failed[quintic]), len(broken), len(failed[criterion]), len(kept)),
        f"On the thesis' own motions it {f'fails {len(on_thesis)} times' if on_thesis else 'never fails'}: they"
        f" cross near half of their way (after {min(fractions):.0%} to {max(fractions):.0%}), where the polynomial"
        " nearly meets the criterion by symmetry. On the same motions multi_cartesian is not completed or saturates"
        f" in {len(failed[cartesian])} of {len(laws[cartesian])} runs: on the locus the"
        " constraint law bears a missed criterion, but what the reference gains meanwhile has to be caught up close"
        " to it.",
        [
            Picture(
                "criterion_price",
                "Torque over the reference's distance from the criterion: thesis' motions, early and late ones.",
                draw_residuals([_group(NAMES[law], of_law, True) for law, of_law in laws.items()]),
            ),
            runs.picture("criterion", "The same motion by the fifth-order polynomial."),
            runs.picture("torques", "Its torques."),
        ],
    )


def multi_model_across(runs: ClaimRuns) -> Measured:
    """Return how often the multi-model method gets across."""
    across, lost = sum(run.across for run in runs.runs), [run.case.label for run in runs.runs if not run.completed]
    return Measured(
        f"{across} of {len(runs.runs)} runs get across, {runs.completed}"
        f" are completed, with {plain(runs.largest('requested'), 'Nm')} at most",
        {"runs": len(runs.runs), "across": across, "completed": runs.completed, "not_completed": lost},
        some_not_across([run.across for run in runs.runs]),
        "By the fifth-order polynomial throughout, on the thesis' motions with every plant, and on the motions that"
        " cross far from half of their way. On the locus the reduced model leaves the platform to its momentum, as"
        " the constraint laws do; that is enough for the 40 ms that a crossing takes on a rigid robot."
        + (f" Not completed: {'; '.join(lost)}." if lost else ""),
    )


# future work: validation by vision, with a simulated camera beside the simulated IMU


NO_RESULT = "the thesis has no result to compare with"


def vision(runs: ClaimRuns) -> Measured:
    """Return how far the camera is from the joints, and from the exact platform."""
    assert runs.shown is not None
    summary = runs.shown.summary
    rms, peak, true_peak = (
        (None, None, None)
        if summary is None
        else (summary.vision_error_rms_m, summary.vision_error_max_m, summary.vision_true_error_max_m)
    )
    return Measured(
        f"camera minus joints {error_of(rms, 'm')} rms, {error_of(peak, 'm')} at most, camera minus exact"
        f" platform {error_of(true_peak, 'm')} at most; beside it the IMU's acceleration error over the whole run"
        f" {plain(runs.shown.row.acceleration_m_s2, 'm/s²')} rms",
        {
            "vision_error_rms_m": rms,
            "vision_error_max_m": peak,
            "vision_true_error_max_m": true_peak,
            "imu_error_m_s2": runs.shown.row.acceleration_m_s2,
            "imu_noise_floor_m_s2": runs.shown.row.noise_floor_whole_m_s2,
        },
        undecided(within([peak, true_peak], MOVING_LIMIT), NO_RESULT),
        RENDERED,
        [runs.picture("vision", "Platform by the camera minus that by the joints, and minus the exact one.")],
    )


def camera_accuracy(speed: float, limit: float) -> Measured:
    """Return the errors of positions by the camera of a platform that moves at a speed (m/s), against a limit (m)."""
    position_errors = optional_part(CAMERA_ACCURACY, CAMERA_ON)
    errors: list[float | None] = position_errors(load_robot("dextar"), CameraSettings(on=True), speed, PICTURES)
    known = [error for error in errors if error is not None]
    middle, most = (sorted(known)[len(known) // 2], max(known)) if known else (None, None)
    return Measured(
        f"{error_of(middle, 'm')} in the median and {error_of(most, 'm')} at most over {PICTURES} pictures"
        f" at random places, seen in {len(known)}",
        {"median_m": middle, "largest_m": most, "seen": len(known), "pictures": PICTURES},
        undecided(within(errors, limit), NO_RESULT),
        RENDERED,
    )
