# SPDX-License-Identifier: Apache-2.0
"""The robot with its effects as numbers, and the integration step that they need."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from fivebar_description.parameters import FiveBar, LegParameters, scaled, with_floats
from fivebar_description.settings import as_numbers
from fivebar_description.strict_yaml import InputError
from fivebar_sim.effects.cable import Cable
from fivebar_sim.effects.encoders import EncoderDisc, disc_of
from fivebar_sim.effects.friction import FrictionCurve, curve_of
from fivebar_sim.effects.heating import Heating
from fivebar_sim.effects.links import axis_turn, bar_of, with_links
from fivebar_sim.effects.loads import Push, Shaking, shaking_of, weight_on
from fivebar_sim.effects.motors import Motor, motor_of
from fivebar_sim.effects.settings import PlantSettings
from fivebar_sim.effects.supply import Supply
from fivebar_sim.effects.timing import Delays, delays_of

MAX_STEP = 1e-3
"""Longest integration step (s). At 1 ms a free motion keeps its energy to 1e-10 over 10 s and the loop to 1e-13 m."""

OSCILLATION, DECAY = 0.5, 2.0
"""Bounds of step times rate: of the fastest oscillation, and of the fastest decay.

Classical Runge-Kutta of fourth order is stable up to 2.83 on the imaginary axis and 2.79 on the real one. It damps an
oscillation by a ratio of (w h)^5 / 144: at 0.5 that is 2e-4, a hundredth of what robots have.
"""

STREAM, LINE_STREAM = 2, 6
"""Streams of the random numbers that are the phases of ripple, cogging and eccentricity, and of interpolation."""


class LegNumbers(NamedTuple):
    """One leg.

    Attributes:
        base_x, proximal, distal: geometry (m).
        link, rotor: inertias (kg m^2) of the proximal link and of the rotor, which is 0 for a rigid transmission.
        inertia, coupling, distal_inertia: mass matrix of link and distal link about the absolute angles q1 and theta:
            [[inertia, coupling cos], [coupling cos, distal_inertia]] (kg m^2), with half of the platform at the tip.
        stiffness, damping: of the transmission (Nm/rad, Nm s/rad).
        moment, distal_moment: first mass moments (kg m) of the proximal link about the motor axis, and of the distal
            link about the elbow beyond that of the tip's mass.
        motor, motor_friction, elbow_friction, disc: see their modules.
    """

    base_x: float
    proximal: float
    distal: float
    link: float
    rotor: float
    inertia: float
    coupling: float
    distal_inertia: float
    stiffness: float
    damping: float
    moment: float
    distal_moment: float
    motor: Motor
    motor_friction: FrictionCurve
    elbow_friction: FrictionCurve
    disc: EncoderDisc


class Mechanism(NamedTuple):
    """The robot between two samples.

    Attributes:
        leg1, leg2: see `LegNumbers`.
        robot: the actual robot; its geometry determines where the platform is.
        step: longest integration step (s), of which a sample is a whole number.
        period: of the samples (s).
        elastic, compliant: whether the transmissions are elastic, and the loop; else they are rigid.
        half_play: half of the backlash (rad).
        tip_mass: mass (kg) at the tip of each leg, half of the platform's.
        joint_stiffness, joint_damping, clearance: of the loop (N/m, N s/m, m).
        platform_friction: between both distal links.
        bandwidth: of the current loops (rad/s), 0 for ideal ones.
        weight_x, weight_y: gravity in the plane (N/kg).
        force_x, force_y: constant force on the platform (N).
        shaking: of the base.
        push, cable, heating, supply: as numbers.
        delays: of commands and readings.
    """

    leg1: LegNumbers
    leg2: LegNumbers
    robot: FiveBar
    step: float
    period: float
    elastic: bool
    compliant: bool
    half_play: float
    tip_mass: float
    joint_stiffness: float
    joint_damping: float
    clearance: float
    platform_friction: FrictionCurve
    bandwidth: float
    weight_x: float
    weight_y: float
    force_x: float
    force_y: float
    shaking: Shaking
    push: Push
    cable: Cable
    heating: Heating
    supply: Supply
    delays: Delays


def actual_robot(robot: FiveBar, settings: PlantSettings) -> FiveBar:
    """Return the robot that a plant simulates in place of the modelled one: scaled, with its actual geometry."""
    scales = settings.mass_scale, settings.inertia_scale, settings.friction_scale
    return with_links(scaled(robot, *scales), settings.links)


def mechanism_of(robot: FiveBar, settings: PlantSettings, rate_hz: int) -> Mechanism:
    """Return a modelled robot with the effects of some settings.

    Raises:
        InputError: effects contradict each other.
    """
    _check(settings)
    actual = actual_robot(robot, settings)
    phases = np.random.default_rng([settings.seed, STREAM]).uniform(0.0, 2.0 * math.pi, (2, 3)).tolist()
    line_phases = np.random.default_rng([settings.seed, LINE_STREAM]).uniform(0.0, 2.0 * math.pi, 2).tolist()
    motors, joint = settings.motors, settings.platform_joint
    # the encoders were mounted in a frame from which the robot's is turned
    turn, encoders = axis_turn(robot, settings.links), settings.encoders
    encoders = encoders._replace(zero_1=encoders.zero_1 + turn, zero_2=encoders.zero_2 + turn)
    leg1, leg2 = (
        _leg(
            settings,
            leg,
            0.5 * actual.mass,
            motors.constant_1 if motor == 1 else motors.constant_2,
            phases[motor - 1][0],
            phases[motor - 1][1],
            disc_of(encoders, motor, settings.encoder_counts or 0, phases[motor - 1][2], line_phases[motor - 1]),
        )
        for motor, leg in enumerate(actual[:2], start=1)
    )
    passive = settings.friction.passive
    weight = weight_on(actual, settings.tilt)
    mechanism = Mechanism(
        leg1,
        leg2,
        with_floats(actual),
        step=1.0 / rate_hz,
        period=1.0 / rate_hz,
        elastic=settings.transmission.frequency > 0.0,
        compliant=joint.stiffness > 0.0,
        half_play=0.5 * settings.transmission.backlash,
        tip_mass=0.5 * actual.mass,
        joint_stiffness=float(joint.stiffness),
        # of both halves of the platform on the spring, with a reduced mass of a quarter of the platform's
        joint_damping=2.0 * joint.damping * math.sqrt(joint.stiffness * 0.25 * actual.mass),
        clearance=float(joint.clearance),
        platform_friction=curve_of(settings.friction, passive, 0.0, actual.leg1.width, 0.0),
        bandwidth=2.0 * math.pi * motors.current_loop_hz,
        weight_x=weight.x,
        weight_y=weight.y,
        force_x=float(actual.force_x),
        force_y=float(actual.force_y),
        shaking=shaking_of(settings.vibration, settings.seed),
        push=as_numbers(settings.push),
        cable=as_numbers(settings.cable),
        heating=as_numbers(settings.heating),
        supply=as_numbers(settings.supply),
        delays=delays_of(settings.timing, settings.seed, 1.0 / rate_hz),
    )
    steps = math.ceil(mechanism.period / longest_step(mechanism) - 1e-9)
    return mechanism._replace(step=mechanism.period / steps)


def _check(settings: PlantSettings) -> None:
    backlash, clearance = settings.transmission.backlash, settings.platform_joint.clearance
    if backlash > 0.0 and settings.transmission.frequency == 0.0:
        raise InputError(
            f"plant.transmission.backlash: {1e3 * backlash:g} mrad: backlash needs a transmission"
            " frequency: expected plant.transmission.frequency above 0, say 300 (Hz)"
        )
    if clearance > 0.0 and settings.platform_joint.stiffness == 0.0:
        raise InputError(
            f"plant.platform_joint.clearance: {clearance:g}: a joint that touches needs a stiffness: expected"
            " platform_joint.stiffness above 0, such as 1e6"
        )


def _leg(
    settings: PlantSettings,
    leg: LegParameters,
    tip_mass: float,
    constant_error: float,
    ripple_phase: float,
    cogging_phase: float,
    disc: EncoderDisc,
) -> LegNumbers:
    transmission, friction = settings.transmission, settings.friction
    share = transmission.rotor_share if transmission.frequency > 0.0 else 0.0
    link = (1.0 - share) * leg.inertia
    pulsation = 2.0 * math.pi * transmission.frequency
    bar = bar_of(settings.links, leg.distal)
    numbers = LegNumbers(
        base_x=float(leg.base_x),
        proximal=float(leg.proximal),
        distal=float(leg.distal),
        link=link,
        rotor=share * leg.inertia,
        inertia=link + (tip_mass + bar.mass) * leg.proximal**2,
        coupling=tip_mass * leg.proximal * leg.distal + bar.mass * bar.centre * leg.proximal,
        distal_inertia=tip_mass * leg.distal**2
        + (leg.residual + settings.links.distal_inertia + bar.inertia + bar.mass * bar.centre**2),
        stiffness=leg.inertia * pulsation**2,
        damping=2.0 * transmission.damping * leg.inertia * pulsation,
        moment=settings.tilt.leg_moment + leg.moment + bar.mass * leg.proximal,
        distal_moment=bar.mass * bar.centre,
        motor=motor_of(settings.motors, constant_error, ripple_phase, cogging_phase),
        motor_friction=curve_of(friction, float(leg.coulomb), float(leg.offset), float(leg.width), friction.viscous),
        elbow_friction=curve_of(friction, friction.passive, 0.0, float(leg.width), 0.0),
        disc=disc,
    )
    if numbers.distal_inertia <= 0.0 or numbers.inertia * numbers.distal_inertia <= numbers.coupling**2:
        raise InputError(
            f"plant.links.distal_inertia: {settings.links.distal_inertia:g} kg m^2 leaves a leg without positive"
            " inertia: expected less in magnitude"
            + (f", besides the model's {leg.residual:g} kg m^2" if leg.residual != 0.0 else "")
        )
    return numbers


def longest_step(mechanism: Mechanism) -> float:
    """Return the longest integration step (s) that all effects allow.

    Each spring adds at most k / m to the squared rate of the fastest oscillation, each damper d / m to that of the
    fastest decay, where 1 / m is the largest inverse inertia that its two ends have in any posture. The loop
    constrains, and only lowers them. The bristles are springs; beyond presliding they are solved exactly.
    """
    springs = dampers = tips = platform = 0.0
    hottest = 1.0 + max(0.0, mechanism.heating.change)
    for leg in (mechanism.leg1, mechanism.leg2):
        # the inverse of the mass matrix is largest with the leg stretched or folded
        determinant = leg.inertia * leg.distal_inertia - leg.coupling**2
        link, distal = leg.distal_inertia / determinant, leg.inertia / determinant
        elbow = link + 2.0 * leg.coupling / determinant + distal
        motor = 1.0 / leg.rotor if mechanism.elastic else link
        spring = leg.motor_friction.stiffness * motor + leg.elbow_friction.stiffness * elbow
        damper = hottest * leg.motor_friction.slope() * motor + leg.elbow_friction.slope() * elbow
        if mechanism.elastic:
            spring += leg.stiffness * (motor + link)
            damper += leg.damping * (motor + link)
        # what acts within one leg does not add to what acts within the other
        springs, dampers = max(springs, spring), max(dampers, damper)
        platform += distal
        # a tip moves at most as its own point mass does, less what a negative distal inertia takes away
        tips += 1.0 / min(mechanism.tip_mass, leg.distal_inertia / leg.distal**2)
    springs += mechanism.platform_friction.stiffness * platform + mechanism.cable.stiffness * tips
    dampers += mechanism.platform_friction.slope() * platform
    if mechanism.compliant:
        springs += mechanism.joint_stiffness * tips
        dampers += mechanism.joint_damping * tips
    bounds = [MAX_STEP, mechanism.period]
    if springs > 0.0:
        bounds.append(OSCILLATION / math.sqrt(springs))
    if mechanism.shaking.pulsation > 0.0:
        bounds.append(OSCILLATION / mechanism.shaking.pulsation)
    if dampers > 0.0:
        bounds.append(DECAY / dampers)
    return min(bounds)


def steps_of_period(robot: FiveBar, rate_hz: int) -> int:
    """Return the number of integration steps in a sample period of a robot without effects.

    Near rest friction is a damper of coulomb / width, and no motor has less inertia than zz_i1R.
    """
    period = 1.0 / rate_hz
    decay = max(leg.coulomb / leg.width / leg.inertia for leg in (robot.leg1, robot.leg2))
    longest = min(MAX_STEP, DECAY / decay) if decay > 0.0 else MAX_STEP
    return math.ceil(period / longest - 1e-9)
