# SPDX-License-Identifier: Apache-2.0
"""Where a robot rests by its motors and a camera: what an estimator that has lost it can begin again from."""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

from fivebar_control.estimation.homing import Homing, HomingContradicted, check_declared, seen_posture
from fivebar_control.estimation.late_reading import LateReading
from fivebar_control.model.state import WorkingMode
from fivebar_description.parameters import FiveBar
from fivebar_description.whole_turns import same_turn

REST_TIME = 0.3
"""Time (s) for which the motors must have stood still."""

REST_ANGLE = 2e-3
"""Largest change (rad) of a motor's reading of a robot at rest, besides two counts."""

REST_DISTANCE = 1e-3
"""Largest distance (m) between two positions by the camera of a robot at rest: near the locus the platform may move
although the motors stand still."""


class MotorReading(NamedTuple):
    """Both motors' readings (rad) at a sample."""

    sample: int
    q11: float
    q21: float


class Resting:
    """The last readings of motors and camera, and the posture that follows from them once the robot rests."""

    def __init__(self, robot: FiveBar, working_mode: WorkingMode, rate_hz: int, resolution: float) -> None:
        """Begin without readings, with encoders of a resolution (rad)."""
        self._robot, self._working_mode = robot, working_mode
        self._samples = math.ceil(REST_TIME * rate_hz)
        self._still = REST_ANGLE + 2.0 * resolution
        self._motors: deque[MotorReading] = deque()
        self._seen: deque[LateReading] = deque(maxlen=2)

    def read(self, reading: MotorReading) -> None:
        """Take the motors' readings of a sample, which may be wrapped to one turn."""
        if self._motors:
            last = self._motors[-1]
            reading = MotorReading(reading.sample, same_turn(reading.q11, last.q11), same_turn(reading.q21, last.q21))
        self._motors.append(reading)
        while self._motors[0].sample < reading.sample - self._samples:
            self._motors.popleft()

    def see(self, seen: LateReading) -> None:
        """Take a position by the camera."""
        if math.isfinite(seen.value + seen.second):
            self._seen.append(seen)

    def posture(self) -> Homing:
        """Return where the robot rests.

        Raises:
            HomingContradicted: it moves, the camera does not see it, or it rests where its modes look alike.
        """
        if not self._motors or self._motors[-1].sample - self._motors[0].sample < self._samples:
            raise HomingContradicted(f"the motors have not been read for {REST_TIME:g} s")
        last, begun = self._motors[-1], self._motors[0].sample
        turned = max(max(abs(motor.q11 - last.q11), abs(motor.q21 - last.q21)) for motor in self._motors)
        if turned > self._still:
            raise HomingContradicted(f"the motors have turned by {turned:.4f} rad within {REST_TIME:g} s")
        if len(self._seen) < 2 or self._seen[0].made < begun:
            raise HomingContradicted("the camera has not seen the platform twice since the motors stand still")
        earlier, later = self._seen
        moved = math.hypot(later.value - earlier.value, later.second - earlier.second)
        if moved > REST_DISTANCE:
            raise HomingContradicted(f"by the camera the platform still moves, {1e3 * moved:.1f} mm in a picture")
        homing = seen_posture(self._robot, last.q11, last.q21, later.value, later.second)
        if homing.mode != self._working_mode:
            raise HomingContradicted(
                f"the robot is in working mode {list(homing.mode)}, the controllers are for {list(self._working_mode)}"
            )
        check_declared(self._robot, homing)
        return homing
