# SPDX-License-Identifier: Apache-2.0
"""Parameters of a five-bar robot, the plain numbers that the equations take: lengths, inertias, mass and friction.

Friction (1.32) is that of the model and of the plant alike, with sign() smoothed so that it has a value at rest. What a
motor loses besides, to cogging that is known and to the weight of its leg, is of the model alone.
"""

from __future__ import annotations

import math
from typing import NamedTuple

MOST_PAYLOAD = 1000.0
"""Mass (kg) beyond which a payload is a mistake."""


class LegParameters(NamedTuple):
    """Leg i of the robot: base O_i = (base_x, 0), proximal link l_i1, distal link l_i2.

    Units: m, kg m^2, Nm. `inertia` is zz_i1R about the motor axis; friction is 1.32 with sign smoothed to
    tanh(qdot / width), width in rad/s. `residual` is zz_i2R, the inertia of the distal link beyond that of its two
    point masses at elbow and platform; negative for most links. `moment` (kg m) is the first mass moment about the
    motor axis, of the proximal link with the distal link's mass at the elbow; it counts where gravity acts.

    `cosine_n` and `sine_n` (Nm) are the torque that compensates the motor's cogging of `periods_n` in a turn,
    0 for none. Controllers and estimators know it; a simulated robot cogs by its own settings alone.
    """

    base_x: float
    proximal: float
    distal: float
    inertia: float
    coulomb: float
    offset: float
    width: float
    residual: float = 0.0
    moment: float = 0.0
    periods_1: float = 0.0
    cosine_1: float = 0.0
    sine_1: float = 0.0
    periods_2: float = 0.0
    cosine_2: float = 0.0
    sine_2: float = 0.0


HARMONICS = LegParameters._fields[-6:]
"""The fields that are cogging."""


class FiveBar(NamedTuple):
    """The grouped parameters: two legs and the platform mass m (kg); without residuals the thesis' reduced model.

    What acts all the time is gravity in the robot's plane (m/s^2) and a constant force on the platform (N), both along
    the axes of the base; 0 for a level robot that nothing pulls.
    """

    leg1: LegParameters
    leg2: LegParameters
    mass: float
    gravity_x: float = 0.0
    gravity_y: float = 0.0
    force_x: float = 0.0
    force_y: float = 0.0


def has_external_force(robot: FiveBar) -> bool:
    """Return whether gravity or a constant force acts in the robot's plane."""
    return robot.gravity_x != 0.0 or robot.gravity_y != 0.0 or robot.force_x != 0.0 or robot.force_y != 0.0


def has_residual(robot: FiveBar) -> bool:
    """Return whether a distal link has a residual inertia."""
    return robot.leg1.residual != 0.0 or robot.leg2.residual != 0.0


def without_external_force(robot: FiveBar) -> FiveBar:
    """Return a robot on which nothing acts all the time."""
    return robot._replace(gravity_x=0.0, gravity_y=0.0, force_x=0.0, force_y=0.0)


def external_force(robot: FiveBar) -> tuple[float, float]:
    """Return w_e (N), the force on the platform that no leg exerts: its weight in the plane and the constant force."""
    return robot.mass * robot.gravity_x + robot.force_x, robot.mass * robot.gravity_y + robot.force_y


def external_acceleration(robot: FiveBar) -> tuple[float, float]:
    """Return w_e / m (m/s^2), how the platform would accelerate without legs."""
    return robot.gravity_x + robot.force_x / robot.mass, robot.gravity_y + robot.force_y / robot.mass


def with_floats(robot: FiveBar) -> FiveBar:
    """Return a robot whose numbers are floats throughout: an integer among them is another type to the compiler."""
    leg1, leg2, *rest = robot
    return FiveBar(LegParameters(*map(float, leg1)), LegParameters(*map(float, leg2)), *map(float, rest))


def laden(robot: FiveBar, payload: float) -> FiveBar:
    """Return a robot whose platform carries a payload (kg), which counts as mass of the platform."""
    return robot._replace(mass=robot.mass + payload)


def geometry_only(robot: FiveBar) -> FiveBar:
    """Return a robot with the same base and lengths, without mass, inertia, friction, cogging and external force."""
    leg1, leg2 = (
        LegParameters(leg.base_x, leg.proximal, leg.distal, inertia=0.0, coulomb=0.0, offset=0.0, width=1.0)
        for leg in (robot.leg1, robot.leg2)
    )
    return FiveBar(leg1, leg2, mass=0.0)


def without_cogging(robot: FiveBar) -> FiveBar:
    """Return a robot of which no cogging is known."""
    leg1, leg2 = (leg._replace(**dict.fromkeys(HARMONICS, 0.0)) for leg in (robot.leg1, robot.leg2))
    return robot._replace(leg1=leg1, leg2=leg2)


def tip_masses(robot: FiveBar, share: float = 0.5) -> tuple[float, float]:
    """Return shares of the mass m (kg) that, at the end of each distal link, give each leg alone a kinetic energy.

    They are the same share of m, without residual inertias; a distal link that has less inertia than its two point
    masses needs some mass beforehand.

    Args:
        robot: its parameters.
        share: of either leg in what is not needed beforehand, at most a half.

    Raises:
        ValueError: the residual inertias are so negative that no bodies can have these parameters.
    """
    needed = []
    for number, leg in enumerate((robot.leg1, robot.leg2), start=1):
        # of the inertia matrix of (dq_i1, dtheta_i) for parallel links, where its determinant is least
        held = leg.inertia * leg.distal**2 + leg.proximal**2 * leg.residual
        if held <= 0.0:
            raise ValueError(_no_body(number, leg))
        needed.append(max(0.0, -leg.inertia * leg.residual / held))
    spare = robot.mass - needed[0] - needed[1]
    if spare < 0.0:
        raise ValueError(_no_body(1, robot.leg1) if needed[0] >= needed[1] else _no_body(2, robot.leg2))
    return needed[0] + share * spare, needed[1] + share * spare


def _no_body(number: int, leg: LegParameters) -> str:
    return (
        f"inertias_kg_m2.zz_{number}2R: {leg.residual:g}: no bodies have these parameters: expected less in magnitude"
        f" for zz_{number}1R = {leg.inertia:g} kg m^2 and this m"
    )


def scaled(robot: FiveBar, mass: float = 1.0, inertia: float = 1.0, friction: float = 1.0) -> FiveBar:
    """Return the robot with its mass, inertias and friction multiplied: a plant with parameter errors."""

    def leg(nominal: LegParameters) -> LegParameters:
        return nominal._replace(
            inertia=nominal.inertia * inertia,
            coulomb=nominal.coulomb * friction,
            offset=nominal.offset * friction,
            residual=nominal.residual * inertia,
        )

    return robot._replace(leg1=leg(robot.leg1), leg2=leg(robot.leg2), mass=robot.mass * mass)


def friction_torque(leg: LegParameters, dq1: float) -> float:
    """Return f = f_s tanh(dq1 / width) + f_off in Nm, for the motor speed dq1 in rad/s."""
    return leg.coulomb * math.tanh(dq1 / leg.width) + leg.offset


def weight_torque(robot: FiveBar, leg: LegParameters, r_x: float, r_y: float) -> float:
    """Return the torque (Nm) that holds the weight of a leg, its proximal link along the unit vector (r_x, r_y)."""
    return leg.moment * (robot.gravity_x * r_y - robot.gravity_y * r_x)


def lost_torque(robot: FiveBar, leg: LegParameters, q1: float, dq1: float) -> float:
    """Return friction, known cogging and the leg's weight in Nm, for a motor angle q1 in rad and speed dq1 in rad/s."""
    lost = friction_torque(leg, dq1)
    if leg.periods_1 > 0.0:
        lost += leg.cosine_1 * math.cos(leg.periods_1 * q1) + leg.sine_1 * math.sin(leg.periods_1 * q1)
    if leg.periods_2 > 0.0:
        lost += leg.cosine_2 * math.cos(leg.periods_2 * q1) + leg.sine_2 * math.sin(leg.periods_2 * q1)
    if leg.moment != 0.0:
        lost += weight_torque(robot, leg, math.cos(q1), math.sin(q1))
    return lost


def friction_slope(leg: LegParameters, dq1: float) -> float:
    """Return df / d(dq1) in Nm s/rad, for the motor speed dq1 in rad/s."""
    smooth = math.tanh(dq1 / leg.width)
    return leg.coulomb * (1.0 - smooth * smooth) / leg.width


def largest_friction(robot: FiveBar) -> float:
    """Return the most friction (Nm) that either motor of a robot has, at whatever speed."""
    return max(leg.coulomb + abs(leg.offset) for leg in (robot.leg1, robot.leg2))
