# SPDX-License-Identifier: Apache-2.0
"""Off the Type 2 locus from rest by the motors: what a torque does there, and the plan of a release.

At rest on the locus no torque accelerates the platform along t_s: it gets A^T lambda / m, and A t_s = 0. Two things
are left to the motors. Along v1 they accelerate it as anywhere else, and where v1 is not tangent to the locus that
alone moves it off. And they press the distal links together (or pull them apart, where these are folded): the force F
in both makes a displacement s along t_s grow, like a rod that buckles,

    m sddot = F (1 / l_12 - e / l_22) s,        e = -1 stretched, +1 folded.

To which side it falls depends on where in the tolerances the robot stands, so a release is planned only if it may fall
to either. Where elbows of equal distal links are in one place, F moves nothing (both terms cancel) and the motors do
not tell where on its circle the platform is. Known from elsewhere, the elbows are opened across the links, and their
order decides the assembly mode.
"""

from __future__ import annotations

import math
from collections.abc import Generator, Iterator
from typing import NamedTuple, TypeVar

from fivebar_control.laws.torque import ZERO
from fivebar_control.model.geometry import elbow_position, wrap
from fivebar_control.model.kinematics import det_a, elbow_side, state_from_motors, state_from_platform, working_mode
from fivebar_control.model.state import State, WorkingMode
from fivebar_control.planning.release_drive import (
    COUNTED,
    INSTANTS,
    NO_DRIVE,
    SLICE,
    ReleaseDrive,
    drive_torque,
    height_of,
    reach_of,
    state_at,
    wrong_side,
)
from fivebar_control.planning.release_step import Release
from fivebar_control.planning.standstill import DEVIATIONS, Standstill, standstill_at
from fivebar_control.safety.stages import NO_FAULT, Limits, fault_of, first_fault
from fivebar_description.loads import NO_LOADS, Loads
from fivebar_description.parameters import FiveBar, LegParameters, has_external_force, largest_friction, with_floats
from fivebar_description.robot_file import ElbowsPass
from fivebar_description.strict_yaml import InputError
from fivebar_description.tolerances import Tolerances

CLEAR = 0.15
"""1/cond(A) that a released robot has at least, within its tolerances: a homing posture needs 0.1."""

OPENED = 0.2
"""1/cond(A) to which elbows in one place are opened."""

GROWTH = 20.0
"""Rate (1/s) at which the largest press makes a displacement grow, after the friction of the motors."""

PACE = 0.1
"""Change of the elbows' distance in a second, in lengths of the longer distal link."""

STIFFNESS = 40.0
"""Natural frequency (rad/s) with which each motor follows, with its link and the whole platform at the elbow."""

MOTOR_SPEED, LINK_RATE = 3.0, 12.0
"""Speed of a motor and rate of the distal link of leg 2 (rad/s) at which a release is given up."""

TYPE_1_MARGIN = 0.1
"""Least |sin q_i2| in every posture to which the robot may come."""

TOGETHER = 5e-4
"""Distance (m) of the elbows, beside its uncertainty, up to which they are in one place."""

DRIVES = tuple(1e-3 * length for length in (4, 7, 10, 14, 18, 22, 26, 30))
"""Lengths (m) of drives along v_1 that are tried."""

QUICKEST, SLOWEST, SAMPLES = 0.1, 1.0, 20
"""Least and largest duration of a drive (s), and its least number of samples."""

DRIVE_SHARE = 0.8
"""Part of the largest torque and speed of a release that a drive may need."""

WRONG_SIDE = 1e-3
"""Largest probability with which a drive may end on the other side of the elbows' line."""

SEEN_WITHIN = 0.01
"""How exactly (m) the platform has to be known where the elbows are in one place."""


class ReleaseRefused(InputError):
    """It is not known what a release would come to; says why."""


class ReleaseTask(NamedTuple):
    """The conditions that a release is planned for.

    Attributes:
        robot, tolerances: the robot as modelled, and how exactly it is known.
        limits: of the guard, which every posture keeps to which the robot may come.
        elbows_pass: whether its elbows may pass each other.
        rate_hz: sampling rate (Hz).
        loads: that may act while it is driven.
    """

    robot: FiveBar
    tolerances: Tolerances
    limits: Limits
    elbows_pass: ElbowsPass
    rate_hz: int
    loads: Loads = NO_LOADS


class ReleasePlan(NamedTuple):
    """A release, and what is known of it beforehand.

    Attributes:
        release: as numbers, for `release_step`.
        stand: where the robot stands.
        pivot: whether the elbows are in one place, so that their order decides the assembly mode.
        modes: the assembly modes to which it may fall.
        ends: where the platform comes to in each of the modes (m), within the tolerances.
        odds: probability that it is the first of the modes, NaN where the gyroscope tells.
    """

    release: Release
    stand: Standstill
    pivot: bool
    modes: tuple[int, ...]
    ends: tuple[tuple[float, float], ...]
    odds: float = math.nan


R = TypeVar("R")

PlannedInSlices = Generator[None, None, ReleasePlan]
"""A plan of a release in slices, between which a node may answer samples."""


def plan_in_slices(
    task: ReleaseTask,
    q11: float,
    q21: float,
    platform: tuple[float, float] | None = None,
    gyroscope: bool = True,
) -> PlannedInSlices:
    """Return how a robot at rest near the locus is released from there, after some slices of a millisecond or so.

    Args:
        task: the conditions that it is planned for.
        q11, q21: motor angles (rad).
        platform: where the platform is (m), if known; needed where the elbows of equal distal links are in one place.
        gyroscope: whether one tells to which side it falls; else it is driven to a side first.

    Raises:
        ReleaseRefused: it is not near the locus, or it is not known that all goes well.
    """
    robot = task.robot
    if has_external_force(robot):
        raise ReleaseRefused(
            "gravity or a constant force (forces of the robot file) acts on the platform: which way it goes where no"
            " motor holds it is not planned: expected a hand"
        )
    stand = standstill_at(robot, task.tolerances, q11, q21)
    if not gyroscope and (stand is None or not stand.stretched):
        raise ReleaseRefused(
            "there is no gyroscope, and without one nobody knows to which side the platform goes where the distal links"
            " are folded: expected a hand, or a gyroscope"
        )
    if stand is None or _together(robot, stand):
        return _opened(task, q11, q21, stand, platform)
    if not stand.near:
        raise ReleaseRefused(
            f"not near the Type 2 locus: the platform is {1e3 * stand.side:.1f} mm beside the elbows' line, and"
            " the motors hold it there: expected a robot whose assembly mode its encoders do not tell"
        )
    if not gyroscope:
        return (yield from _driven(task, q11, q21, stand))
    return _pressed(task, q11, q21, stand)


def finished(slices: Generator[None, None, R]) -> R:
    """Return what slices come to, once all of them are done; raises what they raise."""
    while True:
        try:
            next(slices)
        except StopIteration as end:
            result: R = end.value
            return result


def _together(robot: FiveBar, stand: Standstill) -> bool:
    """Return whether the elbows may be in one place, so that the direction from one to the other is not known."""
    distance = stand.gap + abs(robot.leg1.distal - robot.leg2.distal)
    return not stand.stretched and distance < TOGETHER + 2.0 * DEVIATIONS * stand.gap_deviation


def _pressed(task: ReleaseTask, q11: float, q21: float, stand: Standstill) -> ReleasePlan:
    """Return the release of a robot whose elbows are on a known line."""
    robot = task.robot
    spread = DEVIATIONS * stand.gap_deviation
    goal = max(gap_of(robot, stand.stretched, CLEAR) + spread, stand.gap + 2.0 * spread, 2.0 * spread)
    way = goal - stand.gap
    e1, e2 = elbow_position(robot.leg1, q11), elbow_position(robot.leg2, q21)
    # the press has the direction of the gap's gradient by the motors
    slope1, slope2 = (
        (-1.0 if stand.stretched else 1.0) * slope
        for slope in (_slope(robot.leg1, q11, stand, -1.0), _slope(robot.leg2, q21, stand, 1.0))
    )
    squared = slope1 * slope1 + slope2 * slope2
    if not squared > 0.0:
        raise ReleaseRefused("no motor moves the elbows off the locus: both proximal links lie on their line")
    press = (
        GROWTH
        * GROWTH
        * robot.mass
        / (1.0 / robot.leg1.distal + (1.0 if stand.stretched else -1.0) / robot.leg2.distal)
    )
    release = _release(
        task,
        (q11, q21),
        (slope1 / squared, slope2 / squared),
        way,
        abs(press),
        math.atan2(e1[1] - e2[1], e1[0] - e2[0])
        if stand.stretched or robot.leg2.distal > robot.leg1.distal
        else math.atan2(e2[1] - e1[1], e2[0] - e1[0]),
    )
    ends = tuple(_end_within(task, release, mode, (way - spread, way, way + spread)) for mode in (1, -1))
    return ReleasePlan(release, stand, False, (1, -1), ends)


def _driven(task: ReleaseTask, q11: float, q21: float, stand: Standstill) -> PlannedInSlices:
    """Return the release of a robot without a gyroscope: driven along v_1 to one side of the line, then pressed.

    Of all drives that are sure enough the shortest is taken, of two of one length the surer one.
    """
    robot = task.robot
    least, reason = 1.0, "no drive along the distal links stays within reach and keeps the limits"
    for length in DRIVES:
        tried = []
        for sign in (1.0, -1.0):
            drive = _along(robot, q11, q21, stand, sign * length)
            wrong = wrong_side(robot, stand, COUNTED * abs(height_of(robot, state_at(robot, drive, drive.duration))))
            if wrong <= WRONG_SIDE or (least == 1.0 and length == DRIVES[-1]):
                timed = yield from _timed(task, drive)
                if timed is not None:
                    reach = yield from reach_of(robot, timed, task.loads)
                    timed = timed._replace(side=1 if reach > 0.0 else -1)
                    tried.append((wrong_side(robot, stand, abs(reach)), abs(reach), timed))
        for wrong, reach, drive in sorted(tried):
            if wrong < least:
                least = wrong
                reason = (
                    f"driven by {1e3 * drive.length:.0f} mm in {drive.duration:.2f} s the platform leaves the elbows'"
                    f" line by {1e3 * reach:.1f} mm at least, which is the right side with a probability of"
                    f" {1.0 - wrong:.3f}: expected at least {1.0 - WRONG_SIDE:g}"
                )
            if wrong <= WRONG_SIDE:
                try:
                    return _driven_by(task, (q11, q21), stand, drive, wrong)
                except ReleaseRefused as error:
                    least, reason = -1.0, str(error)
    raise ReleaseRefused(
        f"there is no gyroscope, and without one it is not known to which side the platform falls: {reason}; a"
        " gyroscope, a level robot or lengths that are known better may do, or a hand"
    )


def _along(robot: FiveBar, q11: float, q21: float, stand: Standstill, length: float) -> ReleaseDrive:
    """Return a drive of a length (m), negative against the direction from elbow 1 to elbow 2, in a second."""
    (x1, y1), (x2, y2) = elbow_position(robot.leg1, q11), elbow_position(robot.leg2, q21)
    share = robot.leg1.distal / (robot.leg1.distal + robot.leg2.distal)
    e_x, e_y = stand.normal_y, -stand.normal_x
    side1 = elbow_side(e_y * math.cos(q11) - e_x * math.sin(q11))
    side2 = elbow_side(e_x * math.sin(q21) - e_y * math.cos(q21))
    return NO_DRIVE._replace(
        mode=(side1, side2),
        x=x1 + share * (x2 - x1),
        y=y1 + share * (y2 - y1),
        d_x=math.copysign(1.0, length) * e_x,
        d_y=math.copysign(1.0, length) * e_y,
        length=abs(length),
        bandwidth=STIFFNESS,
    )


def _timed(task: ReleaseTask, drive: ReleaseDrive) -> Generator[None, None, ReleaseDrive | None]:
    """Return a drive as quick as torque and speeds allow, after some slices; None where it breaks a limit.

    Speeds go with the inverse of the duration, torques beyond friction with its square.
    """
    robot, limits = task.robot, task.limits
    strict = limits._replace(type1_margin=max(limits.type1_margin, TYPE_1_MARGIN))
    smooth = (leg._replace(coulomb=0.0, offset=0.0) for leg in (robot.leg1, robot.leg2))
    free = robot._replace(leg1=next(smooth), leg2=next(smooth))
    unlimited = drive._replace(cap1=math.inf, cap2=math.inf)
    torque = speed = rate = 0.0
    for number in range(INSTANTS + 1):
        if number % SLICE == 0:
            yield
        time = number / INSTANTS * drive.duration
        state = state_at(robot, drive, time)
        leg1, leg2 = state.leg1, state.leg2
        rest = state_from_platform(robot, drive.mode, state.x, state.y, 0.0, 0.0)
        if not math.isfinite(det_a(state)):
            return None
        if first_fault(strict, robot, drive.mode, rest, rest.x, rest.y, ZERO) != NO_FAULT:
            return None
        needed = drive_torque(free, unlimited, time, leg1.q1, leg2.q1, leg1.dq1, leg2.dq1)
        torque = max(torque, abs(needed.tau1), abs(needed.tau2))
        speed, rate = max(speed, abs(leg1.dq1), abs(leg2.dq1)), max(rate, abs(leg1.dtheta), abs(leg2.dtheta))
    cap = DRIVE_SHARE * limits.torque_limit
    left = cap - largest_friction(robot)
    if not left > 0.0:
        return None
    duration = max(
        QUICKEST,
        SAMPLES / task.rate_hz,
        speed / (DRIVE_SHARE * min(MOTOR_SPEED, limits.joint_speed)),
        rate / (DRIVE_SHARE * LINK_RATE),
        math.sqrt(torque / left),
    )
    return drive._replace(duration=duration, cap1=cap, cap2=cap) if duration < SLOWEST else None


def _driven_by(
    task: ReleaseTask,
    begin: tuple[float, float],
    stand: Standstill,
    drive: ReleaseDrive,
    wrong: float,
) -> ReleasePlan:
    """Return the release that begins with a drive, whose side is wrong with a probability.

    Raises:
        ReleaseRefused: what follows would contradict a limit.
    """
    robot = task.robot
    end = state_at(robot, drive, drive.duration)
    there = standstill_at(robot, task.tolerances, end.leg1.q1, end.leg2.q1)
    assert there is not None
    pressed = _pressed(task, end.leg1.q1, end.leg2.q1, there)
    turned = max(abs(wrap(end.leg1.q1 - begin[0])), abs(wrap(end.leg2.q1 - begin[1])))
    start = state_at(robot, drive, 0.0).leg2
    release = pressed.release._replace(
        q11=begin[0],
        q21=begin[1],
        travel=pressed.release.travel + 2.0 * turned,
        start=start.q1 + start.q2,
        drive=drive,
    )
    order = slice(None, None, drive.side)
    return ReleasePlan(release, stand, False, pressed.modes[order], pressed.ends[order], 1.0 - wrong)


def _slope(leg: LegParameters, q1: float, stand: Standstill, sign: float) -> float:
    """Return the change of the elbows' distance by a motor's angle (m/rad)."""
    e_x, e_y = stand.normal_y, -stand.normal_x
    return sign * leg.proximal * (math.cos(q1) * e_y - math.sin(q1) * e_x)


def gap_of(robot: FiveBar, stretched: bool, kappa: float) -> float:
    """Return by how much (m) the elbows are nearer, or folded farther apart, at a 1/cond(A) than on the locus."""
    distal1, distal2 = robot.leg1.distal, robot.leg2.distal
    cosine = math.cos(2.0 * math.atan(kappa))
    if stretched:
        return distal1 + distal2 - math.sqrt(distal1 * distal1 + distal2 * distal2 + 2.0 * distal1 * distal2 * cosine)
    return math.sqrt(distal1 * distal1 + distal2 * distal2 - 2.0 * distal1 * distal2 * cosine) - abs(distal1 - distal2)


def _opened(
    task: ReleaseTask,
    q11: float,
    q21: float,
    stand: Standstill | None,
    platform: tuple[float, float] | None,
) -> ReleasePlan:
    """Return the release of a robot whose elbows are in one place, as far as is known."""
    robot = task.robot
    if task.elbows_pass is False:
        raise ReleaseRefused(
            "the elbows are in one place within the tolerances, and the robot's file says that they cannot pass each"
            " other (elbows_pass: false): which is on which side is not known: expected a hand"
        )
    if platform is None:
        raise ReleaseRefused(
            "the elbows are in one place within the tolerances: the platform may be anywhere on a circle about them,"
            " the motors read the same, and where it would swing to is not known: expected the platform's place"
        )
    (x1, y1), (x2, y2) = elbow_position(robot.leg1, q11), elbow_position(robot.leg2, q21)
    x, y = platform[0] - 0.5 * (x1 + x2), platform[1] - 0.5 * (y1 + y2)
    length, distance = 0.5 * (robot.leg1.distal + robot.leg2.distal), math.hypot(x, y)
    if not abs(distance - length) <= SEEN_WITHIN:
        raise ReleaseRefused(
            f"the platform is {1e3 * distance:.1f} mm from the elbows: expected {1e3 * length:.1f} mm within"
            f" {1e3 * SEEN_WITHIN:g} mm, the length of the distal links"
        )
    u_x, u_y = x / distance, y / distance
    # l_21 n_2 d_2 - l_11 n_1 d_1 = change of E_2 - E_1
    n1_x, n1_y = -robot.leg1.proximal * math.sin(q11), robot.leg1.proximal * math.cos(q11)
    n2_x, n2_y = -robot.leg2.proximal * math.sin(q21), robot.leg2.proximal * math.cos(q21)
    determinant = n1_x * n2_y - n1_y * n2_x
    if abs(determinant) < TYPE_1_MARGIN * robot.leg1.proximal * robot.leg2.proximal:
        raise ReleaseRefused("both proximal links are nearly parallel: the motors cannot open the elbows either way")
    wide = gap_of(robot, False, OPENED)
    reasons = []
    for mode in (1, -1):
        # E_2 - E_1 along e has mode + on its left, the side of u
        e_x, e_y = mode * u_y, -mode * u_x
        way_x, way_y = wide * e_x - (x2 - x1), wide * e_y - (y2 - y1)
        way1 = (n2_x * way_y - n2_y * way_x) / determinant
        way2 = (n1_x * way_y - n1_y * way_x) / determinant
        start = math.atan2(u_y, u_x)
        press = 0.5 * GROWTH * GROWTH * robot.mass * length
        release = _release(task, (q11, q21), (way1 / wide, way2 / wide), wide, press, start)
        try:
            end = _end_within(task, release, mode, (0.5 * wide, wide))
        except ReleaseRefused as error:
            reasons.append(str(error))
            continue
        stand = stand or _in_one_place(platform)
        return ReleasePlan(release, stand, True, (mode,), (end,))
    raise ReleaseRefused("; ".join(reasons))


def _in_one_place(platform: tuple[float, float]) -> Standstill:
    """Return the standstill with both elbows in exactly one place, which have no line."""
    nan = math.nan
    return Standstill(False, 0.0, 0.0, 0.0, 0.0, platform, platform, nan, nan, nan, nan, nan)


def _release(
    task: ReleaseTask,
    begin: tuple[float, float],
    per_way: tuple[float, float],
    way: float,
    force: float,
    start: float,
) -> Release:
    robot, torque_limit = task.robot, task.limits.torque_limit
    legs = robot.leg1, robot.leg2
    inertias = [leg.inertia + robot.mass * leg.proximal**2 for leg in legs]
    frictions = [leg.coulomb + abs(leg.offset) for leg in legs]
    # the force acts at the end of the proximal link, at the best across it
    caps = [friction + force * leg.proximal for friction, leg in zip(frictions, legs, strict=True)]
    if not all(most <= torque_limit for most in caps):
        raise ReleaseRefused(
            f"the motors need {max(caps):.3g} Nm against friction and to press: expected no more than the torque"
            f" limit, {torque_limit:.3g} Nm"
        )
    travel = [abs(ratio) * way for ratio in per_way]
    return Release(
        robot=with_floats(robot),
        period=1.0 / task.rate_hz,
        q11=begin[0],
        q21=begin[1],
        per_way1=per_way[0],
        per_way2=per_way[1],
        way=way,
        pace=PACE * max(robot.leg1.distal, robot.leg2.distal),
        kp1=inertias[0] * STIFFNESS**2,
        kp2=inertias[1] * STIFFNESS**2,
        kd1=2.0 * inertias[0] * STIFFNESS,
        kd2=2.0 * inertias[1] * STIFFNESS,
        offset1=legs[0].offset,
        offset2=legs[1].offset,
        friction1=math.copysign(legs[0].coulomb, per_way[0]),
        friction2=math.copysign(legs[1].coulomb, per_way[1]),
        cap1=caps[0],
        cap2=caps[1],
        travel=2.0 * max(travel) + 0.05,
        motor_speed=min(MOTOR_SPEED, task.limits.joint_speed),
        link_rate=LINK_RATE,
        start=start,
    )


def _end_within(task: ReleaseTask, release: Release, mode: int, ways: tuple[float, ...]) -> tuple[float, float]:
    """Return where the platform comes to in an assembly mode, once no posture on the way contradicts a limit.

    Raises:
        ReleaseRefused: one does.
    """
    robot, limits = task.robot, task.limits
    strict = limits._replace(type1_margin=max(limits.type1_margin, TYPE_1_MARGIN))
    end = math.nan, math.nan
    for state, modes in _postures(robot, release, mode, ways):
        number = first_fault(strict, robot, modes, state, state.x, state.y, ZERO)
        if number != NO_FAULT:
            fault = fault_of(number, strict, robot, modes, state, state.x, state.y, ZERO, 0.0)
            raise ReleaseRefused(
                f"in assembly mode {'+' if mode > 0 else '-'} the robot would come to where a limit is: {fault}"
            )
        end = state.x, state.y
    return end


def _postures(
    robot: FiveBar, release: Release, mode: int, ways: tuple[float, ...]
) -> Iterator[tuple[State, tuple[int, int]]]:
    """Yield the postures after parts of the way in an assembly mode, and the working mode in which it began."""
    modes: WorkingMode | None = None
    for way in ways:
        q11, q21 = release.q11 + release.per_way1 * way, release.q21 + release.per_way2 * way
        state = state_from_motors(robot, mode, q11, q21, 0.0, 0.0)
        if math.isnan(state.x):
            continue
        modes = modes or working_mode(state)
        yield state, modes
