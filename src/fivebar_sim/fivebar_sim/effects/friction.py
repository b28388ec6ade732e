# SPDX-License-Identifier: Apache-2.0
"""Friction of motors and passive joints: LuGre with the Stribeck curve and a viscous term, tanh as its limit.

LuGre (Canudas de Wit et al., 1995): f = s0 z + s1 zdot + s2 v with zdot = v - s0 |v| / g(v) z, where z is the mean
deflection of the bristles and g(v) = f_c + (f_s - f_c) exp(-(v / v_s)^2). Steady sliding gives f = g(v) sgn(v) + s2 v;
near rest it is a spring of stiffness s0. The equation of z has a time constant of g / (s0 |v|), microseconds in motion:
no explicit step is stable there. For a constant velocity it is linear, so each step solves it exactly with the step's
mean velocity, z(h) = z e^-x + dq (1 - e^-x) / x with x = s0 |dq| / g and the displacement dq. At small x that is
z + dq, so presliding is integrated by Runge-Kutta to its own order; at large x it is the steady value g sgn(v) / s0.
"""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from fivebar_description.settings import Setting

LEAST_PRESLIDING = 1e-9
"""Deflection (rad) below which a bristle has no finite stiffness."""


def _none_or_elastic(deflection: float) -> str | None:
    sound = deflection == 0.0 or deflection >= LEAST_PRESLIDING
    return None if sound else f"expected 0, or at least {LEAST_PRESLIDING:g} rad"


class FrictionEffects(NamedTuple):
    """How friction differs from the robot file's Coulomb friction, which is smoothed by tanh and the same at any speed.

    Motor and passive joints share the shape of the curve. With a transmission, motor friction acts on the rotor.
    """

    stribeck: Annotated[
        float,
        Setting("Break-away over Coulomb friction; typical: 1.1 to 1.5 for greased gears.", at_least=1.0, at_most=10.0),
    ] = 1.0
    stribeck_speed: Annotated[
        float,
        Setting(
            "Speed at which the excess of break-away friction has fallen to 1/e; typical: 0.05 to 0.5.",
            "rad/s",
            at_least=1e-3,
            at_most=100.0,
        ),
    ] = 0.1
    viscous: Annotated[
        float,
        Setting("Viscous friction of each motor; typical: 0.005 to 0.05.", "Nm s/rad", at_least=0.0, at_most=10.0),
    ] = 0.0
    presliding: Annotated[
        float,
        Setting(
            "Elastic deflection at which sliding friction is reached (LuGre), 0 for friction by tanh; typical: 1e-4 to"
            " 1e-3 at a joint.",
            "rad",
            at_least=0.0,
            at_most=0.1,
            check=_none_or_elastic,
        ),
    ] = 0.0
    presliding_damping: Annotated[
        float,
        Setting("Damping of the presliding deflection; typical: 0 to 1.", "Nm s/rad", at_least=0.0, at_most=100.0),
    ] = 0.0
    passive: Annotated[
        float,
        Setting(
            "Coulomb friction of each of the three passive joints; typical: 0.003 for ball bearings, 0.02 preloaded.",
            "Nm",
            at_least=0.0,
            at_most=10.0,
        ),
    ] = 0.0


class FrictionCurve(NamedTuple):
    """Friction of one joint as numbers.

    Attributes:
        coulomb, breakaway: levels f_c and f_s of the Stribeck curve (Nm).
        speed: v_s (rad/s).
        viscous: s2 (Nm s/rad).
        offset: constant torque (Nm).
        width: of tanh (rad/s).
        stiffness: s0 (Nm/rad), 0 for tanh.
        damping: s1 (Nm s/rad).
    """

    coulomb: float
    breakaway: float
    speed: float
    viscous: float
    offset: float
    width: float
    stiffness: float
    damping: float

    def slope(self) -> float:
        """Return a bound of the damping (Nm s/rad) that the curve has at any speed."""
        return self.viscous + (self.damping if self.stiffness > 0.0 else self.breakaway / self.width)


def curve_of(effects: FrictionEffects, coulomb: float, offset: float, width: float, viscous: float) -> FrictionCurve:
    """Return the friction of a joint with Coulomb friction and offset (Nm), width (rad/s), viscous term (Nm s/rad)."""
    breakaway = effects.stribeck * coulomb
    stiffness = coulomb / effects.presliding if effects.presliding > 0.0 else 0.0
    return FrictionCurve(
        coulomb,
        breakaway,
        effects.stribeck_speed,
        viscous,
        offset,
        width,
        stiffness,
        effects.presliding_damping if stiffness > 0.0 else 0.0,
    )


def stribeck(curve: FrictionCurve, speed: float) -> float:
    """Return the level g(v) of sliding friction (Nm) at a speed (rad/s)."""
    if curve.breakaway == curve.coulomb:
        return curve.coulomb
    ratio = speed / curve.speed
    return curve.coulomb + (curve.breakaway - curve.coulomb) * math.exp(-ratio * ratio)


def bristle_after(curve: FrictionCurve, bristle: float, moved: float, time: float) -> float:
    """Return the deflection (rad) after the joint has moved so far (rad) at constant speed in a time (s)."""
    if curve.stiffness == 0.0:
        return 0.0
    if time == 0.0:
        return bristle
    x = curve.stiffness * abs(moved) / stribeck(curve, moved / time)
    share = 1.0 if x == 0.0 else -math.expm1(-x) / x
    return bristle * math.exp(-x) + moved * share


def sliding_friction(curve: FrictionCurve, speed: float) -> float:
    """Return the size of steady sliding friction (Nm) at a speed (rad/s), without the offset."""
    return stribeck(curve, speed) * abs(math.tanh(speed / curve.width)) + curve.viscous * abs(speed)


def friction(curve: FrictionCurve, bristle: float, speed: float) -> float:
    """Return the friction torque (Nm) against a speed (rad/s)."""
    level = stribeck(curve, speed)
    if curve.stiffness > 0.0:
        slip = speed - curve.stiffness * abs(speed) / level * bristle
        sliding = curve.stiffness * bristle + curve.damping * slip
    else:
        sliding = level * math.tanh(speed / curve.width)
    return sliding + curve.viscous * speed + curve.offset
