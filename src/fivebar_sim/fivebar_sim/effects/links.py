"""Actual link lengths, bases and the inertia of the distal links."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from fivebar_description.parameters import FiveBar, LegParameters
from fivebar_description.settings import Setting


def _longer(what: str) -> Setting:
    return Setting(
        f"{what}, actual minus modelled; typical: 2e-5 calibrated, 2e-4 as machined.", "m", at_least=-0.01, at_most=0.01
    )


class LinkErrors(NamedTuple):
    """The robot's geometry and what its reduced model leaves out of the links.

    The model of a leg lumps a distal link into two point masses at its ends. A link is a rigid body besides: its
    inertia about its centre less that of the two points.
    """

    l_11: Annotated[float, _longer("Proximal link of leg 1")] = 0.0
    l_12: Annotated[float, _longer("Distal link of leg 1")] = 0.0
    l_21: Annotated[float, _longer("Proximal link of leg 2")] = 0.0
    l_22: Annotated[float, _longer("Distal link of leg 2")] = 0.0
    base_1: Annotated[float, _longer("x of motor axis 1")] = 0.0
    base_2: Annotated[float, _longer("x of motor axis 2")] = 0.0
    distal_inertia: Annotated[
        float,
        Setting(
            "Inertia of each distal link beyond its point masses, negative for a slender bar, whose is -m l^2 / 6;"
            " typical: -7e-5 for 50 g of 90 mm.",
            "kg m^2",
            at_least=-0.1,
            at_most=0.1,
        ),
    ] = 0.0


def with_links(robot: FiveBar, links: LinkErrors) -> FiveBar:
    """Return the robot with its actual lengths and bases (m)."""

    def leg(one: LegParameters, base: float, proximal: float, distal: float) -> LegParameters:
        return one._replace(base_x=one.base_x + base, proximal=one.proximal + proximal, distal=one.distal + distal)

    return FiveBar(
        leg(robot.leg1, links.base_1, links.l_11, links.l_12),
        leg(robot.leg2, links.base_2, links.l_21, links.l_22),
        robot.mass,
    )


def with_another_model(links: LinkErrors, before: FiveBar, after: FiveBar) -> LinkErrors:
    """Return the errors of the same actual robot where its model was one robot, and is another."""
    return links._replace(
        l_11=links.l_11 + before.leg1.proximal - after.leg1.proximal,
        l_12=links.l_12 + before.leg1.distal - after.leg1.distal,
        l_21=links.l_21 + before.leg2.proximal - after.leg2.proximal,
        l_22=links.l_22 + before.leg2.distal - after.leg2.distal,
        base_1=links.base_1 + before.leg1.base_x - after.leg1.base_x,
        base_2=links.base_2 + before.leg2.base_x - after.leg2.base_x,
    )
