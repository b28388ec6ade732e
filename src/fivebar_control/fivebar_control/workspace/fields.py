# SPDX-License-Identifier: Apache-2.0
"""Kinematic measures on grids: over the plane of the platform and over that of the motor angles."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_control.model.geometry import elbow_position, reach_margin, workspace_margin
from fivebar_control.model.kinematics import det_a, state_from_motors, state_from_platform, working_mode
from fivebar_control.model.singularity import inverse_condition, type2_distance
from fivebar_control.model.state import WorkingMode
from fivebar_control.planning.postures import WORKING_MODES
from fivebar_control.workspace.loci import Loci
from fivebar_description.parameters import FiveBar

FloatArray = NDArray[np.float64]
Progress = Callable[[int, int], None]

ASSEMBLY_MODES = (1, -1)

FINEST = 1e-5
"""A grid is refined at most to cells of this size (m)."""


class PlatformGrid(NamedTuple):
    """Cells of the platform's plane: centres x [m] and y [n] in m, sides `cell` in m.

    Attributes:
        reach: [n, m] how far (m) inside the reach of both legs; negative outside.
    """

    x: FloatArray
    y: FloatArray
    cell: float
    reach: FloatArray


class PlatformField(NamedTuple):
    """One working mode on a platform grid [n, m]; NaN out of reach.

    Attributes:
        det_a: its sign is the assembly mode.
        kappa: 1 / cond(A).
        locus: distance (m) from the Type 2 locus, to first order; negative where det A is.
    """

    det_a: FloatArray
    kappa: FloatArray
    locus: FloatArray


class MotorGrid(NamedTuple):
    """Cells of the plane of the motor angles: centres q [n] in rad for both, from -pi to pi.

    Attributes:
        closure: [n, n], row q21, column q11: how far (m) inside the ring in which elbow 2 has to be for the distal
            links to meet; negative where the loop does not close, 0 on the Type 2 locus.
    """

    q: FloatArray
    closure: FloatArray


class MotorField(NamedTuple):
    """One assembly mode on a motor grid [n, n]; NaN where the loop does not close.

    Attributes:
        kappa: 1 / cond(A).
        working_mode: index into WORKING_MODES.
    """

    kappa: FloatArray
    working_mode: FloatArray


class Fields(NamedTuple):
    """All fields of one robot: per working mode over the platform's plane, per assembly mode over the motors'."""

    platform_grid: PlatformGrid
    platform: dict[tuple[int, int], PlatformField]
    motor_grid: MotorGrid
    motors: dict[int, MotorField]


def evaluate(robot: FiveBar, loci: Loci, count: int, progress: Progress) -> Fields:
    """Return all fields on grids with `count` cells along the longer side; `progress` is called for every row.

    The platform's grid covers the workspace, which ends where a leg is at Type 1.
    """
    edge = np.concatenate([piece.curve.platform for piece in loci.type1])
    grid, motors = platform_grid(robot, np.min(edge, axis=0), np.max(edge, axis=0), count), _motor_grid(robot, count)
    total = len(WORKING_MODES) * len(grid.y) + len(ASSEMBLY_MODES) * len(motors.q)
    rows = iter(range(1, total + 1))

    def row_done() -> None:
        progress(next(rows), total)

    return Fields(
        grid,
        {modes: platform_field(robot, modes, grid, row_done) for modes in WORKING_MODES},
        motors,
        {assembly: _motor_field(robot, assembly, motors, row_done) for assembly in ASSEMBLY_MODES},
    )


def closure_margin(robot: FiveBar, q11: float, q21: float) -> float:
    """Return how far (m) elbow 2 is inside the ring around elbow 1 that both distal links in a row reach.

    Negative where the loop cannot close; 0 where the distal links are stretched or folded.
    """
    chain = robot.leg1._replace(base_x=0.0, proximal=robot.leg1.distal, distal=robot.leg2.distal)
    elbow1_x, elbow1_y = elbow_position(robot.leg1, q11)
    elbow2_x, elbow2_y = elbow_position(robot.leg2, q21)
    return reach_margin(chain, elbow2_x - elbow1_x, elbow2_y - elbow1_y)


def platform_grid(robot: FiveBar, low: FloatArray, high: FloatArray, count: int) -> PlatformGrid:
    """Return a grid over a rectangle with corners `low` and `high` [2] (m) and one cell around it.

    It has `count` cells along the longer side, both margins included.
    """
    cell = max(float(np.max(high - low)) / (count - 2), FINEST)
    columns, rows = (int(side) for side in np.ceil((high - low) / cell) + 2)
    middle = 0.5 * (low + high)
    x = middle[0] + cell * (np.arange(columns) - 0.5 * (columns - 1))
    y = middle[1] + cell * (np.arange(rows) - 0.5 * (rows - 1))
    reach = [[workspace_margin(robot, a, b) for a in x.tolist()] for b in y.tolist()]
    return PlatformGrid(x, y, cell, np.array(reach))


def platform_field(
    robot: FiveBar, modes: WorkingMode, grid: PlatformGrid, progress: Callable[[], None] = lambda: None
) -> PlatformField:
    """Return a working mode on a grid; `progress` is called after every row."""
    field = PlatformField(*(np.full(grid.reach.shape, math.nan) for _ in range(3)))
    for row, y in enumerate(grid.y.tolist()):
        for column in np.flatnonzero(grid.reach[row] > 0.0).tolist():
            state = state_from_platform(robot, modes, float(grid.x[column]), y, 0.0, 0.0)
            determinant = det_a(state)
            field.det_a[row, column] = determinant
            field.kappa[row, column] = inverse_condition(state)
            field.locus[row, column] = math.copysign(type2_distance(robot, state), determinant)
        progress()
    return field


def _motor_field(robot: FiveBar, assembly: int, grid: MotorGrid, progress: Callable[[], None]) -> MotorField:
    field = MotorField(*(np.full(grid.closure.shape, math.nan) for _ in range(2)))
    for row, q21 in enumerate(grid.q.tolist()):
        for column in np.flatnonzero(grid.closure[row] > 0.0).tolist():
            state = state_from_motors(robot, assembly, float(grid.q[column]), q21, 0.0, 0.0)
            field.kappa[row, column] = inverse_condition(state)
            field.working_mode[row, column] = WORKING_MODES.index(working_mode(state))
        progress()
    return field


def _motor_grid(robot: FiveBar, count: int) -> MotorGrid:
    q = math.pi * ((2.0 * np.arange(count) + 1.0) / count - 1.0)
    closure = [[closure_margin(robot, q11, q21) for q11 in q.tolist()] for q21 in q.tolist()]
    return MotorGrid(q, np.array(closure))
