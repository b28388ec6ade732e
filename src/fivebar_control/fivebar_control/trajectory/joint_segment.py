"""Motions planned in the motors' angles: regular where a leg is stretched (Type 1), which the platform's are not.

The platform follows by direct geometry in one assembly mode, so such a motion stays away from Type 2, where the motors
do not fix the platform. Through Type 1 the sign of sin q_i2, the working mode of leg i, changes by itself.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from fivebar_control.model.geometry import direct_geometry, wrap
from fivebar_control.model.kinematics import det_a, leg_from_joints, platform_acceleration
from fivebar_control.model.line import Line
from fivebar_control.model.state import Leg, Platform, State
from fivebar_control.trajectory.polynomial import rest_to_rest_without_jerk
from fivebar_description.parameters import FiveBar, LegParameters

NO_LINE = Line(math.nan, math.nan, math.nan, math.nan)
"""The line of a motion that is not straight in the plane."""


class Motors(NamedTuple):
    """Angles (rad), rates (rad/s) and accelerations (rad/s^2) of both motors."""

    q11: float
    q21: float
    dq11: float
    dq21: float
    ddq11: float
    ddq21: float


class JointSegment(NamedTuple):
    """One motion from rest to rest on a straight line in (q11, q21).

    Attributes:
        robot: whose geometry gives the platform.
        assembly: its assembly mode, the sign of det A.
        start_q11, start_q21: motor angles at the start (rad).
        turn_q11, turn_q21: by how much the motors turn (rad).
        start_time: s since sample 0.
        duration: s.
    """

    robot: FiveBar
    assembly: int
    start_q11: float
    start_q21: float
    turn_q11: float
    turn_q21: float
    start_time: float
    duration: float

    def motors_at(self, t: float) -> Motors:
        """Return both motors at time t (s); before and after the segment they rest."""
        s, ds, dds = rest_to_rest_without_jerk((t - self.start_time) / self.duration)
        rate, bend = ds / self.duration, dds / (self.duration * self.duration)
        return Motors(
            self.start_q11 + self.turn_q11 * s,
            self.start_q21 + self.turn_q21 * s,
            self.turn_q11 * rate,
            self.turn_q21 * rate,
            self.turn_q11 * bend,
            self.turn_q21 * bend,
        )

    def state_at(self, t: float) -> State:
        """Return both legs and the platform at time t (s); NaN where the distal links cannot meet."""
        q11, q21, dq11, dq21, _, _ = self.motors_at(t)
        return state_from_motors(self.robot, self.assembly, q11, q21, dq11, dq21)

    def at(self, t: float) -> Platform:
        """Return the reference at time t (s); before and after the segment the platform rests at its ends."""
        q11, q21, dq11, dq21, ddq11, ddq21 = self.motors_at(t)
        state = state_from_motors(self.robot, self.assembly, q11, q21, dq11, dq21)
        return Platform(state.x, state.y, state.vx, state.vy, *platform_acceleration(state, ddq11, ddq21))

    def modes_at(self, t: float) -> tuple[int, int]:
        """Return the working mode at time t (s); on the boundary that of sin q_i2 < 0."""
        state = self.state_at(t)
        return (-1 if state.leg1.sin_q2 > 0.0 else 1), (-1 if state.leg2.sin_q2 > 0.0 else 1)

    def line(self) -> Line:
        """Return NaN: the way in the plane is no line."""
        return NO_LINE


def state_from_motors(robot: FiveBar, assembly: int, q11: float, q21: float, dq11: float, dq21: float) -> State:
    """Return the state from both motors' angles (rad) and rates (rad/s) in an assembly mode.

    xdot = A^-1 B qdot, and theta_i from the platform as seen from the elbow: regular at Type 1, NaN at Type 2.
    """
    x, y = direct_geometry(robot, assembly, q11, q21)
    if math.isnan(x):
        return _open_loop(robot, q11, q21)
    still1, still2 = _still(robot.leg1, q11, x, y), _still(robot.leg2, q21, x, y)
    determinant = det_a(State(still1, still2, x, y, 0.0, 0.0))
    if determinant == 0.0:
        return _open_loop(robot, q11, q21)
    right1, right2 = still1.b * dq11, still2.b * dq21
    vx = (right1 * still2.u_y - right2 * still1.u_y) / determinant
    vy = (right2 * still1.u_x - right1 * still2.u_x) / determinant
    return State(_moving(robot.leg1, still1, dq11, vx, vy), _moving(robot.leg2, still2, dq21, vx, vy), x, y, vx, vy)


def _still(leg: LegParameters, q1: float, x: float, y: float) -> Leg:
    theta = math.atan2(y - leg.proximal * math.sin(q1), x - leg.base_x - leg.proximal * math.cos(q1))
    return leg_from_joints(leg, q1, wrap(theta - q1), 0.0, 0.0)


def _moving(parameters: LegParameters, leg: Leg, dq1: float, vx: float, vy: float) -> Leg:
    """Return a leg with its rates: the distal link turns by what its tip is faster than the elbow, across the link."""
    l_1 = parameters.proximal
    past_x, past_y = vx + l_1 * dq1 * leg.r_y, vy - l_1 * dq1 * leg.r_x
    dtheta = (leg.u_x * past_y - leg.u_y * past_x) / parameters.distal
    return leg._replace(dq1=dq1, dtheta=dtheta, c=parameters.distal * dtheta * dtheta + l_1 * leg.cos_q2 * dq1 * dq1)


def _open_loop(robot: FiveBar, q11: float, q21: float) -> State:
    nan = math.nan
    return State(
        leg_from_joints(robot.leg1, q11, nan, nan, nan),
        leg_from_joints(robot.leg2, q21, nan, nan, nan),
        nan,
        nan,
        nan,
        nan,
    )
