# SPDX-License-Identifier: Apache-2.0
"""The beginning of a release without a gyroscope: the platform is driven along v_1, from which the locus goes away.

No torque acts along t_s on the Type 2 locus, so a platform that the motors accelerate along v_1 goes straight on,
while the elbows' line turns and moves below it. By how much and to which side is a matter of geometry: with the first
power of the way where v_1 is not tangent to the locus, then to the side that the direction decides, else with the
second, then to the same side in both directions. The motors follow the way along v_1 only, and press the distal links
with no force, so that whatever else acts along t_s acts as on a free mass.
"""

from __future__ import annotations

import math
from collections.abc import Generator
from typing import NamedTuple

from fivebar_control.laws.torque import Torque
from fivebar_control.model.geometry import wrap
from fivebar_control.model.kinematics import det_a, joint_acceleration, state_from_platform
from fivebar_control.model.singularity import parallel_svd
from fivebar_control.model.state import Leg, State, WorkingMode
from fivebar_control.planning.standstill import Standstill
from fivebar_control.trajectory.time_scaling import rest_to_rest
from fivebar_description.imu import STANDARD_GRAVITY
from fivebar_description.loads import Loads
from fivebar_description.parameters import FiveBar, friction_torque

INSTANTS = 30
"""Parts of a drive at whose ends it is looked at."""

SLICE = 8
"""Instants between which a plan may be left for a while: a node answers samples meanwhile."""

LEAST_DEVIATION = 2e-5
"""Standard deviation (m) of the elbows' distance below which none is believed."""

FRICTION_STEPS = 120
"""Steps in which dry friction in the passive joints is followed through a drive."""

COUNTED = 0.8
"""Share of the height off the elbows' line that counts: drives with 20 % more or less friction keep it within 3 %."""


class ReleaseDrive(NamedTuple):
    """A straight motion of the platform along v_1.

    Attributes:
        mode: working mode.
        x, y: where it begins, on the elbows' line (m).
        d_x, d_y: its direction.
        length: m; 0 for none.
        duration: s.
        bandwidth: natural frequency with which the motors follow along it (rad/s).
        cap1, cap2: largest torques (Nm).
        side: assembly mode to which it leaves the locus, 0 for none.
    """

    mode: WorkingMode
    x: float
    y: float
    d_x: float
    d_y: float
    length: float
    duration: float
    bandwidth: float
    cap1: float
    cap2: float
    side: int


NO_DRIVE = ReleaseDrive((1, 1), 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0)
"""A release that presses at once."""


def state_at(robot: FiveBar, drive: ReleaseDrive, time: float) -> State:
    """Return the state at a time (s) of a drive, whose platform is nowhere beside its straight way."""
    s, ds, _ = rest_to_rest(time / drive.duration)
    way, rate = s * drive.length, ds * drive.length / drive.duration
    x, y = drive.x + way * drive.d_x, drive.y + way * drive.d_y
    return state_from_platform(robot, drive.mode, x, y, rate * drive.d_x, rate * drive.d_y)


def drive_torque(
    robot: FiveBar, drive: ReleaseDrive, time: float, q11: float, q21: float, speed1: float, speed2: float
) -> Torque:
    """Return the torque (Nm) that drives the platform along v_1 and presses the distal links with no force.

    Args:
        robot: as modelled.
        drive: the motion.
        time: since it has begun (s).
        q11, q21: motor angles (rad).
        speed1, speed2: of the motors (rad/s).
    """
    change = rest_to_rest(time / drive.duration)[2] * drive.length / (drive.duration * drive.duration)
    state = state_at(robot, drive, time)
    leg1, leg2 = state.leg1, state.leg2
    per1, per2 = _per_way(drive, leg1), _per_way(drive, leg2)
    slower = (per1 * (leg1.dq1 - speed1) + per2 * (leg2.dq1 - speed2)) / (per1 * per1 + per2 * per2)
    more = drive.bandwidth * (drive.bandwidth * behind(drive, state, q11, q21) + 2.0 * slower)
    svd = parallel_svd(state)
    # lambda along U_1 alone: its other part is the press
    along = svd.v_x * drive.d_x + svd.v_y * drive.d_y
    force = robot.mass * (change + more) * along / (math.sqrt(2.0) * svd.s1)
    ax, ay = change * drive.d_x, change * drive.d_y
    tau1 = robot.leg1.inertia * (joint_acceleration(leg1, ax, ay) + per1 * more) + leg1.b * force
    tau2 = robot.leg2.inertia * (joint_acceleration(leg2, ax, ay) + per2 * more) + leg2.b * svd.fold * force
    tau1, tau2 = tau1 + friction_torque(robot.leg1, leg1.dq1), tau2 + friction_torque(robot.leg2, leg2.dq1)
    return Torque(max(-drive.cap1, min(drive.cap1, tau1)), max(-drive.cap2, min(drive.cap2, tau2)))


def behind(drive: ReleaseDrive, state: State, q11: float, q21: float) -> float:
    """Return by how much (m) motors at some angles (rad) are behind a state of a drive, along its way."""
    per1, per2 = _per_way(drive, state.leg1), _per_way(drive, state.leg2)
    turns = per1 * wrap(state.leg1.q1 - q11) + per2 * wrap(state.leg2.q1 - q21)
    return turns / (per1 * per1 + per2 * per2)


def _per_way(drive: ReleaseDrive, leg: Leg) -> float:
    """Return the turn of a motor along a drive (rad/m)."""
    return (leg.u_x * drive.d_x + leg.u_y * drive.d_y) / leg.b


def height_of(robot: FiveBar, state: State) -> float:
    """Return the platform's distance (m) from the elbows' line, positive on the side of assembly mode +."""
    distal1, distal2 = robot.leg1.distal, robot.leg2.distal
    e_x = distal2 * state.leg2.u_x - distal1 * state.leg1.u_x
    e_y = distal2 * state.leg2.u_y - distal1 * state.leg1.u_y
    return distal1 * distal2 * det_a(state) / math.hypot(e_x, e_y)


def reach_of(robot: FiveBar, drive: ReleaseDrive, loads: Loads) -> Generator[None, None, float]:
    """Return, after some slices, by how much (m) a platform that began on the elbows' line is off it after a drive.

    Positive on the side of assembly mode +, 0 where it may stay on the line. The height is that of the straight way,
    less what a tilt and the friction of the passive joints may take from a free platform. Nobody pushes meanwhile.
    """
    height = COUNTED * height_of(robot, state_at(robot, drive, drive.duration))
    lost = 0.5 * STANDARD_GRAVITY * math.sin(loads.tilt) * drive.duration**2
    side = math.copysign(1.0, height)
    if loads.passive > 0.0 and abs(height) > lost:
        dragged = yield from _dragged(robot, drive, loads.passive)
        lost += max(-side * dragged, 0.0)
    return side * max(abs(height) - lost, 0.0)


def _dragged(robot: FiveBar, drive: ReleaseDrive, moment: float) -> Generator[None, None, float]:
    """Return by how much (m) a moment of friction (Nm) in each passive joint takes a free platform towards mode +."""
    dragged, speed, step = 0.0, 0.0, drive.duration / FRICTION_STEPS
    for number in range(FRICTION_STEPS):
        if number % SLICE == 0:
            yield
        state = state_at(robot, drive, (number + 0.5) * step)
        svd = parallel_svd(state)
        slopes = _rates(state_from_platform(robot, drive.mode, state.x, state.y, svd.t_x, svd.t_y))
        rates = (rate + slope * speed for rate, slope in zip(_rates(state), slopes, strict=True))
        pull = sum(math.copysign(moment, rate) * slope for rate, slope in zip(rates, slopes, strict=True))
        speed -= pull / robot.mass * step
        # det A = sin(theta_2 - theta_1) turns with the sign of the cosine
        dragged += svd.fold * math.copysign(1.0, slopes[2]) * speed * step
    return dragged


def _rates(state: State) -> tuple[float, float, float]:
    """Return the rates (rad/s) of both elbows and of the platform's joint."""
    leg1, leg2 = state.leg1, state.leg2
    return leg1.dtheta - leg1.dq1, leg2.dtheta - leg2.dq1, leg2.dtheta - leg1.dtheta


def wrong_side(robot: FiveBar, stand: Standstill, reach: float) -> float:
    """Return the probability that a stretched robot rests farther on one side of the line than `reach` (m).

    Either side is as likely, and the elbows' distance is known as the standstill says.
    """
    distal1, distal2 = robot.leg1.distal, robot.leg2.distal
    if not 0.0 < reach < min(distal1, distal2):
        return 0.5
    gap = (
        distal1 + distal2 - math.sqrt(distal1 * distal1 - reach * reach) - math.sqrt(distal2 * distal2 - reach * reach)
    )
    deviation = max(stand.gap_deviation, LEAST_DEVIATION)
    return 0.25 * math.erfc((gap - stand.gap) / (math.sqrt(2.0) * deviation))
