"""The page of a map."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

from fivebar_bringup.pages.document import html_document
from fivebar_bringup.pages.picture import Picture, figure_html
from fivebar_bringup.pages.table import plain_table
from fivebar_bringup.studies.map.measures import Measures
from fivebar_bringup.studies.map.wording import mode_name
from fivebar_description.parameters import FiveBar

TITLES = {
    "postures": "The robot, and what is meant by singular",
    "assembly_modes": "Where the platform gets, and in which assembly mode",
    "conditioning": "How far from the Type 2 locus",
    "motor_modes": "Seen from the motors",
    "motor_conditioning": "How far from the Type 2 locus, seen from the motors",
}

MEASURED = ("working mode", "det A > 0", "det A < 0", "Type 2, distal links stretched", "Type 2, distal links folded")
TYPE3 = ("x in mm", "y in mm", "q₁₁ in rad", "q₂₁ in rad", "aligned", "working modes that meet there")


def html_page(name: str, robot: FiveBar, measures: Measures, pictures: Sequence[Picture]) -> str:
    """Return the page: lengths and areas, the explained pictures, the Type 3 points."""
    body = f"""\
<p>The platform gets to {measures.workspace_area:.1f} cm². The loop of links closes for
{100.0 * measures.closing_share:.1f} % of all pairs of motor angles.</p>
<h2>The four working modes</h2>
{plain_table(MEASURED, _mode_rows(measures))}
<p>Areas of both assembly modes, and lengths of the Type 2 locus that divides them. A working mode names the side of
each leg's elbow: +1 to the left on the way from the motor to the platform, −1 to the right.</p>
{_figures(pictures)}
<h2>Type 3 points</h2>
{_type3(measures)}"""
    return html_document(title=f"{name}: workspace and singularities", heading=name, setting=_lengths(robot), body=body)


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
            mode_name(mode.working_mode),
            f"{mode.area_positive:.1f} cm²",
            f"{mode.area_negative:.1f} cm²",
            f"{mode.length_stretched:.2f} cm",
            f"{mode.length_folded:.2f} cm",
        )


def _type3(measures: Measures) -> str:
    if not measures.type3:
        return "<p>This robot has none.</p>"
    rows = (
        (
            _number(1e3 * point.x, 2),
            _number(1e3 * point.y, 2),
            _number(point.joints.q11, 4),
            _number(point.joints.q21, 4),
            f"leg {point.leg} {point.shape}, distal links {point.distal_links}",
            " ".join(mode_name(modes) for modes in point.working_modes),
        )
        for point in measures.type3
    )
    return plain_table(TYPE3, rows)


def _number(value: float, decimals: int) -> str:
    """Return a number with a proper minus sign, and none before a zero."""
    return f"{round(value, decimals) + 0.0:.{decimals}f}".replace("-", "−")


def _figures(pictures: Sequence[Picture]) -> str:
    return "\n".join(
        f"<h2>{escape(TITLES[picture.name])}</h2>\n{figure_html(picture, TITLES[picture.name])}" for picture in pictures
    )
