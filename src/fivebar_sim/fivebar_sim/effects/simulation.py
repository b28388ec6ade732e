# SPDX-License-Identifier: Apache-2.0
"""The robot with effects in motion, for the plant."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from fivebar_description.closed_loop import Vector
from fivebar_description.parameters import FiveBar
from fivebar_description.strict_yaml import InputError
from fivebar_sim.effects.loads import held
from fivebar_sim.effects.mechanism import Mechanism, mechanism_of
from fivebar_sim.effects.mechanism_state import MechanismState, Moved
from fivebar_sim.effects.motion import advanced, started
from fivebar_sim.effects.observation import ImuMotion, imu_motion, joints_of, joints_seen
from fivebar_sim.effects.settings import PlantSettings

POSTURE_TOLERANCE = 1e-9
"""Largest closure gap (m) in the initial posture."""


def started_at(mechanism: Mechanism, joints: Sequence[float]) -> MechanismState:
    """Return the robot at rest where its motors' encoders read those of a posture (rad).

    Raises:
        InputError: the posture is malformed, or its legs cannot meet.
    """
    if len(joints) != 4 or not all(map(math.isfinite, joints)):
        raise InputError(f"initial_joints: {list(joints)}: expected four finite angles in rad")
    start = started(mechanism, *map(float, joints))
    if not start.gap <= POSTURE_TOLERANCE:
        raise InputError(
            f"initial_joints: {list(joints)}: with the actual lengths the legs do not meet where the motors are:"
            " expected smaller errors in plant.links, or a start farther from the Type 2 locus"
        )
    return start.state


class EffectsMotion:
    """The mechanism of some settings, from sample to sample."""

    def __init__(self, robot: FiveBar, settings: PlantSettings, rate_hz: int, joints: Sequence[float]) -> None:
        """Put the robot where its motors' encoders read those of a posture (rad).

        Raises:
            InputError: the posture is malformed, its legs cannot meet, or effects contradict each other.
        """
        self._settings, self._rate_hz = settings, rate_hz
        self.mechanism = mechanism_of(robot, settings, rate_hz)
        self._state = started_at(self.mechanism, joints)
        self._number = 0
        self.later: Callable[..., Moved] = advanced
        """How it moves on; machine code of the same function may take its place."""

    @property
    def step(self) -> float:
        """The integration step (s)."""
        return self.mechanism.step

    @property
    def joints(self) -> tuple[Vector, Vector]:
        """The actual angles (rad) and rates (rad/s) of the four joints, each (4,)."""
        values = np.array(joints_of(self._state))
        return values[:4], values[4:]

    @property
    def seen(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """The same as encoders see them."""
        values = joints_seen(self._state)
        return values[:4], values[4:]

    def advance(self, applied: tuple[float, float]) -> float:
        """Move on by a sample under applied torques (Nm); return the loop's gap (m), infinite where that cannot be."""
        after = self.later(self.mechanism, self._state, self._number, *applied)
        if math.isfinite(after.gap):
            self._state = after.state
            self._number += 1
        return after.gap

    def hold(self, x: float, y: float) -> None:
        """Hold a force (N) on the platform from now on, in place of any push, such as that of a hand."""
        self.mechanism = self.mechanism._replace(push=held(x, y))

    def carry(self, robot: FiveBar) -> None:
        """Go on with another mass of the platform, that of a modelled robot."""
        self.mechanism = mechanism_of(robot, self._settings, self._rate_hz)._replace(push=self.mechanism.push)

    def imu_motion(self) -> ImuMotion:
        """Return the motion of the link that carries the IMU."""
        return imu_motion(self.mechanism, self._state, self._number * self.mechanism.period)
