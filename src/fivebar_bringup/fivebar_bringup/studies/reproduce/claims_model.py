"""Claims about the model: co-simulation, free dynamics, the posture of figure 3.2."""

from __future__ import annotations

from functools import cache

import numpy as np

from fivebar_bringup.pages.content import Picture
from fivebar_bringup.studies.closed_chain.cosimulation import THESIS_ERROR, CoSimulation, co_simulate, draw_cosimulation
from fivebar_bringup.studies.reproduce.cases import SHOWN, ReproductionCase, ReproductionExtent
from fivebar_bringup.studies.reproduce.free_dynamics import free_dynamics, rotated
from fivebar_bringup.studies.reproduce.own_figures import draw_free_dynamics
from fivebar_bringup.studies.reproduce.rows import Claim, ClaimRow, largest, of, runs_of
from fivebar_bringup.studies.reproduce.runner import Results
from fivebar_bringup.studies.reproduce.verdicts import as_printed, finite_torque, order_of_magnitude, vanishing
from fivebar_bringup.units import engineering, error_of, plain
from fivebar_description.robot_file import load_robot

ROUNDING = 1e-9
"""Part of the largest force that the free dynamics may leave along t_s by rounding."""

RESIDUAL = -1e-4
"""kg m^2. A uniform distal link of 75 g, whose mass the grouped parameters put on both its ends, has that much less
inertia than they say (m l^2 / 6)."""

FIG_3_2 = ReproductionCase(motion="fig_3_2", duration=SHOWN)


@cache
def _cosimulation() -> CoSimulation:
    return co_simulate(load_robot("dextar"))


@cache
def _distributed() -> CoSimulation:
    robot = load_robot("dextar")
    leg1, leg2 = (leg._replace(residual=leg.residual + RESIDUAL) for leg in (robot.leg1, robot.leg2))
    return co_simulate(robot, duration=6.5, rate_hz=50, actual=robot._replace(leg1=leg1, leg2=leg2))


def _torque_of_the_model(motor: int) -> Claim:
    number = ("1.17", "1.18")[motor]

    def make(extent: ReproductionExtent, results: Results) -> ClaimRow:
        run = _cosimulation()
        error = float(np.abs(run.difference[:, motor]).max())
        distributed = float(np.abs(_distributed().difference[:, motor]).max())
        pictures = [
            Picture(
                "cosimulation",
                "Torque of the closed-form model minus that of Pinocchio along the thesis' motion, friction off.",
                draw_cosimulation(run),
            )
        ]
        return ClaimRow(
            f"Figure {number}",
            f"Error in the torque of joint q{motor + 1}1 between two models",
            "of order 10⁻⁸ Nm between MATLAB and ADAMS, both joints following sin(t)/10 (section 1.4.3)",
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
            pictures if motor == 0 else [],
        )

    return Claim(number, lambda extent: {}, make)


def _free_dynamics(extent: ReproductionExtent, results: Results) -> ClaimRow:
    found = free_dynamics([ReproductionCase(motion=motion) for motion in ("middle", "multiple", "fig_3_2")])
    return ClaimRow(
        "Section 2.2, Appendix A",
        "The free dynamics on the locus are the dynamic criterion",
        "m ÿ = tₛᵀ w_p = 0 on the locus, whatever the motors do (2.4, 4.21)",
        f"|m tₛᵀẍ| is {found.along:.1e} N at most in the {found.states} states of planned crossings under"
        f" {found.torques} random torques each, where |m ẍ| goes up to {found.force:.3g} N",
        {"along_ts_max_n": found.along, "force_max_n": found.force, "states": found.states, "torques": found.torques},
        vanishing(found.along, found.force, ROUNDING, "N"),
        "Accelerations by Pinocchio, which shares no equation with the controllers. Beside the locus the force grows in"
        " proportion to the distance, so the zero is one of the locus and not of the method.",
        [Picture("free_dynamics", "Force along tₛ over the distance from the locus.", draw_free_dynamics(found))],
    )


def _crossing_beside(extent: ReproductionExtent, results: Results) -> ClaimRow:
    cases = [FIG_3_2._replace(duration=duration) for duration in extent.durations]
    runs = runs_of(cases, results)
    shown = results[FIG_3_2]
    crossing = FIG_3_2.scenario().plan().crossings[0]
    return ClaimRow(
        "Figure 3.2",
        "Crossing at the posture away from x = 0",
        "the constraint can be enforced anywhere on the locus, shown by the posture at (−0.06745, 0.03989) m"
        " (section 3.3)",
        f"planned crossings at ({crossing.x:.5f}, {crossing.y:.5f}) m; constraint error"
        f" {error_of(largest([run.constraint_error for run in runs]), 'm')}, torque"
        f" {plain(largest([run.requested for run in runs]), 'Nm')} at most",
        {
            "x_m": crossing.x,
            "y_m": crossing.y,
            "constraint_error_max_m": largest([run.constraint_error for run in runs]),
            "torque_requested_max_nm": largest([run.requested for run in runs]),
            "durations_s": list(extent.durations),
        },
        finite_torque([run.completed for run in runs], [run.requested for run in runs]),
        "The thesis shows the posture only; here the robot is driven through it, along tₛ and back.",
        [shown.picture("hero", "The robot on its way through the posture of figure 3.2.")],
    )


def _rotation(extent: ReproductionExtent, results: Results) -> ClaimRow:
    found = rotated()

    def matrix(values: np.ndarray) -> str:
        rows = (", ".join(f"{round(value, 3) + 0.0:.3f}" for value in row) for row in values.tolist())
        return "[" + "; ".join(rows) + "]"

    return ClaimRow(
        "Equation 3.45",
        "The rotation by β turns Aᵀ into [1, 1; 0, 0]",
        "R(β)Aᵀ = [1, 1; 0, 0] with β = 0.4373 rad at the posture of figure 3.2 (section 3.3)",
        f"with the printed R(β): {matrix(found.as_printed)}; with its transpose: {matrix(found.transposed)}",
        {
            "difference_as_printed": found.difference_as_printed,
            "difference_transposed": found.difference_transposed,
            "second_row_transposed": found.second_row,
        },
        as_printed(found.difference_as_printed, 1e-3),
        "Two slips: R must be transposed, and the second column has lost its sign, since stretched distal links point"
        f" in opposite directions. What is meant holds: with Rᵀ the second row is zero within {found.second_row:.0e}."
        " The controllers here use the singular vectors of A, which need no angle.",
    )


CLAIMS = (
    _torque_of_the_model(0),
    _torque_of_the_model(1),
    Claim("appendix", lambda extent: {}, _free_dynamics),
    Claim(
        "3.2",
        lambda extent: of([FIG_3_2._replace(duration=duration) for duration in extent.durations], FIG_3_2, ("hero",)),
        _crossing_beside,
    ),
    Claim("3.45", lambda extent: {}, _rotation),
)
