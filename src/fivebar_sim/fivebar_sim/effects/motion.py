# SPDX-License-Identifier: Apache-2.0
"""Motion of the robot with effects between two samples: one source for the plant in Python and for the compiled engine.

Integration is classical Runge-Kutta of fourth order, and a rigid loop is projected onto its closure after each step;
bristles and currents follow their exact solutions within a step.
"""

from __future__ import annotations

import math

from fivebar_sim.effects.body_dynamics import UNLOADED, LegDynamics, LinkAngles, accelerations, chain, closing_force
from fivebar_sim.effects.encoders import EncoderReading, angle_seen_as, read_at
from fivebar_sim.effects.friction import bristle_after
from fivebar_sim.effects.heating import heat_after
from fivebar_sim.effects.mechanism import Mechanism
from fivebar_sim.effects.mechanism_state import ZERO, Bristles, MechanismState, Moved, PerBody
from fivebar_sim.effects.motors import current_after
from fivebar_sim.effects.platform_joint import Force
from fivebar_sim.effects.timing import moments_after

CLOSURE_TOLERANCE = 1e-9
"""Largest closure gap (m) of a rigid loop after one integration step; a step with a larger one is halved."""

MAX_HALVINGS = 6
WHOLE_STEP = 2**MAX_HALVINGS
"""Parts of a step, of which the shortest step is one."""

MAX_STRETCH = 0.01
"""Gap (m) of an elastic loop beyond which the simulation has diverged."""

NEWTON_STEPS = 30


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
        heat_after(mechanism.heating, leg1.motor_friction, bristles.heat1, motor1, time),
        heat_after(mechanism.heating, leg2.motor_friction, bristles.heat2, motor2, time),
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
    chain1 = chain(mechanism.leg1, LinkAngles(at.link1, at.distal1, rate.link1, rate.distal1), UNLOADED)
    chain2 = chain(mechanism.leg2, LinkAngles(at.link2, at.distal2, rate.link2, rate.distal2), UNLOADED)
    gap_x, gap_y = chain1.x - chain2.x, chain1.y - chain2.y
    gap = math.sqrt(gap_x * gap_x + gap_y * gap_y)
    if mechanism.compliant:
        return Moved(state, gap)
    place = closing_force(chain1, chain2, -gap_x, -gap_y)
    speed = closing_force(chain1, chain2, chain2.vx - chain1.vx, chain2.vy - chain1.vy)
    at, rate = _pulled(mechanism, at, chain1, chain2, place), _pulled(mechanism, rate, chain1, chain2, speed)
    return Moved(_changed(state, at, rate, state.bristles), gap)


def _pulled(mechanism: Mechanism, values: PerBody, chain1: LegDynamics, chain2: LegDynamics, force: Force) -> PerBody:
    link1 = values.link1 + chain1.link_x * force.x + chain1.link_y * force.y
    link2 = values.link2 - chain2.link_x * force.x - chain2.link_y * force.y
    return PerBody(
        link1,
        values.distal1 + chain1.distal_x * force.x + chain1.distal_y * force.y,
        link2,
        values.distal2 - chain2.distal_x * force.x - chain2.distal_y * force.y,
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
            state = _read(mechanism, state, (number + 1) * mechanism.period)
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


def _read(mechanism: Mechanism, state: MechanismState, time: float) -> MechanismState:
    """Return the state whose encoders have just been read for the sample at a time (s)."""
    at, rate, before, speed = state.at, state.rate, state.read_at, state.read_rate
    reading1 = read_at(mechanism.leg1.disc, at.rotor1, rate.rotor1, time, EncoderReading(before.rotor1, speed.rotor1))
    reading2 = read_at(mechanism.leg2.disc, at.rotor2, rate.rotor2, time, EncoderReading(before.rotor2, speed.rotor2))
    return MechanismState(
        at,
        rate,
        state.bristles,
        state.current1,
        state.current2,
        state.wanted1,
        state.wanted2,
        PerBody(at.link1, at.distal1, at.link2, at.distal2, reading1.angle, reading2.angle),
        PerBody(rate.link1, rate.distal1, rate.link2, rate.distal2, reading1.speed, reading2.speed),
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
    return MechanismState(at, ZERO, Bristles(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), 0.0, 0.0, 0.0, 0.0, at, ZERO)


def started(mechanism: Mechanism, q11: float, q12: float, q21: float, q22: float) -> Moved:
    """Return the robot at rest where its motor encoders read the angles (rad) of a modelled posture.

    The robot has been brought there by its encoders: the platform is off by what encoders and lengths are. The gap is
    what Newton's method has left of it; it is large where the legs cannot meet.
    """
    motor1, motor2 = angle_seen_as(mechanism.leg1.disc, q11), angle_seen_as(mechanism.leg2.disc, q21)
    at = PerBody(motor1, q11 + q12, motor2, q21 + q22, motor1, motor2)
    leg1, leg2 = mechanism.leg1, mechanism.leg2
    gap = math.inf
    for _ in range(NEWTON_STEPS):
        c1, s1, c2, s2 = math.cos(at.distal1), math.sin(at.distal1), math.cos(at.distal2), math.sin(at.distal2)
        gap_x = leg1.base_x + leg1.proximal * math.cos(motor1) + leg1.distal * c1
        gap_x -= leg2.base_x + leg2.proximal * math.cos(motor2) + leg2.distal * c2
        gap_y = (
            leg1.proximal * math.sin(motor1) + leg1.distal * s1 - leg2.proximal * math.sin(motor2) - leg2.distal * s2
        )
        gap = math.sqrt(gap_x * gap_x + gap_y * gap_y)
        # l1 (-s1, c1) d1 - l2 (-s2, c2) d2 = -gap
        sine = c1 * s2 - s1 * c2
        if sine == 0.0:
            break
        d1 = -(gap_x * c2 + gap_y * s2) / (leg1.distal * sine)
        d2 = -(gap_x * c1 + gap_y * s1) / (leg2.distal * sine)
        at = PerBody(motor1, at.distal1 + d1, motor2, at.distal2 + d2, motor1, motor2)
    return Moved(_read(mechanism, resting(motor1, at.distal1 - motor1, motor2, at.distal2 - motor2), -1.0), gap)
