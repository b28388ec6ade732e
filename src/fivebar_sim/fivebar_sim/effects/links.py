# SPDX-License-Identifier: Apache-2.0
"""Actual link lengths, bases, and mass and inertia of the distal links."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from fivebar_description.parameters import FiveBar, LegParameters
from fivebar_description.settings import Setting
from fivebar_description.strict_yaml import InputError


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
    distal_mass: Annotated[
        float,
        Setting(
            "Mass of each distal link that the model does not have, as a uniform bar; typical: 0.005 to 0.02.",
            "kg",
            at_least=0.0,
            at_most=100.0,
        ),
    ] = 0.0
    distal_centre: Annotated[
        float,
        Setting(
            "Where its centre is, as a share of the link from the elbow on; 0.5 for a bar as long as the link.",
            at_least=-1.0,
            at_most=2.0,
        ),
    ] = 0.5
    base_rise: Annotated[
        float,
        Setting(
            "Motor axis 2 above the x axis, on which motor axis 1 is, in the plane; typical: 2e-5 to 5e-4. The x axis"
            " of the simulated robot then goes through both, and the encoders' zeros are off by the angle to it.",
            "m",
            at_least=-0.01,
            at_most=0.01,
        ),
    ] = 0.0
    base_height: Annotated[
        float,
        Setting(
            "Leg 2 above leg 1, across the plane: each distal link climbs half of it and is shorter in the plane;"
            " typical: 1e-4 to 2e-3.",
            "m",
            at_least=0.0,
            at_most=0.1,
        ),
    ] = 0.0


def with_modelled_geometry(links: LinkErrors) -> LinkErrors:
    """Return what a robot's links have besides errors of its geometry: mass and inertia."""
    return LinkErrors(
        distal_inertia=links.distal_inertia, distal_mass=links.distal_mass, distal_centre=links.distal_centre
    )


class DistalBar(NamedTuple):
    """The part of a distal link that its model lacks: mass (kg), its centre from the elbow (m), inertia about it
    (kg m^2)."""

    mass: float
    centre: float
    inertia: float


def bar_of(links: LinkErrors, distal: float) -> DistalBar:
    """Return the uniform bar that a distal link of a length (m) has besides its model."""
    mass = float(links.distal_mass)
    return DistalBar(mass, links.distal_centre * distal, mass * distal**2 / 12.0)


def axis_turn(robot: FiveBar, links: LinkErrors) -> float:
    """Return by how much (rad) the line through both motor axes is turned against the modelled robot's x axis."""
    return math.atan2(links.base_rise, _apart(robot, links)) if links.base_rise != 0.0 else 0.0


def _apart(robot: FiveBar, links: LinkErrors) -> float:
    """Return the distance of the motor axes along the modelled x axis (m)."""
    return robot.leg2.base_x + links.base_2 - (robot.leg1.base_x + links.base_1)


def with_links(robot: FiveBar, links: LinkErrors) -> FiveBar:
    """Return the robot with its actual lengths and bases (m), in the frame through both motor axes.

    Raises:
        InputError: a distal link is too short to climb.
    """
    apart, turn = _apart(robot, links), axis_turn(robot, links)
    further = math.hypot(apart, links.base_rise) - abs(apart)

    def leg(nominal: LegParameters, base: float, proximal: float, distal: float) -> LegParameters:
        flat = nominal.distal + distal
        if links.base_height > 0.0:
            flat = _flat(flat, 0.5 * links.base_height)
        return nominal._replace(base_x=nominal.base_x + base, proximal=nominal.proximal + proximal, distal=flat)

    # what acts all the time is given along the modelled axes
    gravity_x, gravity_y = _turned(robot.gravity_x, robot.gravity_y, -turn)
    force_x, force_y = _turned(robot.force_x, robot.force_y, -turn)
    return robot._replace(
        leg1=leg(robot.leg1, links.base_1, links.l_11, links.l_12),
        leg2=leg(robot.leg2, links.base_2 + further, links.l_21, links.l_22),
        gravity_x=gravity_x,
        gravity_y=gravity_y,
        force_x=force_x,
        force_y=force_y,
    )


def _flat(length: float, climbed: float) -> float:
    """Return the length (m) in the plane of a link that climbs by some (m)."""
    if climbed >= length:
        raise InputError(
            f"plant.links.base_height: {2.0 * climbed:g}: distal links of {length:g} m cannot climb half of it:"
            f" expected below {2.0 * length:g}"
        )
    return math.sqrt(length * length - climbed * climbed)


def _turned(x: float, y: float, angle: float) -> tuple[float, float]:
    """Return a vector that is turned by an angle (rad)."""
    return math.cos(angle) * x - math.sin(angle) * y, math.sin(angle) * x + math.cos(angle) * y


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
