# SPDX-License-Identifier: Apache-2.0
"""Dynamics of the robot with effects: accelerations of its bodies under currents, friction, weight and pushes.

Each leg is a chain of two links with absolute angles q1 and theta, and half of the platform's mass at its tip. Both
tips are joined: rigidly by multipliers, or by spring and damper. The proximal link is the rotor, or is driven by one
through an elastic transmission.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from fivebar_sim.effects.cable import cable_force
from fivebar_sim.effects.friction import friction
from fivebar_sim.effects.heating import hot_share
from fivebar_sim.effects.loads import felt_weight, push_at
from fivebar_sim.effects.mechanism import LegNumbers, Mechanism
from fivebar_sim.effects.mechanism_state import Bristles, PerBody
from fivebar_sim.effects.motors import motor_torque
from fivebar_sim.effects.platform_joint import Force, joint_force
from fivebar_sim.effects.supply import supplied_share
from fivebar_sim.effects.transmission import transmitted


class LegDynamics(NamedTuple):
    """One leg at an instant.

    Attributes:
        x, y, vx, vy: its tip (m, m/s).
        ax, ay: acceleration of the free tip (m/s^2).
        link, distal: accelerations of the free links (rad/s^2).
        link_x, link_y, distal_x, distal_y: how much a force of 1 N on the tip along x or y adds to them.
        u_x, u_y: direction of the distal link.
        xx, xy, yy: compliance of the tip to forces (1/kg).
    """

    x: float
    y: float
    vx: float
    vy: float
    ax: float
    ay: float
    link: float
    distal: float
    link_x: float
    link_y: float
    distal_x: float
    distal_y: float
    u_x: float
    u_y: float
    xx: float
    xy: float
    yy: float


class LinkAngles(NamedTuple):
    """The absolute angles of a leg's links (rad), and their rates (rad/s)."""

    q1: float
    theta: float
    dq1: float
    dtheta: float


class LegLoad(NamedTuple):
    """Torques on the links of a leg (Nm), weight (N/kg), and the mass at its tip (kg)."""

    torque: float
    distal_torque: float
    weight_x: float
    weight_y: float
    tip_mass: float


UNLOADED = LegLoad(0.0, 0.0, 0.0, 0.0, 0.0)


def chain(leg: LegNumbers, angles: LinkAngles, load: LegLoad) -> LegDynamics:
    """Return a leg as it moves under a load."""
    q1, theta, dq1, dtheta = angles
    torque, distal_torque, weight_x, weight_y, tip_mass = load
    r_x, r_y, u_x, u_y = math.cos(q1), math.sin(q1), math.cos(theta), math.sin(theta)
    cos, sin = r_x * u_x + r_y * u_y, r_x * u_y - r_y * u_x
    # columns of the tip's Jacobian
    jx_link, jy_link = -leg.proximal * r_y, leg.proximal * r_x
    jx_distal, jy_distal = -leg.distal * u_y, leg.distal * u_x
    m12 = leg.coupling * cos
    inverse = 1.0 / (leg.inertia * leg.distal_inertia - m12 * m12)
    n11, n12, n22 = leg.distal_inertia * inverse, -m12 * inverse, leg.inertia * inverse
    centrifugal = leg.coupling * sin
    right_link = (
        torque
        + centrifugal * dtheta * dtheta
        + tip_mass * (jx_link * weight_x + jy_link * weight_y)
        + leg.moment * (r_x * weight_y - r_y * weight_x)
    )
    right_distal = (
        distal_torque
        - centrifugal * dq1 * dq1
        + tip_mass * (jx_distal * weight_x + jy_distal * weight_y)
        + leg.distal_moment * (u_x * weight_y - u_y * weight_x)
    )
    link, distal = n11 * right_link + n12 * right_distal, n12 * right_link + n22 * right_distal
    link_x, link_y = n11 * jx_link + n12 * jx_distal, n11 * jy_link + n12 * jy_distal
    distal_x, distal_y = n12 * jx_link + n22 * jx_distal, n12 * jy_link + n22 * jy_distal
    return LegDynamics(
        x=leg.base_x + leg.proximal * r_x + leg.distal * u_x,
        y=leg.proximal * r_y + leg.distal * u_y,
        vx=jx_link * dq1 + jx_distal * dtheta,
        vy=jy_link * dq1 + jy_distal * dtheta,
        ax=jx_link * link + jx_distal * distal - leg.proximal * r_x * dq1 * dq1 - leg.distal * u_x * dtheta * dtheta,
        ay=jy_link * link + jy_distal * distal - leg.proximal * r_y * dq1 * dq1 - leg.distal * u_y * dtheta * dtheta,
        link=link,
        distal=distal,
        link_x=link_x,
        link_y=link_y,
        distal_x=distal_x,
        distal_y=distal_y,
        u_x=u_x,
        u_y=u_y,
        xx=jx_link * link_x + jx_distal * distal_x,
        xy=jx_link * link_y + jx_distal * distal_y,
        yy=jy_link * link_y + jy_distal * distal_y,
    )


def closing_force(chain1: LegDynamics, chain2: LegDynamics, x: float, y: float) -> Force:
    """Return the force (N) on the tip of leg 1, its opposite on leg 2, that adds (x, y) to the tips' difference."""
    w_xx, w_xy, w_yy = chain1.xx + chain2.xx, chain1.xy + chain2.xy, chain1.yy + chain2.yy
    inverse = 1.0 / (w_xx * w_yy - w_xy * w_xy)
    return Force(inverse * (w_yy * x - w_xy * y), inverse * (w_xx * y - w_xy * x))


def accelerations(
    mechanism: Mechanism, at: PerBody, rate: PerBody, bristles: Bristles, current1: float, current2: float, time: float
) -> PerBody:
    """Return the accelerations (rad/s^2) under currents (as torques, Nm) at a time (s) after sample 0."""
    leg1, leg2 = mechanism.leg1, mechanism.leg2
    elastic = mechanism.elastic
    motor1, motor2 = (at.rotor1, at.rotor2) if elastic else (at.link1, at.link2)
    speed1, speed2 = (rate.rotor1, rate.rotor2) if elastic else (rate.link1, rate.link2)
    share = supplied_share(mechanism.supply, current1, speed1, current2, speed2)
    hot1, hot2 = hot_share(mechanism.heating, bristles.heat1), hot_share(mechanism.heating, bristles.heat2)
    drive1 = motor_torque(leg1.motor, share * current1, motor1)
    drive2 = motor_torque(leg2.motor, share * current2, motor2)
    drive1 -= hot1 * friction(leg1.motor_friction, bristles.motor1, speed1)
    drive2 -= hot2 * friction(leg2.motor_friction, bristles.motor2, speed2)
    rotor1 = rotor2 = 0.0
    torque1, torque2 = drive1, drive2
    if elastic:
        play = mechanism.half_play
        torque1 = transmitted(leg1.stiffness, leg1.damping, play, motor1 - at.link1, speed1 - rate.link1)
        torque2 = transmitted(leg2.stiffness, leg2.damping, play, motor2 - at.link2, speed2 - rate.link2)
        rotor1, rotor2 = (drive1 - torque1) / leg1.rotor, (drive2 - torque2) / leg2.rotor
    elbow1 = friction(leg1.elbow_friction, bristles.elbow1, rate.distal1 - rate.link1)
    elbow2 = friction(leg2.elbow_friction, bristles.elbow2, rate.distal2 - rate.link2)
    between = friction(mechanism.platform_friction, bristles.platform, rate.distal1 - rate.distal2)
    weight, mass = felt_weight(mechanism.shaking, mechanism.weight_x, mechanism.weight_y, time), mechanism.tip_mass
    load1 = LegLoad(torque1 + elbow1, -elbow1 - between, weight.x, weight.y, mass)
    load2 = LegLoad(torque2 + elbow2, between - elbow2, weight.x, weight.y, mass)
    chain1 = chain(leg1, LinkAngles(at.link1, at.distal1, rate.link1, rate.distal1), load1)
    chain2 = chain(leg2, LinkAngles(at.link2, at.distal2, rate.link2, rate.distal2), load2)
    push = push_at(mechanism.push, time, chain1.u_x, chain1.u_y)
    pull = cable_force(mechanism.cable, 0.5 * (chain1.x + chain2.x), 0.5 * (chain1.y + chain2.y))
    half_x = 0.5 * (push.x + pull.x + mechanism.force_x)
    half_y = 0.5 * (push.y + pull.y + mechanism.force_y)
    if mechanism.compliant:
        joint = joint_force(
            mechanism.joint_stiffness,
            mechanism.joint_damping,
            mechanism.clearance,
            chain1.x - chain2.x,
            chain1.y - chain2.y,
            chain1.vx - chain2.vx,
            chain1.vy - chain2.vy,
        )
        joint = Force(-joint.x, -joint.y)
    else:
        joint = closing_force(
            chain1,
            chain2,
            chain2.ax - chain1.ax + (chain2.xx - chain1.xx) * half_x + (chain2.xy - chain1.xy) * half_y,
            chain2.ay - chain1.ay + (chain2.xy - chain1.xy) * half_x + (chain2.yy - chain1.yy) * half_y,
        )
    f1_x, f1_y, f2_x, f2_y = half_x + joint.x, half_y + joint.y, half_x - joint.x, half_y - joint.y
    link1 = chain1.link + chain1.link_x * f1_x + chain1.link_y * f1_y
    link2 = chain2.link + chain2.link_x * f2_x + chain2.link_y * f2_y
    return PerBody(
        link1,
        chain1.distal + chain1.distal_x * f1_x + chain1.distal_y * f1_y,
        link2,
        chain2.distal + chain2.distal_x * f2_x + chain2.distal_y * f2_y,
        rotor1 if elastic else link1,
        rotor2 if elastic else link2,
    )
