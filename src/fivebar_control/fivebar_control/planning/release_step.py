# SPDX-License-Identifier: Apache-2.0
"""A release from the Type 2 locus, sample by sample: rest, drive, press, hold, decide, let go.

The motors follow angles that move the elbows off the locus at a steady pace, with the torque that friction and the
press need at most. Meanwhile both assembly modes are kept as hypotheses: from the encoders each says by how much the
distal link of leg 2 has turned, and the gyroscope says by how much it has. When the elbows are where the two are far
apart, the one that the gyroscope contradicts is dropped. Without a gyroscope the platform is driven to a known side
before. Every limit that is met ends it with zero torque.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from fivebar_control.laws.torque import ZERO, Torque
from fivebar_control.model.geometry import direct_geometry, elbow_position, wrap
from fivebar_control.planning.release_drive import NO_DRIVE, ReleaseDrive, behind, drive_torque, state_at
from fivebar_description.parameters import FiveBar

RESTING, DRIVING, PRESSING, HOLDING, EASING, RELEASED = 0, 1, 2, 3, 4, 5
"""Phases of a release that goes on as planned."""

TOO_FAST, TOO_FAR, STUCK, UNDECIDED, NO_GYROSCOPE, NOT_AT_REST = 6, 7, 8, 9, 10, 11
"""How it ends otherwise."""

ENDINGS = {
    RELEASED: "released",
    TOO_FAST: "too_fast: a motor or the distal link of leg 2 turned faster than a release may",
    TOO_FAR: "too_far: a motor turned by more than a release may take",
    STUCK: "stuck: the largest torque has not moved the elbows off the locus",
    UNDECIDED: "undecided: by the gyroscope the robot is in neither assembly mode rather than in the other",
    NO_GYROSCOPE: "no_gyroscope: no reading of the gyroscope came while the robot rested",
    NOT_AT_REST: "not_at_rest: a motor or the distal link of leg 2 moved before the release",
}
"""Ends of a release, in words."""

REST_TIME, STALL_TIME, HOLD_TIME, EASE_TIME = 0.3, 1.0, 0.25, 0.2
"""Times (s): of the rest in which the gyroscope's bias is found, at the largest torque without getting there, of
holding still before the decision, and in which the torque is let go."""

BEGIN_TIME = 0.1
"""Time (s) in which the friction's torque is fed forward."""

SPEED_TIME = 0.004
"""Time constant (s) of the low-pass on the motors' speeds."""

REST_ANGLE, REST_RATE = 0.01, 0.5
"""Largest turn of a motor (rad) and largest difference of the gyroscope's readings (rad/s) while the robot rests."""

LATE = 0.1
"""Share of a drive by which the motors may be late at its end."""

UNSURE, UNFIT = 0.03, 0.25
"""Least lead (rad) of one hypothesis over the other in fitting the gyroscope, and its largest own error: at rest
the platform may have been beside the line, or not quite where it was said to be."""


class Release(NamedTuple):
    """A release as numbers.

    Attributes:
        robot: as modelled.
        period: between two samples (s).
        q11, q21: motor angles at rest (rad).
        per_way1, per_way2: how far the motors turn for each metre of the elbows' way off the locus (rad/m).
        way: of the elbows (m).
        pace: at which they are moved (m/s).
        kp1, kp2, kd1, kd2: with which the motors follow (Nm/rad, Nm s/rad).
        offset1, offset2: friction of the motors at rest (Nm).
        friction1, friction2: what they lose besides on the way (Nm), fed forward so that both begin to turn together.
        cap1, cap2: largest torques (Nm).
        travel: of a motor (rad) at which it is given up.
        motor_speed, link_rate: of a motor and of the distal link of leg 2 (rad/s), likewise.
        start: angle of the distal link of leg 2 at rest (rad).
        drive: of the platform along v_1 before the elbows are moved, without a gyroscope.
    """

    robot: FiveBar
    period: float
    q11: float
    q21: float
    per_way1: float
    per_way2: float
    way: float
    pace: float
    kp1: float
    kp2: float
    kd1: float
    kd2: float
    offset1: float
    offset2: float
    friction1: float
    friction2: float
    cap1: float
    cap2: float
    travel: float
    motor_speed: float
    link_rate: float
    start: float
    drive: ReleaseDrive = NO_DRIVE


class ReleaseMemory(NamedTuple):
    """State of a release from sample to sample.

    Attributes:
        phase: one of the phases or ends.
        left: time (s) that the phase may still last.
        asked: how far (m) the elbows have been asked to move.
        base1, base2: motor angles from which the elbows are moved (rad).
        last1, last2: motor angles of the sample before (rad).
        speed1, speed2: low-passed speeds of the motors (rad/s).
        readings, total: of the gyroscope while it rested: how many, and their sum (rad/s).
        rate: last reading of the gyroscope (rad/s), NaN before the first.
        turned: angle (rad) by which the distal link of leg 2 has turned by the gyroscope.
        misfit_plus, misfit_minus: by how much (rad) that contradicts the assembly modes + and -.
        assembly: the one that is left, 0 while both are possible.
        fastest_motor, fastest_link: so far (rad/s).
    """

    phase: int
    left: float
    asked: float
    base1: float
    base2: float
    last1: float
    last2: float
    speed1: float
    speed2: float
    readings: int
    total: float
    rate: float
    turned: float
    misfit_plus: float
    misfit_minus: float
    assembly: int
    fastest_motor: float
    fastest_link: float


def first_memory(release: Release) -> ReleaseMemory:
    """Return the memory before the first sample."""
    return ReleaseMemory(
        phase=RESTING,
        left=REST_TIME,
        asked=0.0,
        base1=release.q11,
        base2=release.q21,
        last1=release.q11,
        last2=release.q21,
        speed1=0.0,
        speed2=0.0,
        readings=0,
        total=0.0,
        rate=math.nan,
        turned=0.0,
        misfit_plus=0.0,
        misfit_minus=0.0,
        assembly=0,
        fastest_motor=0.0,
        fastest_link=0.0,
    )


def has_ended(memory: ReleaseMemory) -> bool:
    """Return whether a release has come to one of its ends."""
    return memory.phase >= RELEASED


def distal_angle(robot: FiveBar, assembly: int, q11: float, q21: float) -> float:
    """Return the angle (rad) of the distal link of leg 2 in an assembly mode, NaN where the links cannot meet."""
    x, y = direct_geometry(robot, assembly, q11, q21)
    e_x, e_y = elbow_position(robot.leg2, q21)
    return math.atan2(y - e_y, x - e_x)


def release_step(
    release: Release, memory: ReleaseMemory, q11: float, q21: float, rate: float
) -> tuple[Torque, ReleaseMemory]:
    """Return the torque (Nm) of a sample and the memory for the next one.

    Args:
        release: as numbers.
        memory: of the sample before.
        q11, q21: motor angles (rad).
        rate: reading of the gyroscope on the distal link of leg 2 that has come since (rad/s): NaN for none, infinite
            at the end of its range.
    """
    if memory.phase >= RELEASED:
        return ZERO, memory
    period, phase, left = release.period, memory.phase, memory.left - release.period
    keep = math.exp(-period / SPEED_TIME)
    speed1 = keep * memory.speed1 + (1.0 - keep) * (q11 - memory.last1) / period
    speed2 = keep * memory.speed2 + (1.0 - keep) * (q21 - memory.last2) / period
    readings, total = memory.readings, memory.total
    last_rate = memory.rate if math.isnan(rate) else rate
    turned, asked, assembly = memory.turned, memory.asked, memory.assembly
    base1, base2 = memory.base1, memory.base2
    link, restless = 0.0, False
    if phase == RESTING:
        restless = abs(q11 - release.q11) > REST_ANGLE or abs(q21 - release.q21) > REST_ANGLE
        if not math.isnan(rate):
            readings, total = readings + 1, total + rate
            restless = restless or not abs(rate - total / readings) <= REST_RATE
    elif readings > 0:
        link = last_rate - total / readings
        turned += period * link
    fastest_motor = max(memory.fastest_motor, abs(speed1), abs(speed2))
    fastest_link = max(memory.fastest_link, abs(link))
    plus, minus = memory.misfit_plus, memory.misfit_minus
    torque = ZERO
    if restless:
        phase = NOT_AT_REST
    elif fastest_motor > release.motor_speed or fastest_link > release.link_rate:
        phase = TOO_FAST
    elif abs(q11 - release.q11) > release.travel or abs(q21 - release.q21) > release.travel:
        phase = TOO_FAR
    else:
        done = moved(release, q11 - base1, q21 - base2)
        # friction is fed forward as the way begins, not at once; what it has without motion holds the motors at rest
        begun = min(1.0, asked / (release.pace * BEGIN_TIME))
        behind1 = base1 + release.per_way1 * asked - q11
        behind2 = base2 + release.per_way2 * asked - q21
        push1 = release.offset1 + begun * release.friction1 + release.kp1 * behind1 - release.kd1 * speed1
        push2 = release.offset2 + begun * release.friction2 + release.kp2 * behind2 - release.kd2 * speed2
        capped = abs(push1) > release.cap1 or abs(push2) > release.cap2
        torque = Torque(max(-release.cap1, min(release.cap1, push1)), max(-release.cap2, min(release.cap2, push2)))
        if phase == RESTING:
            if left <= 0.0:
                if release.drive.side != 0:
                    phase, left = DRIVING, release.drive.duration
                else:
                    phase, left = (PRESSING, STALL_TIME) if readings > 0 else (NO_GYROSCOPE, 0.0)
        elif phase == DRIVING:
            drive = release.drive
            torque = drive_torque(release.robot, drive, drive.duration - left, q11, q21, speed1, speed2)
            if left <= 0.0:
                late = behind(drive, state_at(release.robot, drive, drive.duration), q11, q21)
                phase, left = (PRESSING, STALL_TIME) if late < LATE * drive.length else (STUCK, 0.0)
                base1, base2 = q11, q21
        elif phase == PRESSING:
            if done >= release.way:
                # what friction had wound up would carry them on
                phase, left, asked = HOLDING, HOLD_TIME, done
            elif left <= 0.0:
                phase = STUCK
            elif not capped:
                # it waits at the largest torque only
                asked, left = asked + release.pace * period, STALL_TIME
        elif phase == HOLDING:
            plus = abs(wrap(distal_angle(release.robot, 1, q11, q21) - release.start - turned))
            minus = abs(wrap(distal_angle(release.robot, -1, q11, q21) - release.start - turned))
            if left <= 0.0:
                if readings == 0:
                    phase, left, assembly = EASING, EASE_TIME, release.drive.side
                elif abs(plus - minus) > UNSURE and min(plus, minus) < UNFIT:
                    phase, left, assembly = EASING, EASE_TIME, 1 if plus < minus else -1
                else:
                    phase = UNDECIDED
        else:
            share = max(0.0, left / EASE_TIME)
            torque = Torque(share * torque.tau1, share * torque.tau2)
            if left <= 0.0:
                phase = RELEASED
    if phase >= RELEASED:
        torque = ZERO
    kept = ReleaseMemory(
        phase=phase,
        left=left,
        asked=asked,
        base1=base1,
        base2=base2,
        last1=q11,
        last2=q21,
        speed1=speed1,
        speed2=speed2,
        readings=readings,
        total=total,
        rate=last_rate,
        turned=turned,
        misfit_plus=plus,
        misfit_minus=minus,
        assembly=assembly,
        fastest_motor=fastest_motor,
        fastest_link=fastest_link,
    )
    return torque, kept


def moved(release: Release, turned1: float, turned2: float) -> float:
    """Return how far (m) the elbows have come on their way, by how far the motors have turned (rad)."""
    squared = release.per_way1 * release.per_way1 + release.per_way2 * release.per_way2
    return (release.per_way1 * turned1 + release.per_way2 * turned2) / squared
