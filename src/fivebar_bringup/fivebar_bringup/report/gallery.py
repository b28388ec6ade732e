# SPDX-License-Identifier: Apache-2.0
"""The pictures of a report: drawn, named and explained."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from matplotlib.figure import Figure

from fivebar_bringup.pages.content import Picture
from fivebar_bringup.pages.style import house_style, png
from fivebar_bringup.recorded.summary import REALTIME
from fivebar_bringup.report import criterion_figure, cycle_figure, figures, plane
from fivebar_bringup.report.analysis import RunAnalysis, zones_in_words
from fivebar_bringup.report.thesis import counterpart
from fivebar_description.optional import CAMERA_FIGURE, CAMERA_ON, optional_part

DRAW: dict[str, Callable[[RunAnalysis], Figure]] = {
    "torques": figures.torques,
    "vhc_error": figures.vhc_error,
    "acceleration": figures.acceleration,
    "vision": lambda run: _vision(run)[0],
    "supervisor": figures.supervisor,
    "criterion": criterion_figure.criterion,
    "cycles": cycle_figure.cycles,
    "tracking": figures.tracking,
    "path": lambda run: plane.path(run, plane.survey_run(run)),
    "hero": lambda run: plane.hero(run, plane.survey_run(run)),
}

REPLAYED = frozenset({"hero", "torques", "acceleration"})
"""Pictures whose content the charts of a replay show too, so that a page with one leaves them out."""


def draw(run: RunAnalysis, name: str) -> bytes:
    """Return one of a run's figures as PNG."""
    with house_style():
        return png(DRAW[name](run))


def _vision(run: RunAnalysis) -> tuple[Figure, str]:
    """Return the figure of what the camera saw, and its caption."""
    drawn: tuple[Figure, str] = optional_part(CAMERA_FIGURE, CAMERA_ON)(run)
    return drawn


def draw_pictures(run: RunAnalysis) -> list[Picture]:
    """Return all pictures of a run, in the order in which the page shows them; none for a run without samples."""
    if not run.series.sample.size:
        return []
    thesis = counterpart(run.scenario)
    zones = zones_in_words(run.scenario)
    with house_style():
        survey = plane.survey_run(run)
        drawn = {
            "hero": (
                plane.hero(run, survey),
                "The robot as measured, at even steps of its way"
                + (" through the locus," if run.plan.crossings else ",")
                + " beside the torques applied"
                " on the way and the weight σ that the supervisor "
                + ("gave" if run.blends else "would give")
                + " to the constraint law.",
            ),
            "torques": (
                figures.torques(run),
                "Torques that the motors applied, and in grey the requested ones where the drives gave less."
                f" {zones} The axis is logarithmic on both sides of zero where"
                f" torques exceed 100 Nm. Corresponds to {thesis.torque}.",
            ),
            "vhc_error": (
                figures.vhc_error(run),
                "Signed distance h of the platform from the current straight path segment, which the Cartesian"
                f" constraint law keeps at zero (corresponds to {thesis.vhc_error}), and the motor angles against"
                " those of the nearest path point, which the joint-space law keeps at zero"
                f" (corresponds to {thesis.vhc_error_joint}). Strong lines"
                + (" where the constraint law acts," if run.blends else " where it would act,")
                + " pale ones elsewhere.",
            ),
            "path": (
                plane.path(run, survey),
                "Path of the platform, coloured by assembly mode, with the Type 2 locus of the working mode at the"
                " start, the boundary of the workspace (Type 1) and the robot in up to three measured postures."
                f" Corresponds to {thesis.path}.",
            ),
            "supervisor": (
                figures.supervisor(run),
                "Weight σ of the constraint law, the distance 1/cond(A) from the Type 2 locus, and the torque that"
                " each candidate law requests along this run. Corresponds to the supervisory block of section"
                " 4.1.2.",
            ),
            "criterion": (
                criterion_figure.criterion(run),
                "The force that the reference demands in the direction that is uncontrollable on the locus, mass times"
                " acceleration along tₛ, with the planned crossings: where it is zero there, the motion meets the"
                " dynamic criterion. Strong in the blending zones; elsewhere every direction is controllable."
                " Corresponds to equations 1.19, 2.4 and 4.21; the thesis has no such figure.",
            ),
            "tracking": (
                figures.tracking(run),
                "Platform minus reference. "
                + (
                    "In the zones the constraint acts across the path only, so that the platform runs freely along it"
                    " and the computed torque law catches up afterwards. "
                    if run.blends
                    else ""
                )
                + "The thesis has no such figure.",
            ),
            "acceleration": (
                figures.acceleration(run),
                "Magnitude of the acceleration that the IMU measured at the end effector minus the desired one."
                f" Corresponds to {thesis.acceleration}.",
            ),
        }
        if run.summary.vision_error_rms_m is not None:
            drawn["vision"] = _vision(run)
        if run.summary.mode == REALTIME and run.summary.cycle_time_ms is not None:
            drawn["cycles"] = (
                cycle_figure.cycles(run),
                "How evenly the run kept its time, as the recorder saw it, which has no priority itself. Late and"
                " missing samples are bridged: the last torque is held.",
            )
        if np.all(np.isnan(run.series.vhc_error)):
            # without a straight segment there is no line to measure h from
            del drawn["vhc_error"]
        return [Picture(name, caption, png(figure)) for name, (figure, caption) in drawn.items()]
