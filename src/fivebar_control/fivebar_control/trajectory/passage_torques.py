# SPDX-License-Identifier: Apache-2.0
"""Torques along a path as toppra takes them, linear in sddot and sdot^2, with equal limits for both motors.

This module loads toppra; only what plans with a time law of least torque imports it.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from toppra.constraint import LinearConstraint

from fivebar_control.compiling import as_machine_code
from fivebar_control.model.dynamics import inverse_dynamics_of_platform
from fivebar_control.model.kinematics import state_from_platform
from fivebar_control.model.state import WorkingMode
from fivebar_control.trajectory.path import AnyWay
from fivebar_description.parameters import FiveBar, with_floats

FloatArray = NDArray[np.float64]

OFF_LOCUS = 1e-7
"""Share of the way by which a point of the grid is moved that has no inverse dynamics."""


def torques_along(robot: FiveBar, mode: WorkingMode, way: AnyWay, grid: FloatArray) -> FloatArray:
    """Return the motors' torques beyond friction (Nm) at points of a way, [3, N, 2].

    They are those at rest, what comes on top with sddot = 1, and with sdot = 1 (1/s^2, 1/s), NaN where there are none.
    """
    places = np.array([way.at(s) for s in grid.tolist()])
    torques = _torques_at(robot, mode, places)
    undefined = ~np.all(np.isfinite(torques), axis=(0, 2))
    if np.any(undefined):
        places[undefined] = [way.at(s + OFF_LOCUS) for s in grid[undefined].tolist()]
        torques = _torques_at(robot, mode, places)
    torques[1:] -= torques[0]
    return torques


def friction_along(robot: FiveBar, mode: WorkingMode, way: AnyWay, grid: FloatArray) -> FloatArray:
    """Return the motors' friction (Nm) on the way forwards, [N, 2], without its smoothing at rest."""
    friction = np.empty((len(grid), 2))
    for number, s in enumerate(grid.tolist()):
        x, y, d_x, d_y, _, _ = way.at(s)
        state = state_from_platform(robot, mode, x, y, d_x, d_y)
        for motor, (leg, moving) in enumerate(((robot.leg1, state.leg1), (robot.leg2, state.leg2))):
            friction[number, motor] = leg.coulomb * np.sign(moving.dq1) + leg.offset
    return friction


def _torques_at(robot: FiveBar, mode: WorkingMode, places: FloatArray) -> FloatArray:
    torques = np.empty((3, len(places), 2))
    as_machine_code(write_torques)(with_floats(robot), mode, places, torques)
    return torques


def write_torques(robot: FiveBar, mode: WorkingMode, places: FloatArray, torques: FloatArray) -> None:
    """Write the torques (Nm) at places and derivatives (m) of a way, [N, 6], for sdot, sddot = 0, 0; 0, 1; 1, 0."""
    for number in range(len(places)):
        # as plain numbers, with which Python computes faster
        x, y = float(places[number, 0]), float(places[number, 1])
        d_x, d_y = float(places[number, 2]), float(places[number, 3])
        b_x, b_y = float(places[number, 4]), float(places[number, 5])
        rests = state_from_platform(robot, mode, x, y, 0.0, 0.0)
        moves = state_from_platform(robot, mode, x, y, d_x, d_y)
        still = inverse_dynamics_of_platform(robot, rests, 0.0, 0.0, 0.0, 0.0)
        accelerated = inverse_dynamics_of_platform(robot, rests, d_x, d_y, 0.0, 0.0)
        moved = inverse_dynamics_of_platform(robot, moves, b_x, b_y, 0.0, 0.0)
        torques[0, number, 0], torques[0, number, 1] = still
        torques[1, number, 0], torques[1, number, 1] = accelerated
        torques[2, number, 0], torques[2, number, 1] = moved


class TorqueLimits(LinearConstraint):
    """Torques of at most 1 Nm, given along the grid as `torques_along` returns them, or more such rows."""

    def __init__(self, torques: FloatArray, scale: float) -> None:
        """Bind the torques, [3, N, rows].

        The solver is given the limits multiplied by `scale`, since its tolerances are absolute.
        """
        super().__init__()
        self.identical = True
        self._torques, self._scale = torques, scale

    def compute_constraint_params(self, path: Any, gridpoints: FloatArray) -> tuple[Any, ...]:
        """Return a, b, c, F and g of F (a sddot + b sdot^2 + c) <= g at the grid's points, without further bounds."""
        rest, per_acceleration, per_speed = self._torques
        each = np.eye(rest.shape[1])
        both = np.vstack((each, -each))
        return per_acceleration, per_speed, rest, self._scale * both, self._scale * np.ones(len(both)), None, None
