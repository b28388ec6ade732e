"""The pictures of a map: drawn, named and explained."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from matplotlib.figure import Figure

from fivebar_bringup.pages.picture import Picture
from fivebar_bringup.pages.style import house_style, png
from fivebar_bringup.studies.map import figures
from fivebar_bringup.studies.map.figures import Survey

POSTURES = (
    "Two legs carry the platform. For one pair of motor angles there are two places for it: the assembly modes, told"
    " apart by the sign of det A. Type 1: a leg is stretched or folded, the platform cannot move along it, and the"
    " workspace ends here; the line is that end. Type 2: the distal links lie on one line, and no motor torque resists"
    " a motion across it, along the arrow; the purple line is all such places for the elbows as drawn. Type 3: a leg"
    " and the distal links are aligned at once."
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
    "The same seen from the motors: every point is a pair of motor angles, and both axes are periodic. In the grey"
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
