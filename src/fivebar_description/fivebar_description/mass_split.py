"""Masses of the robot's bodies that add up to the grouped parameters of the reduced model.

A parameter file has two inertias zz_i1R and one mass m, since these are all that a motion shows. They are sums over
bodies: a distal link whose inertia is that of two points, m_e at the elbow and m_t at the platform, adds m_e l_i1^2 to
zz_i1R and m_t to m, and nothing else. Any positive m_e and m_t that leave the other bodies a positive rest therefore
move like the reduced model; the shares below are a plausible choice, not a measurement.
"""

from __future__ import annotations

from typing import NamedTuple

from fivebar_description.parameters import FiveBar, LegParameters

TIP_SHARE = 0.25
"""Share of the platform mass m that belongs to the end of each distal link."""

ELBOW_SHARE = 0.25
"""Largest share of zz_i1R that the mass at the elbow makes up."""

PROXIMAL_SHARE = 0.5
"""Largest share of the rest of zz_i1R that the proximal link's mass makes up; what remains is the rotor."""

PLATFORM_SHARE = 0.1
"""Largest share of the distal link's inertia that the end effector's own inertia makes up."""


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


def split_masses(robot: FiveBar, platform_radius: float) -> MassSplit:
    """Return positive masses and inertias that move like the reduced model.

    Args:
        robot: its parameters.
        platform_radius: of the end effector, a cylinder (m).
    """
    tip = TIP_SHARE * robot.mass
    platform_mass = robot.mass - 2.0 * tip
    one, two = (_distal(leg, tip) for leg in (robot.leg1, robot.leg2))
    spin = min(0.5 * platform_mass * platform_radius**2, PLATFORM_SHARE * two.inertia)
    return MassSplit(
        (_proximal(robot.leg1, tip), _proximal(robot.leg2, tip)),
        # the end effector turns with the link, so its inertia is part of the link's
        (one, two._replace(inertia=two.inertia - spin)),
        Body(platform_mass, 0.0, spin),
    )


def _elbow_mass(leg: LegParameters, tip: float) -> float:
    return min(tip, ELBOW_SHARE * leg.inertia / leg.proximal**2)


def _distal(leg: LegParameters, tip: float) -> Body:
    elbow = _elbow_mass(leg, tip)
    mass = elbow + tip
    return Body(mass, tip / mass * leg.distal, elbow * tip / mass * leg.distal**2)


def _proximal(leg: LegParameters, tip: float) -> Body:
    rest = leg.inertia - _elbow_mass(leg, tip) * leg.proximal**2
    centre = 0.5 * leg.proximal
    mass = min(tip, PROXIMAL_SHARE * rest / centre**2)
    return Body(mass, centre, rest - mass * centre**2)
