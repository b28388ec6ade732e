# SPDX-License-Identifier: Apache-2.0
"""The claims of the thesis as a table: where each one stands, what it says, the runs it needs and how it is judged."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from fivebar_bringup.pages.content import Picture
from fivebar_bringup.report.thesis import CARTESIAN
from fivebar_control.trajectory.time_laws import CRITERION, QUINTIC
from fivebar_studies.reproduce import measured
from fivebar_studies.reproduce.cases import JOINT, MULTI_MODEL, SHOWN, ReproductionCase, ReproductionExtent
from fivebar_studies.reproduce.measured import ClaimRuns, Measured
from fivebar_studies.reproduce.runner import Drawings, Results
from fivebar_studies.reproduce.tables import LAWS, far_cases, printed_law_cases
from fivebar_studies.reproduce.verdicts import Judgement

Cases = Callable[[ReproductionExtent], Sequence[ReproductionCase]]


class ClaimRow(NamedTuple):
    """One comparison.

    Attributes:
        place: figure, equation or section of the thesis.
        title: what it is about.
        thesis: what the thesis reports, and where.
        measured: what was found here.
        numbers: the values behind it.
        judgement: verdict, rule and reason.
        remark: context for the reader.
        pictures: figures of this reproduction.
    """

    place: str
    title: str
    thesis: str
    measured: str
    numbers: Mapping[str, Any]
    judgement: Judgement
    remark: str = ""
    pictures: Sequence[Picture] = ()

    @property
    def anchor(self) -> str:
        """The target of a link on the page."""
        name = f"{self.place} {self.title}".lower()
        return "-".join("".join(letter if letter.isalnum() else " " for letter in name).split())

    def as_json(self) -> dict[str, Any]:
        """Return the row as plain values; pictures by name."""
        judged = {"verdict": str(self.judgement.verdict), "rule": self.judgement.rule, "reason": self.judgement.reason}
        plain = {name: getattr(self, name) for name in ("place", "title", "thesis", "measured")}
        numbers, pictures = dict(self.numbers), [picture.name for picture in self.pictures]
        return {**plain, "numbers": numbers, **judged, "remark": self.remark, "pictures": pictures}


class Claim(NamedTuple):
    """A claim.

    Attributes:
        name: by which it is chosen.
        place, title, thesis: as in its row.
        measure: returns what its runs come to, judged by its rule.
        cases: its runs.
        shown: the run of which there are figures, which need not be one of these; None for none.
        drawings: these figures, by name.
    """

    name: str
    place: str
    title: str
    thesis: str
    measure: Callable[[ClaimRuns], Measured]
    cases: Cases = lambda extent: ()
    shown: ReproductionCase | None = None
    drawings: Drawings = ()

    def needs(self, extent: ReproductionExtent) -> dict[ReproductionCase, Drawings]:
        """Return its runs with the figures that are needed of each."""
        needs: dict[ReproductionCase, Drawings] = dict.fromkeys(self.cases(extent), ())
        return needs if self.shown is None else {**needs, self.shown: self.drawings}

    def row(self, extent: ReproductionExtent, results: Results) -> ClaimRow:
        """Return its row, made of the results of its runs."""
        runs = [results[case] for case in self.cases(extent)]
        claim_runs = ClaimRuns(extent, results, runs, None if self.shown is None else results[self.shown])
        return ClaimRow(self.place, self.title, self.thesis, *self.measure(claim_runs))


def _grid(*controllers: str, motions: tuple[str, ...] = ("middle", "multiple"), imu: bool = False) -> Cases:
    return lambda extent: [case for name in controllers for case in extent.grid(name, motions, imu=imu)]


def _shown(motion: str, controller: str = CARTESIAN, imu: bool = False) -> ReproductionCase:
    return ReproductionCase(controller, motion, SHOWN, imu=imu)


def _far(controller: str, time_law: str) -> list[ReproductionCase]:
    return [case for case in far_cases() if (case.controller, case.time_law) == (controller, time_law)]


def _near_and_far(*laws: tuple[str, str]) -> Cases:
    """Return the runs of controllers and time laws on the motions of the thesis, and on those far from half way."""
    return lambda extent: [case for name, law in laws for case in (*extent.grid(name, time_law=law), *_far(name, law))]


def _model_torque(motor: int, number: str) -> Claim:
    return Claim(
        number,
        f"Figure {number}",
        f"Error in the torque of joint q{motor + 1}1 between two models",
        "of order 10⁻⁸ Nm between MATLAB and ADAMS, both joints following sin(t)/10 (section 1.4.3)",
        lambda runs: measured.model_torque(motor),
    )


def _path(number: str, motion: str, thesis: str) -> Claim:
    return Claim(
        number,
        f"Figure {number}",
        f"Path of the {motion} crossing",
        thesis,
        measured.path,
        _grid(JOINT, CARTESIAN, motions=(motion,)),
        _shown(motion),
        ("path",),
    )


def _torque(number: str, controller: str, motion: str, thesis: str) -> Claim:
    return Claim(
        number,
        f"Figure {number}",
        f"Torques of {controller}, {motion} crossing",
        thesis,
        measured.torque,
        _grid(controller, motions=(motion,)),
        _shown(motion, controller),
        ("torques",),
    )


def _constraint(number: str, controller: str, motion: str, reported: float, thesis: str) -> Claim:
    return Claim(
        number,
        f"Figure {number}",
        f"Error of the virtual constraint of {controller}, {motion} crossing",
        thesis,
        lambda runs: measured.constraint(runs, reported, joint=controller == JOINT),
        _grid(controller, motions=(motion,)),
        _shown(motion, controller),
        ("vhc_error",),
    )


def _rig(number: str, title: str, motion: str, thesis: str, measure: Callable[[ClaimRuns], Measured]) -> Claim:
    return Claim(
        number,
        f"Figure {number}",
        f"{title}, {motion} crossing, in simulation only",
        thesis,
        measure,
        _grid(CARTESIAN, motions=(motion,), imu=True),
        _shown(motion, imu=True),
        ("torques", "acceleration"),
    )


def _vision(name: str, title: str, speed: float, limit: float) -> Claim:
    return Claim(name, FUTURE, title, CAMERA, lambda runs: measured.camera_accuracy(speed, limit))


FUTURE = "Future works"
CAMERA = "proposed: validate the crossing with an external camera (future works); no figure in the text"
SEEN = ReproductionCase(CARTESIAN, "middle", SHOWN, imu=True, camera=True)

CLAIMS = (
    _model_torque(0, "1.17"),
    _model_torque(1, "1.18"),
    Claim(
        "appendix",
        "Section 2.2, Appendix A",
        "The free dynamics on the locus are the dynamic criterion",
        "m ÿ = tₛᵀ w_p = 0 on the locus, whatever the motors do (2.4, 4.21)",
        measured.criterion_of_free_dynamics,
    ),
    Claim(
        "3.2",
        "Figure 3.2",
        "Crossing at the posture away from x = 0",
        "the constraint can be enforced anywhere on the locus, shown by the posture at (−0.06745, 0.03989) m"
        " (section 3.3)",
        measured.crossing_beside,
        lambda extent: [measured.FIG_3_2._replace(duration=duration) for duration in extent.durations],
        measured.FIG_3_2,
        ("hero",),
    ),
    Claim(
        "3.45",
        "Equation 3.45",
        "The rotation by β turns Aᵀ into [1, 1; 0, 0]",
        "R(β)Aᵀ = [1, 1; 0, 0] with β = 0.4373 rad at the posture of figure 3.2 (section 3.3)",
        measured.rotation,
    ),
    Claim(
        "4.1.2",
        "Section 4.1.2",
        "The supervisor switches by the condition of A",
        "σ is 0 far from the locus and 1 on it, and the block works for switching (sections 4.1.2, 4.2)",
        measured.supervisor,
        _grid(JOINT, CARTESIAN),
        _shown("multiple"),
        ("supervisor",),
    ),
    _path(
        "4.5", "middle", "A→B→A along x = 0, from 0.15 to 0.02 m and back, crosses the singularity twice (section 4.2)"
    ),
    _torque(
        "4.6", JOINT, "middle", "the robot crosses with finite torques; the figure's values are not in the text (4.2)"
    ),
    _constraint("4.7", JOINT, "middle", 1e-4, "almost zero, of order 10⁻⁴ (section 4.2)"),
    Claim(
        "adaptive gain, joint",
        "Section 4.2, first list",
        "The joint-space law needs the adaptive gain",
        "the adaptive gain was necessary for the first list, because the model of the joint-space law is less"
        " accurate (section 4.2, before figure 4.6)",
        measured.adaptive_gain_joint,
        lambda extent: measured.with_and_without(measured.on_all_plants(extent, JOINT)),
    ),
    _torque("4.8", CARTESIAN, "middle", "the robot crosses with finite torques (section 4.2)"),
    _constraint("4.9", CARTESIAN, "middle", 1e-4, "almost zero, of order 10⁻⁴ m (section 4.2)"),
    Claim(
        "adaptive gain, cartesian",
        "Section 4.2, second list",
        "The Cartesian law needs no adaptive gain",
        "the adaptive gain was not necessary for the second list; errors of order 10⁻⁴ m (middle) and 10⁻³ m"
        " (multiple) without it (section 4.2)",
        measured.adaptive_gain_cartesian,
        lambda extent: measured.on_all_plants(extent, CARTESIAN),
    ),
    Claim(
        "accuracy",
        "Sections 2.4, 4.3",
        "The Cartesian law is more accurate than the joint-space law as printed",
        "the Cartesian form is mathematically more consistent, its model more accurate (sections 3.2, 4.2, 4.3)",
        measured.accuracy,
        lambda extent: [case for pair in measured.joint_and_cartesian(extent) for case in pair],
    ),
    _path("4.10", "multiple", "A→B→A→B→A→C→D→A→E→F→A, crossings also away from x = 0 (section 4.2)"),
    _torque("4.11", CARTESIAN, "multiple", "the robot crosses with finite torques (section 4.2)"),
    _constraint("4.12", CARTESIAN, "multiple", 1e-3, "of order 10⁻³ m (section 4.2)"),
    _rig(
        "4.13",
        "Torques on the rig",
        "middle",
        "the real robot crosses with finite torques with the second list (section 4.3)",
        measured.rig_torque,
    ),
    _rig(
        "4.15",
        "Acceleration error by the IMU",
        "middle",
        "the tracking error of the acceleration's magnitude is small; no figure in the text (4.3)",
        measured.rig_acceleration,
    ),
    _rig(
        "4.16",
        "Torques on the rig",
        "multiple",
        "the real robot crosses several times with finite torques, also where x ≠ 0 (section 4.3)",
        measured.rig_torque,
    ),
    _rig(
        "4.17",
        "Acceleration error by the IMU",
        "multiple",
        "the error converges towards zero; variations are put down to how the sensor is mounted (section 4.3)",
        measured.rig_acceleration,
    ),
    Claim(
        "finite torque",
        "Sections 1.3, 4.2, 4.4",
        "Non-optimal trajectories are crossed with finite torque; computed torque alone saturates the drives",
        "near the locus the torques of computed torque control grow without bound (section 1.3.1); the"
        " multi-controller scheme crosses with finite torques on trajectories that know nothing of the criterion",
        measured.finite_against_computed_torque,
        lambda extent: [case for name, law in LAWS for case in extent.grid(name, time_law=law)],
    ),
    Claim(
        "printed law",
        "Equation 3.35, section 4.1.2",
        "Least torque and a fixed threshold, as printed",
        "the pseudo-inverse gives the least torque (3.35); ε is a threshold to be tuned by experiment (4.1.2)",
        measured.printed_law,
        lambda extent: [*printed_law_cases(extent), *extent.grid(CARTESIAN)],
    ),
    Claim(
        "multi-model, criterion",
        "Section 1.3.2",
        "The multi-model method crosses where the trajectory meets the criterion",
        "with a reduced model on the locus it crosses without torque discontinuities as long as the trajectory"
        " meets the dynamic criterion (section 1.3.2)",
        measured.multi_model_with_criterion,
        _near_and_far((MULTI_MODEL, CRITERION)),
        measured.STEEP._replace(time_law=CRITERION),
        ("criterion", "torques"),
    ),
    Claim(
        "multi-model, quintic",
        "Section 1.3.2",
        "The multi-model method needs a trajectory that meets the criterion",
        "torques stay continuous only as long as the trajectory meets the criterion; otherwise they grow towards"
        " the locus (section 1.3.2)",
        measured.multi_model_without_criterion,
        _near_and_far((MULTI_MODEL, QUINTIC), (MULTI_MODEL, CRITERION), (CARTESIAN, QUINTIC)),
        measured.STEEP,
        ("criterion", "torques"),
    ),
    Claim(
        "multi-model, across",
        "Context",
        "The multi-model method may not get across",
        "it leaves the platform out of the linearisation, which may not succeed in crossing and overconstrains the"
        " system at the singularity (context)",
        measured.multi_model_across,
        lambda extent: [
            *(case for plant in ("nominal", *extent.perturbed) for case in extent.grid(MULTI_MODEL, plant=plant)),
            *_far(MULTI_MODEL, QUINTIC),
        ],
    ),
    Claim(
        "vision",
        FUTURE,
        "Validation by vision beside the IMU, middle crossing, in simulation only",
        CAMERA,
        measured.vision,
        shown=SEEN,
        drawings=("vision",),
    ),
    _vision("vision at rest", "Accuracy of the camera, robot at rest", 0.0, measured.STATIC_LIMIT),
    _vision(
        "vision in motion", f"Accuracy of the camera at {measured.SPEED:g} m/s", measured.SPEED, measured.MOVING_LIMIT
    ),
)
"""All claims, in the order of the page."""
