# SPDX-License-Identifier: Apache-2.0
"""Motions planned in the motors' angles: regular where a leg is stretched (Type 1), which the platform's are not.

The platform follows by direct geometry in one assembly mode, so such a motion stays away from Type 2, where the motors
do not fix the platform. Through Type 1 the sign of sin q_i2, the working mode of leg i, changes by itself.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from fivebar_control.model.kinematics import platform_acceleration, state_from_motors, working_mode
from fivebar_control.model.line import Line
from fivebar_control.model.state import MotorMotion, Platform, State, WorkingMode
from fivebar_control.trajectory.time_scaling import rest_to_rest_without_jerk
from fivebar_description.parameters import FiveBar

NO_LINE = Line(math.nan, math.nan, math.nan, math.nan)
"""The line of a motion that is not straight in the plane."""


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

    def motors_at(self, t: float) -> MotorMotion:
        """Return both motors at time t (s); before and after the segment they rest."""
        s, ds, dds = rest_to_rest_without_jerk((t - self.start_time) / self.duration)
        rate, bend = ds / self.duration, dds / (self.duration * self.duration)
        return MotorMotion(
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

    def mode_at(self, t: float) -> WorkingMode:
        """Return the working mode at time t (s); on the boundary that of sin q_i2 < 0."""
        return working_mode(self.state_at(t))

    def line_at(self, t: float) -> Line:
        """Return NaN: the way in the plane is no line."""
        return NO_LINE
