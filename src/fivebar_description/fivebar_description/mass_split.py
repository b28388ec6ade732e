# SPDX-License-Identifier: Apache-2.0
"""Masses of the robot's bodies that add up to the grouped parameters of the reduced model.

A robot file has two inertias zz_i1R, two residual inertias zz_i2R and one mass m, since these are all that a motion
shows. They are sums over bodies: a distal link that moves like two points, m_e at the elbow and m_t at the platform,
with an inertia zz_i2R besides, adds m_e l_i1^2 to zz_i1R and m_t to m. Any positive m_e and m_t that leave the link a
positive inertia and the other bodies a positive rest therefore move like the model; the shares below are a plausible
choice, not a measurement.

A robot file may have the distal links as they were weighed. Then the other bodies have the rest, so that the
grouped parameters stay what they are; zz_i2R is taken to be that of the weighed links. A file with all links in place
of the grouped parameters needs no split: its bodies are those.
"""

from __future__ import annotations

from typing import NamedTuple

from fivebar_description.parameters import FiveBar, LegParameters, tip_masses
from fivebar_description.robot_file import DistalLink, DistalLinks, Links, ProximalLink
from fivebar_description.strict_yaml import InputError

TIP_SHARE = 0.25
"""Share of the platform mass m that belongs to the end of each distal link."""

ELBOW_SHARE = 0.25
"""Largest share of zz_i1R that the mass at the elbow accounts for, where a residual inertia does not need more."""

SLENDER = 3.0
"""Mass at the elbow over the least one that a residual inertia needs: that of a slender bar."""

PROXIMAL_SHARE = 0.5
"""Largest share of the rest of zz_i1R that the proximal link's mass accounts for; what remains is the rotor."""

PLATFORM_SHARE = 0.1
"""Largest share of the distal link's inertia that the end effector's own inertia accounts for."""


class Body(NamedTuple):
    """A body in the plane: mass (kg), centre of mass along its x axis (m), inertia about z at that centre (kg m^2)."""

    mass: float
    centre: float
    inertia: float


class MassSplit(NamedTuple):
    """The moving bodies; those of a leg are (leg 1, leg 2). Each frame is at the link's first joint, x along the link.

    The platform, fixed to the distal link of leg 2, has its frame at the platform point.
    """

    proximal: tuple[Body, Body]
    distal: tuple[Body, Body]
    platform: Body


def split_masses(robot: FiveBar, platform_radius: float, weighed: Links | DistalLinks | None = None) -> MassSplit:
    """Return positive masses and inertias that move like the reduced model.

    Args:
        robot: its parameters.
        platform_radius: of the end effector, a cylinder (m).
        weighed: the distal links, or all bodies, where they are known.

    Raises:
        InputError: the weighed links are more than the grouped parameters have.
    """
    if isinstance(weighed, Links):
        near, far, effector = weighed
        return MassSplit(
            (_weighed(near.leg_1), _weighed(near.leg_2)),
            (_weighed(far.leg_1), _weighed(far.leg_2)),
            Body(effector.mass_kg, 0.0, effector.inertia_kg_m2),
        )
    if weighed is not None:
        return _split_around(robot, platform_radius, (weighed.leg_1, weighed.leg_2))
    tips = tip_masses(robot, TIP_SHARE)
    elbows = (_elbow_mass(robot.leg1, tips[0]), _elbow_mass(robot.leg2, tips[1]))
    distal1, distal2 = (_two_points(*leg) for leg in zip(robot[:2], elbows, tips, strict=True))
    platform = _platform(robot.mass - (tips[0] + tips[1]), platform_radius, distal2)
    return MassSplit(
        (_proximal(robot.leg1, elbows[0], tips[0]), _proximal(robot.leg2, elbows[1], tips[1])),
        # the end effector turns with the link, so its inertia is part of the link's
        (distal1, distal2._replace(inertia=distal2.inertia - platform.inertia)),
        platform,
    )


def _split_around(robot: FiveBar, platform_radius: float, weighed: tuple[DistalLink, DistalLink]) -> MassSplit:
    links = [_weighed(link) for link in weighed]
    rest, proximal = robot.mass, []
    for number, (leg, link) in enumerate(zip(robot[:2], links, strict=True), start=1):
        key = f"distal_links.leg_{number}"
        if link.centre > leg.distal:
            raise InputError(f"{key}.centre_m: {link.centre}: expected at most the length of the link, {leg.distal} m")
        tip = link.mass * link.centre / leg.distal
        elbow = link.mass - tip
        if elbow * leg.proximal**2 >= leg.inertia:
            raise InputError(f"{key}: at the elbow it weighs more than all of zz_{number}1R, {leg.inertia} kg m^2")
        rest -= tip
        proximal.append(_proximal(leg, elbow, TIP_SHARE * robot.mass))
    if rest <= 0.0:
        raise InputError(f"distal_links: at the platform they weigh more than all of m, {robot.mass} kg")
    return MassSplit((proximal[0], proximal[1]), (links[0], links[1]), _platform(rest, platform_radius, links[1]))


def _weighed(link: ProximalLink | DistalLink) -> Body:
    return Body(link.mass_kg, link.centre_m, link.inertia_kg_m2)


def _elbow_mass(leg: LegParameters, tip: float) -> float:
    largest = leg.inertia / leg.proximal**2
    plain = min(tip, ELBOW_SHARE * largest)
    lacking = -leg.residual / leg.distal**2
    if lacking <= 0.0:
        return plain
    least = lacking * tip / (tip - lacking)
    return max(plain, min(SLENDER * least, 0.5 * (least + largest)))


def _two_points(leg: LegParameters, elbow: float, tip: float) -> Body:
    mass = elbow + tip
    return Body(mass, tip / mass * leg.distal, elbow * tip / mass * leg.distal**2 + leg.residual)


def _platform(mass: float, radius: float, link: Body) -> Body:
    return Body(mass, 0.0, min(0.5 * mass * radius**2, PLATFORM_SHARE * link.inertia))


def _proximal(leg: LegParameters, elbow: float, largest: float) -> Body:
    """Return the proximal link with the rotor, which have what the mass at the elbow leaves of zz_i1R."""
    rest = leg.inertia - elbow * leg.proximal**2
    centre = 0.5 * leg.proximal
    mass = min(largest, PROXIMAL_SHARE * rest / centre**2)
    return Body(mass, centre, rest - mass * centre**2)
