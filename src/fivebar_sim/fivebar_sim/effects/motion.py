"""Motion of the robot with effects between two samples: one source for the plant in Python and for the compiled engine.

Each leg is a chain of two links with absolute angles q1 and theta, and half of the platform's mass at its tip. Both
tips are joined: rigidly by multipliers and a projection onto the closed loop, or by spring and damper. The proximal
link is the rotor, or is driven by one through an elastic transmission. Integration is classical Runge-Kutta of fourth
order; bristles and currents follow their exact solutions within a step.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from fivebar_sim.effects.encoders import EncoderReading, angle_seen_as, seen
from fivebar_sim.effects.friction import bristle_after, friction
from fivebar_sim.effects.loads import push_at
from fivebar_sim.effects.mechanism import LegNumbers, Mechanism
from fivebar_sim.effects.motors import current_after, motor_torque
from fivebar_sim.effects.platform_joint import Force, joint_force
from fivebar_sim.effects.timing import moments_after
from fivebar_sim.effects.transmission import transmitted

CLOSURE_TOLERANCE = 1e-9
"""Largest closure gap (m) of a rigid loop after one integration step; a step with a larger one is halved."""

MAX_HALVINGS = 6
WHOLE_STEP = 2**MAX_HALVINGS
"""Parts of a step, of which the shortest step is one."""

MAX_STRETCH = 0.01
"""Gap (m) of an elastic loop beyond which the simulation has diverged."""

NEWTON_STEPS = 30


class PerBody(NamedTuple):
    """A value (rad, rad/s or rad/s^2) for each body: both rotors, proximal links and distal links, absolute angles."""

    link1: float
    distal1: float
    link2: float
    distal2: float
    rotor1: float
    rotor2: float


ZERO = PerBody(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class Bristles(NamedTuple):
    """Deflections (rad) of the bristles in the five joints with friction."""

    motor1: float
    motor2: float
    elbow1: float
    elbow2: float
    platform: float


class MechanismState(NamedTuple):
    """The robot at a sample, or between two.

    Attributes:
        at, rate: angles and rates.
        bristles: their deflections.
        current1, current2: currents, as torques (Nm), at the last sample or change of torque.
        wanted1, wanted2: torques (Nm) that the drives are set to.
        read_at, read_rate: angles and rates when the encoders were read last.
    """

    at: PerBody
    rate: PerBody
    bristles: Bristles
    current1: float
    current2: float
    wanted1: float
    wanted2: float
    read_at: PerBody
    read_rate: PerBody


class Moved(NamedTuple):
    """A later state, and the gap (m) of the loop on the way; infinite where the motion cannot be simulated."""

    state: MechanismState
    gap: float


class JointMotion(NamedTuple):
    """The four joints, angles (rad) and rates (rad/s)."""

    q11: float
    q12: float
    q21: float
    q22: float
    dq11: float
    dq12: float
    dq21: float
    dq22: float


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


def chain(
    leg: LegNumbers,
    q1: float,
    theta: float,
    dq1: float,
    dtheta: float,
    torque: float,
    distal_torque: float,
    weight_x: float,
    weight_y: float,
    tip_mass: float,
) -> LegDynamics:
    """Return a leg under torques (Nm) on its links and weight (N/kg)."""
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
    right_distal = distal_torque - centrifugal * dq1 * dq1 + tip_mass * (jx_distal * weight_x + jy_distal * weight_y)
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


def closing_force(one: LegDynamics, two: LegDynamics, x: float, y: float) -> Force:
    """Return the force (N) on the tip of leg 1, its opposite on leg 2, that adds (x, y) to the tips' difference."""
    w_xx, w_xy, w_yy = one.xx + two.xx, one.xy + two.xy, one.yy + two.yy
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
    drive1 = motor_torque(leg1.motor, current1, motor1) - friction(leg1.motor_friction, bristles.motor1, speed1)
    drive2 = motor_torque(leg2.motor, current2, motor2) - friction(leg2.motor_friction, bristles.motor2, speed2)
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
    g_x, g_y, mass = mechanism.weight_x, mechanism.weight_y, mechanism.tip_mass
    one = chain(
        leg1, at.link1, at.distal1, rate.link1, rate.distal1, torque1 + elbow1, -elbow1 - between, g_x, g_y, mass
    )
    two = chain(
        leg2, at.link2, at.distal2, rate.link2, rate.distal2, torque2 + elbow2, between - elbow2, g_x, g_y, mass
    )
    push = push_at(mechanism.push, time, one.u_x, one.u_y)
    half_x, half_y = 0.5 * push.x, 0.5 * push.y
    if mechanism.compliant:
        joint = joint_force(
            mechanism.joint_stiffness,
            mechanism.joint_damping,
            mechanism.clearance,
            one.x - two.x,
            one.y - two.y,
            one.vx - two.vx,
            one.vy - two.vy,
        )
        joint = Force(-joint.x, -joint.y)
    else:
        joint = closing_force(
            one,
            two,
            two.ax - one.ax + (two.xx - one.xx) * half_x + (two.xy - one.xy) * half_y,
            two.ay - one.ay + (two.xy - one.xy) * half_x + (two.yy - one.yy) * half_y,
        )
    f1_x, f1_y, f2_x, f2_y = half_x + joint.x, half_y + joint.y, half_x - joint.x, half_y - joint.y
    link1 = one.link + one.link_x * f1_x + one.link_y * f1_y
    link2 = two.link + two.link_x * f2_x + two.link_y * f2_y
    return PerBody(
        link1,
        one.distal + one.distal_x * f1_x + one.distal_y * f1_y,
        link2,
        two.distal + two.distal_x * f2_x + two.distal_y * f2_y,
        rotor1 if elastic else link1,
        rotor2 if elastic else link2,
    )


def ahead(at: PerBody, rate: PerBody, time: float) -> PerBody:
    """Return values a time (s) later at constant rates."""
    return PerBody(
        at.link1 + time * rate.link1,
        at.distal1 + time * rate.distal1,
        at.link2 + time * rate.link2,
        at.distal2 + time * rate.distal2,
        at.rotor1 + time * rate.rotor1,
        at.rotor2 + time * rate.rotor2,
    )


def bristles_after(mechanism: Mechanism, bristles: Bristles, before: PerBody, after: PerBody, time: float) -> Bristles:
    """Return the bristles after a motion from angles to others (rad) in a time (s)."""
    leg1, leg2 = mechanism.leg1, mechanism.leg2
    link1, link2 = after.link1 - before.link1, after.link2 - before.link2
    distal1, distal2 = after.distal1 - before.distal1, after.distal2 - before.distal2
    motor1 = after.rotor1 - before.rotor1 if mechanism.elastic else link1
    motor2 = after.rotor2 - before.rotor2 if mechanism.elastic else link2
    return Bristles(
        bristle_after(leg1.motor_friction, bristles.motor1, motor1, time),
        bristle_after(leg2.motor_friction, bristles.motor2, motor2, time),
        bristle_after(leg1.elbow_friction, bristles.elbow1, distal1 - link1, time),
        bristle_after(leg2.elbow_friction, bristles.elbow2, distal2 - link2, time),
        bristle_after(mechanism.platform_friction, bristles.platform, distal1 - distal2, time),
    )


def stepped(
    mechanism: Mechanism,
    state: MechanismState,
    h: float,
    wanted1: float,
    wanted2: float,
    since: float,
    time: float,
) -> Moved:
    """Return the state one Runge-Kutta step of h (s) later.

    Args:
        mechanism: the robot.
        state: at the beginning of the step; its currents are those of the last sample.
        h: step (s).
        wanted1, wanted2: torques (Nm) that the drives are set to.
        since: time (s) since the last sample.
        time: time (s) since sample 0.
    """
    at, rate, bristles = state.at, state.rate, state.bristles
    stage_at, stage_rate, stage_bristles, reached = at, rate, bristles, 0.0
    rates = changes = ZERO
    # a loop, so that a compiler which puts all calls into one function does so once and not four times
    for stage in range(4):
        instant, band = since + reached, mechanism.bandwidth
        current1 = current_after(state.current1, wanted1, band, instant)
        current2 = current_after(state.current2, wanted2, band, instant)
        change = accelerations(mechanism, stage_at, stage_rate, stage_bristles, current1, current2, time + reached)
        weight = (1.0 if stage in (0, 3) else 2.0) / 6.0
        rates, changes = ahead(rates, stage_rate, weight), ahead(changes, change, weight)
        if stage == 3:
            reached, speed, change = h, rates, changes
        else:
            reached, speed = (h if stage == 2 else 0.5 * h), stage_rate
        stage_at, stage_rate = ahead(at, speed, reached), ahead(rate, change, reached)
        stage_bristles = bristles_after(mechanism, bristles, at, stage_at, reached)
    return closed(mechanism, _changed(state, stage_at, stage_rate, stage_bristles))


def _changed(state: MechanismState, at: PerBody, rate: PerBody, bristles: Bristles) -> MechanismState:
    current1, current2, wanted1, wanted2 = state.current1, state.current2, state.wanted1, state.wanted2
    return MechanismState(at, rate, bristles, current1, current2, wanted1, wanted2, state.read_at, state.read_rate)


def closed(mechanism: Mechanism, state: MechanismState) -> Moved:
    """Put a state back onto a rigid loop, as impulses at the tips would; an elastic one is only measured."""
    at, rate = state.at, state.rate
    one = chain(mechanism.leg1, at.link1, at.distal1, rate.link1, rate.distal1, 0.0, 0.0, 0.0, 0.0, 0.0)
    two = chain(mechanism.leg2, at.link2, at.distal2, rate.link2, rate.distal2, 0.0, 0.0, 0.0, 0.0, 0.0)
    gap_x, gap_y = one.x - two.x, one.y - two.y
    gap = math.sqrt(gap_x * gap_x + gap_y * gap_y)
    if mechanism.compliant:
        return Moved(state, gap)
    place = closing_force(one, two, -gap_x, -gap_y)
    speed = closing_force(one, two, two.vx - one.vx, two.vy - one.vy)
    at, rate = _pulled(mechanism, at, one, two, place), _pulled(mechanism, rate, one, two, speed)
    return Moved(_changed(state, at, rate, state.bristles), gap)


def _pulled(mechanism: Mechanism, values: PerBody, one: LegDynamics, two: LegDynamics, force: Force) -> PerBody:
    link1 = values.link1 + one.link_x * force.x + one.link_y * force.y
    link2 = values.link2 - two.link_x * force.x - two.link_y * force.y
    return PerBody(
        link1,
        values.distal1 + one.distal_x * force.x + one.distal_y * force.y,
        link2,
        values.distal2 - two.distal_x * force.x - two.distal_y * force.y,
        values.rotor1 if mechanism.elastic else link1,
        values.rotor2 if mechanism.elastic else link2,
    )


def advanced(mechanism: Mechanism, state: MechanismState, number: int, wanted1: float, wanted2: float) -> Moved:
    """Return the state one sample later under the torques (Nm) that the drives are set to from a sample on.

    They are obeyed, and the encoders read, when the delays say. The gap is infinite where the motion is too fast to be
    simulated.
    """
    obeyed, read = moments_after(mechanism.delays, number, mechanism.period)
    widest = reached = 0.0
    for part in range(4):
        if reached == obeyed:
            state = _driven(state, state.current1, state.current2, wanted1, wanted2)
        if reached == read:
            state = _read(state)
        if part == 3 or reached == mechanism.period:
            break
        end = mechanism.period
        for moment in (obeyed, read):
            if reached < moment < end:
                end = moment
        after = _moved(mechanism, state, number * mechanism.period + reached, end - reached)
        state, widest, reached = after.state, max(widest, after.gap), end
        if math.isinf(widest):
            break
    return Moved(state, widest)


def _read(state: MechanismState) -> MechanismState:
    current1, current2, wanted1, wanted2 = state.current1, state.current2, state.wanted1, state.wanted2
    return MechanismState(
        state.at, state.rate, state.bristles, current1, current2, wanted1, wanted2, state.at, state.rate
    )


def _driven(state: MechanismState, current1: float, current2: float, wanted1: float, wanted2: float) -> MechanismState:
    return MechanismState(
        state.at,
        state.rate,
        state.bristles,
        current1,
        current2,
        wanted1,
        wanted2,
        state.read_at,
        state.read_rate,
    )


def _moved(mechanism: Mechanism, state: MechanismState, begin: float, length: float) -> Moved:
    """Return the state a length (s) of a sample after a time (s), during which torques and encoders are left alone.

    A step that opens a rigid loop by more than the tolerance is repeated in halves. The gap is infinite where even the
    shortest steps exceed it, or where an elastic loop has come apart.
    """
    widest = 0.0
    wanted1, wanted2 = state.wanted1, state.wanted2
    steps = max(1, math.ceil(length / mechanism.step - 1e-9))
    whole = length / steps
    for step in range(steps):
        done, part = 0, WHOLE_STEP
        while done < WHOLE_STEP:
            since = whole * (step + done / WHOLE_STEP)
            after = stepped(mechanism, state, whole * part / WHOLE_STEP, wanted1, wanted2, since, begin + since)
            if after.gap <= (MAX_STRETCH if mechanism.compliant else CLOSURE_TOLERANCE):
                state = after.state
                widest = max(widest, after.gap)
                done += part
                while part < WHOLE_STEP and done % (2 * part) == 0:
                    part *= 2
            elif part > 1 and not mechanism.compliant:
                part //= 2
            else:
                return Moved(state, math.inf)
    current1 = current_after(state.current1, wanted1, mechanism.bandwidth, length)
    current2 = current_after(state.current2, wanted2, mechanism.bandwidth, length)
    return Moved(_driven(state, current1, current2, wanted1, wanted2), widest)


def resting(q11: float, q12: float, q21: float, q22: float) -> MechanismState:
    """Return a state at rest with relaxed springs and bristles, from joint angles (rad)."""
    at = PerBody(q11, q11 + q12, q21, q21 + q22, q11, q21)
    return MechanismState(at, ZERO, Bristles(0.0, 0.0, 0.0, 0.0, 0.0), 0.0, 0.0, 0.0, 0.0, at, ZERO)


def started(mechanism: Mechanism, q11: float, q12: float, q21: float, q22: float) -> Moved:
    """Return the robot at rest where its motor encoders read the angles (rad) of a modelled posture.

    The robot has been brought there by its encoders: the platform is off by what encoders and lengths are. The gap is
    what Newton's method has left of it; it is large where the legs cannot meet.
    """
    one, two = angle_seen_as(mechanism.leg1.disc, q11), angle_seen_as(mechanism.leg2.disc, q21)
    at = PerBody(one, q11 + q12, two, q21 + q22, one, two)
    leg1, leg2 = mechanism.leg1, mechanism.leg2
    gap = math.inf
    for _ in range(NEWTON_STEPS):
        c1, s1, c2, s2 = math.cos(at.distal1), math.sin(at.distal1), math.cos(at.distal2), math.sin(at.distal2)
        gap_x = leg1.base_x + leg1.proximal * math.cos(one) + leg1.distal * c1
        gap_x -= leg2.base_x + leg2.proximal * math.cos(two) + leg2.distal * c2
        gap_y = leg1.proximal * math.sin(one) + leg1.distal * s1 - leg2.proximal * math.sin(two) - leg2.distal * s2
        gap = math.sqrt(gap_x * gap_x + gap_y * gap_y)
        # l1 (-s1, c1) d1 - l2 (-s2, c2) d2 = -gap
        sine = c1 * s2 - s1 * c2
        if sine == 0.0:
            break
        d1 = -(gap_x * c2 + gap_y * s2) / (leg1.distal * sine)
        d2 = -(gap_x * c1 + gap_y * s1) / (leg2.distal * sine)
        at = PerBody(one, at.distal1 + d1, two, at.distal2 + d2, one, two)
    state = resting(one, at.distal1 - one, two, at.distal2 - two)
    return Moved(state, gap)


def joints_of(state: MechanismState) -> JointMotion:
    """Return the actual joints, on the links' side of the transmissions."""
    return _joints(state.at, state.rate)


def _joints(at: PerBody, rate: PerBody) -> JointMotion:
    return JointMotion(
        at.link1,
        at.distal1 - at.link1,
        at.link2,
        at.distal2 - at.link2,
        rate.link1,
        rate.distal1 - rate.link1,
        rate.link2,
        rate.distal2 - rate.link2,
    )


def motor_seen(mechanism: Mechanism, state: MechanismState) -> tuple[EncoderReading, EncoderReading]:
    """Return what the motors' encoders saw when they were read, on the rotors' side, before they count."""
    at, rate = state.read_at, state.read_rate
    return (
        seen(mechanism.leg1.disc, at.rotor1, rate.rotor1),
        seen(mechanism.leg2.disc, at.rotor2, rate.rotor2),
    )


def joints_seen(mechanism: Mechanism, state: MechanismState) -> JointMotion:
    """Return what encoders on all four joints saw: the motors' through their transmissions and errors."""
    exact = _joints(state.read_at, state.read_rate)
    one, two = motor_seen(mechanism, state)
    return JointMotion(one.angle, exact.q12, two.angle, exact.q22, one.speed, exact.dq12, two.speed, exact.dq22)


class ImuMotion(NamedTuple):
    """Motion of leg 2's tip, which carries the IMU.

    Attributes:
        along, across: acceleration less gravity (m/s^2), along the distal link and across it.
        rate, rate_change: of the distal link (rad/s, rad/s^2).
    """

    along: float
    across: float
    rate: float
    rate_change: float


def imu_motion(mechanism: Mechanism, state: MechanismState, time: float) -> ImuMotion:
    """Return the motion of the IMU's link at a time (s) after sample 0, under the currents up to it."""
    at, rate, leg = state.at, state.rate, mechanism.leg2
    change = accelerations(mechanism, at, rate, state.bristles, state.current1, state.current2, time)
    r_x, r_y = math.cos(at.link2), math.sin(at.link2)
    u_x, u_y = math.cos(at.distal2), math.sin(at.distal2)
    link, distal = rate.link2 * rate.link2, rate.distal2 * rate.distal2
    a_x = -leg.proximal * (r_y * change.link2 + r_x * link) - leg.distal * (u_y * change.distal2 + u_x * distal)
    a_y = leg.proximal * (r_x * change.link2 - r_y * link) + leg.distal * (u_x * change.distal2 - u_y * distal)
    a_x, a_y = a_x - mechanism.weight_x, a_y - mechanism.weight_y
    return ImuMotion(u_x * a_x + u_y * a_y, u_x * a_y - u_y * a_x, rate.distal2, change.distal2)


class Energy(NamedTuple):
    """Energies (J): of motion, and in springs and bristles."""

    kinetic: float
    elastic: float


def energy(mechanism: Mechanism, state: MechanismState) -> Energy:
    """Return the energy of a state."""
    at, rate, bristles = state.at, state.rate, state.bristles
    kinetic = elastic = 0.0
    ends = []
    for leg, q1, theta, dq1, dtheta, motor, speed, deflections in (
        (
            mechanism.leg1,
            at.link1,
            at.distal1,
            rate.link1,
            rate.distal1,
            at.rotor1,
            rate.rotor1,
            (bristles.motor1, bristles.elbow1),
        ),
        (
            mechanism.leg2,
            at.link2,
            at.distal2,
            rate.link2,
            rate.distal2,
            at.rotor2,
            rate.rotor2,
            (bristles.motor2, bristles.elbow2),
        ),
    ):
        cross = leg.coupling * math.cos(theta - q1)
        kinetic += 0.5 * (leg.inertia * dq1**2 + leg.distal_inertia * dtheta**2) + cross * dq1 * dtheta
        kinetic += 0.5 * leg.rotor * speed**2
        twist = max(0.0, abs(motor - q1) - mechanism.half_play) if mechanism.elastic else 0.0
        elastic += 0.5 * leg.stiffness * twist**2
        for curve, deflection in zip((leg.motor_friction, leg.elbow_friction), deflections, strict=True):
            elastic += 0.5 * curve.stiffness * deflection**2
        ends.append(chain(leg, q1, theta, dq1, dtheta, 0.0, 0.0, 0.0, 0.0, 0.0))
    elastic += 0.5 * mechanism.platform_friction.stiffness * bristles.platform**2
    stretch = max(0.0, math.hypot(ends[0].x - ends[1].x, ends[0].y - ends[1].y) - mechanism.clearance)
    elastic += 0.5 * mechanism.joint_stiffness * stretch**2
    return Energy(kinetic, elastic)
