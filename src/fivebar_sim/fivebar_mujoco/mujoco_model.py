# SPDX-License-Identifier: Apache-2.0
"""The robot as a MuJoCo model: rigid bodies, transmissions and an equality that closes the loop.

The equations of `effects/body_dynamics.py` are not used here. The robot file groups the masses of a leg: an inertia
about the motor's axis, and half of the platform's mass at the tip. Bodies are made that have these, an inertia of the
distal link beyond its point masses included.
"""

from __future__ import annotations

import math
from typing import NamedTuple
from xml.sax.saxutils import escape

from fivebar_description.parameters import FiveBar, LegParameters
from fivebar_description.strict_yaml import InputError
from fivebar_sim.effects.links import DistalBar, bar_of
from fivebar_sim.effects.loads import weight_on
from fivebar_sim.effects.mechanism import actual_robot
from fivebar_sim.effects.settings import PlantSettings

TINY_INERTIA = 1e-12
"""kg m^2. MuJoCo refuses bodies without inertia where the parameters have none: 1e-10 of the motors'."""

TINY_MASS = 1e-9
"""kg, of a body that turns about its centre of mass."""

QUOTE = {'"': "&quot;"}

NO_BAR = DistalBar(0.0, 0.0, 0.0)

PIN_SHARE = 0.1
"""Share of the mass at the tip of leg 1 that an elastic loop gives to the pin of leg 2, to which that tip is fixed."""


class Lump(NamedTuple):
    """A rigid body: mass (kg), its place along the link (m) and the inertia about it (kg m^2)."""

    mass: float
    place: float
    inertia: float

    def with_another(self, other: Lump) -> Lump:
        """Return both as one body."""
        mass = self.mass + other.mass
        apart = self.mass * other.mass / mass * (self.place - other.place) ** 2
        place = (self.mass * self.place + other.mass * other.place) / mass
        return Lump(mass, place, self.inertia + other.inertia + apart)

    def inertial(self) -> str:
        """Return the element; the inertias about the axes that nothing turns about do not matter."""
        inertia = repr(self.inertia)
        return f'<inertial pos="{self.place!r} 0 0" mass="{self.mass!r}" diaginertia="{inertia} {inertia} {inertia}"/>'


class LegLinks(NamedTuple):
    """Both links of a leg."""

    proximal: Lump
    distal: Lump


def links_of(
    leg: LegParameters, inertia: float, tip_mass: float, extra: float, moment: float, bar: DistalBar = NO_BAR
) -> LegLinks:
    """Return the links of a leg as bodies.

    A distal link whose inertia is less than that of its point masses has some of its mass at the elbow, which the
    parameters count to the proximal link: from there it is taken, so that the sums stay what they are.

    Args:
        leg: its lengths.
        inertia: of the proximal link, with the distal link's mass at the elbow (kg m^2).
        tip_mass: at the tip (kg).
        extra: inertia of the distal link beyond its point masses (kg m^2).
        moment: first mass moment of the proximal link, with the distal link's mass at the elbow (kg m).
        bar: what the distal link has besides.
    """
    elbow = 0.0
    if extra < 0.0:
        lacking = -extra / leg.distal**2
        if lacking >= tip_mass:
            raise _no_inertia(extra)
        least, most = lacking * tip_mass / (tip_mass - lacking), inertia / leg.proximal**2
        if least >= most:
            raise _no_inertia(extra)
        # three times the least is a slender bar
        elbow = min(3.0 * least, 0.5 * (least + most))
    reduced = elbow * tip_mass / (elbow + tip_mass)
    distal = Lump(
        elbow + tip_mass,
        leg.distal * tip_mass / (elbow + tip_mass),
        max(TINY_INERTIA, reduced * leg.distal**2 + extra),
    )
    if bar.mass > 0.0:
        distal = distal.with_another(Lump(*bar))
    about_axis, first = inertia - elbow * leg.proximal**2, moment - elbow * leg.proximal
    if first == 0.0:
        return LegLinks(Lump(TINY_MASS, 0.0, about_axis), distal)
    # any mass will do whose moment is right: the base carries it
    arm = min(0.5 * leg.proximal, 0.5 * about_axis / abs(first))
    return LegLinks(Lump(abs(first) / arm, math.copysign(arm, first), about_axis - abs(first) * arm), distal)


def _no_inertia(extra: float) -> InputError:
    return InputError(
        f"plant.links.distal_inertia: {extra:g} kg m^2 leaves a leg without positive inertia: expected less in"
        " magnitude"
    )


class Details(NamedTuple):
    """Elements that a model has besides the mechanism. They change nothing about its motion but by `friction`.

    Attributes:
        name: of the model.
        friction: attributes of the motors' joints (leg 1, leg 2).
        fixed: elements of the world.
        proximal: elements of the proximal links (leg 1, leg 2).
        distal: elements of the distal links (leg 1, leg 2).
        sections: further sections.
        gravity: across the plane (m/s^2).
    """

    name: str = "fivebar"
    friction: tuple[str, str] = ("", "")
    fixed: str = ""
    proximal: tuple[str, str] = ("", "")
    distal: tuple[str, str] = ("", "")
    sections: str = ""
    gravity: float = 0.0


BARE = Details()
"""The mechanism only."""


def mjcf_text(robot: FiveBar, settings: PlantSettings, step: float, details: Details = BARE) -> str:
    """Return the mechanism as MJCF: hinges for rotors and links, springs as tendons, tips that are connected.

    Motor i is the hinge mi of an elastic transmission, else qi1. Friction other than viscous, and what drives and loads
    do, are forces that the simulation applies.

    Args:
        robot: as modelled.
        settings: how the simulated one differs.
        step: of the integration (s). The loop is closed with the shortest time constant that MuJoCo takes, two steps.
        details: further elements.

    Raises:
        InputError: the bodies cannot be.
    """
    actual = actual_robot(robot, settings)
    weight = weight_on(actual, settings.tilt)
    transmission, joint = settings.transmission, settings.platform_joint
    elastic, compliant = transmission.frequency > 0.0, joint.stiffness > 0.0
    share = transmission.rotor_share if elastic else 0.0
    pulsation = 2.0 * math.pi * transmission.frequency
    half_mass, half_play = 0.5 * actual.mass, 0.5 * transmission.backlash
    # the damper of a transmission with play acts between flanks that touch alone, which no tendon's does
    ratio = transmission.damping if half_play == 0.0 else 0.0
    damping = f'damping="{settings.friction.viscous!r}"'
    pin_mass = PIN_SHARE * half_mass if compliant else 0.0
    bodies = tendons = ""
    for number, leg in enumerate((actual.leg1, actual.leg2), start=1):
        links = links_of(
            leg,
            (1.0 - share) * leg.inertia,
            half_mass - pin_mass if number == 1 else half_mass,
            leg.residual + settings.links.distal_inertia,
            settings.tilt.leg_moment + leg.moment,
            bar_of(settings.links, leg.distal),
        )
        if elastic:
            bodies += f"""
    <body pos="{leg.base_x!r} 0 0">
      <joint name="m{number}" axis="0 0 1" {damping}/>
      {Lump(TINY_MASS, 0.0, share * leg.inertia).inertial()}
    </body>"""
            tendons += f"""
    <fixed name="t{number}" stiffness="{leg.inertia * pulsation**2!r}" springlength="{-half_play!r} {half_play!r}"
           damping="{2.0 * ratio * leg.inertia * pulsation!r}">
      <joint joint="m{number}" coef="1"/><joint joint="q{number}1" coef="-1"/>
    </fixed>"""
        tip = f'<site name="tip_{number}" pos="{leg.distal!r} 0 0"/>'
        if number == 2 and compliant:
            # the reduced mass of both halves of the platform is a quarter of it
            damper = 2.0 * joint.damping * math.sqrt(joint.stiffness * 0.25 * actual.mass)
            spring = f'type="slide" stiffness="{joint.stiffness!r}" damping="{damper!r}"'
            tip += f"""
        <body name="pin" pos="{leg.distal!r} 0 0">
          <joint name="pin_x" axis="1 0 0" {spring}/><joint name="pin_y" axis="0 1 0" {spring}/>
          {Lump(pin_mass, 0.0, TINY_INERTIA).inertial()}
          <site name="pin"/>
        </body>"""
        bodies += f"""
    <body name="proximal_{number}" pos="{leg.base_x!r} 0 0">
      <joint name="q{number}1" axis="0 0 1" {"" if elastic else damping}{details.friction[number - 1]}/>
      {links.proximal.inertial()}{details.proximal[number - 1]}
      <body name="distal_{number}" pos="{leg.proximal!r} 0 0">
        <joint name="q{number}2" axis="0 0 1"/>
        {links.distal.inertial()}{details.distal[number - 1]}
        {tip}
      </body>
    </body>"""
    return f"""<mujoco model="{escape(details.name, QUOTE)}">
  <option timestep="{step!r}" integrator="RK4" gravity="{weight.x!r} {weight.y!r} {details.gravity!r}">
    <flag contact="disable" autoreset="disable"/>
  </option>
  <worldbody>{details.fixed}{bodies}
  </worldbody>
  <tendon>{tendons}
  </tendon>
  <equality>
    <connect site1="tip_1" site2="{"pin" if compliant else "tip_2"}" solref="{2.0 * step!r} 1"
             solimp="0.9999 0.9999 0.001 0.5 2"/>
  </equality>{details.sections}
</mujoco>
"""
