"""The page of a map."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from fivebar_bringup.pages.picture import Picture
from fivebar_bringup.pages.rendering import render
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
            mode_name(mode.working_mode),
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
            " ".join(mode_name(modes) for modes in point.working_modes),
        )


def _number(value: float, decimals: int) -> str:
    """Return a number with a proper minus sign, and none before a zero."""
    return f"{round(value, decimals) + 0.0:.{decimals}f}".replace("-", "−")
