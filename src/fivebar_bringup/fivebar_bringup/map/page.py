# SPDX-License-Identifier: Apache-2.0
"""The page of a map, and its pictures: drawn, named and explained."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence

from matplotlib.figure import Figure

from fivebar_bringup.map import figures
from fivebar_bringup.map.drawing import working_mode_label
from fivebar_bringup.map.figures import Survey
from fivebar_bringup.map.measures import Measures
from fivebar_bringup.pages.content import Picture
from fivebar_bringup.pages.rendering import render
from fivebar_bringup.pages.style import house_style, png
from fivebar_description.parameters import FiveBar

TITLES = {
    "postures": "The robot and its singularities",
    "assembly_modes": "Workspace and assembly modes",
    "conditioning": "Conditioning over the workspace",
    "motor_modes": "The plane of the motor angles",
    "motor_conditioning": "Conditioning over the motor angles",
}


POSTURES = (
    "Two legs carry the platform. For one pair of motor angles there are two positions of it: the assembly modes,"
    " distinguished by the sign of det A. Type 1: a leg is stretched or folded, the platform cannot move along it, and"
    " the workspace ends here; the line is that end. Type 2: the distal links lie on one line, and no motor torque"
    " resists a motion across it, along the arrow; the purple line is all such places for the elbows as drawn. Type 3:"
    " a leg and the distal links are aligned at once."
)
ASSEMBLY_MODES = (
    "Each leg can reach a place with its elbow on either side, which makes four working modes. In each of them the Type"
    " 2 locus cuts the workspace into regions of one assembly mode: blue where det A is positive, orange where it is"
    " negative. To get from one colour to the other without moving an elbow to the other side, the robot has to cross"
    " the purple line; that is what the constraint controllers of this project are for. Where the line touches the"
    " boundary of the workspace, a leg is stretched or folded as well (Type 3), and the line goes on in the"
    " neighbouring working mode. The robot is drawn in one posture per working mode."
)
CONDITIONING = (
    "1/cond(A) says how evenly the motors hold the platform in all directions: 1 (yellow) where the distal links are at"
    " right angles, 0 (dark blue) on the Type 2 locus, near which ordinary control asks for ever larger torques. The"
    " supervisor blends its two controllers by this number, so the dark bands are where the blending takes place."
)
MOTOR_MODES = (
    "The same in the plane of the motor angles: every point is a pair of them, and both axes are periodic. In the grey"
    " areas the elbows are too far apart, or too close to each other, for the distal links to meet. Their rim is the"
    " Type 2 locus, along which the two assembly modes, drawn side by side, are joined: to change the assembly mode the"
    " motors run up to the rim and turn back. The colours are the working modes; they change where a leg is stretched"
    " or folded (Type 1). A purple ring is a point at which both elbows are in one place, which happens if the distal"
    " links are equally long: there the platform turns freely on a whole circle, and in the figures of the platform's"
    " plane that one point is the whole dashed purple circle."
)
MOTOR_CONDITIONING = (
    "1/cond(A) over the motor angles, for either assembly mode: dark towards the rim of the area where the loop closes,"
    " where both assembly modes meet."
)

PICTURES: dict[str, tuple[Callable[[Survey], Figure], str]] = {
    "postures": (figures.postures, POSTURES),
    "assembly_modes": (figures.assembly_modes, ASSEMBLY_MODES),
    "conditioning": (figures.conditioning, CONDITIONING),
    "motor_modes": (figures.motor_modes, MOTOR_MODES),
    "motor_conditioning": (figures.motor_conditioning, MOTOR_CONDITIONING),
}


def draw_pictures(survey: Survey) -> Iterator[Picture]:
    """Yield the pictures of a map, in the order in which the page shows them."""
    for name, (draw, caption) in PICTURES.items():
        with house_style():
            picture = png(draw(survey))
        yield Picture(name, caption, picture)


def html_page(name: str, robot: FiveBar, measures: Measures, pictures: Sequence[Picture]) -> str:
    """Return the page: lengths and areas, the explained pictures, the Type 3 points."""
    return render(
        "map.html",
        name=name,
        setting=_lengths(robot),
        measures=measures,
        mode_rows=_mode_rows(measures),
        pictures=pictures,
        titles=TITLES,
        type3_rows=list(_type3_rows(measures)),
    )


def _lengths(robot: FiveBar) -> str:
    legs = (robot.leg1, robot.leg2)
    parts = [f"motors {1e3 * (robot.leg2.base_x - robot.leg1.base_x):.4g} mm apart"]
    parts += [
        f"leg {number}: {1e3 * leg.proximal:.4g} mm proximal, {1e3 * leg.distal:.4g} mm distal"
        for number, leg in enumerate(legs, start=1)
    ]
    return " · ".join(parts)


def _mode_rows(measures: Measures) -> Iterable[tuple[str, ...]]:
    for mode in measures.modes:
        yield (
            working_mode_label(mode.working_mode),
            f"{mode.area_positive:.1f} cm²",
            f"{mode.area_negative:.1f} cm²",
            f"{mode.length_stretched:.2f} cm",
            f"{mode.length_folded:.2f} cm",
        )


def _type3_rows(measures: Measures) -> Iterable[tuple[str, ...]]:
    for point in measures.type3:
        yield (
            _number(1e3 * point.x, 2),
            _number(1e3 * point.y, 2),
            _number(point.joints.q11, 4),
            _number(point.joints.q21, 4),
            f"leg {point.leg} {point.shape}, distal links {point.distal_links}",
            " ".join(working_mode_label(modes) for modes in point.working_modes),
        )


def _number(value: float, decimals: int) -> str:
    """Return a number with a proper minus sign, and none before a zero."""
    return f"{round(value, decimals) + 0.0:.{decimals}f}".replace("-", "−")
