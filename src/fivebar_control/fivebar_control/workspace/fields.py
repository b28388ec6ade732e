"""What varies over the plane of the platform, and over that of the motor angles, on grids."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_control.model.geometry import direct_geometry, reach_margin, wrap
from fivebar_control.model.kinematics import det_a, leg_from_joints, state_from_joints, state_from_platform
from fivebar_control.model.singularity import inverse_condition, type2_distance
from fivebar_control.model.state import Leg, State
from fivebar_control.trajectory.postures import WORKING_MODES
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
    """Return all fields on grids with `count` cells along the longer side; `progress` hears of every row."""
    platform_grid = _platform_grid(robot, loci, count)
    motor_grid = _motor_grid(robot, count)
    rows, columns = platform_grid.reach.shape
    total = rows + count
    platform = {
        modes: PlatformField(*(np.full((rows, columns), math.nan) for _ in range(3))) for modes in WORKING_MODES
    }
    for row, y in enumerate(platform_grid.y.tolist()):
        for column in np.flatnonzero(platform_grid.reach[row] > 0.0).tolist():
            x = float(platform_grid.x[column])
            for modes, field in platform.items():
                state = state_from_platform(robot, *modes, x, y, 0.0, 0.0)
                field.det_a[row, column] = det_a(state)
                field.kappa[row, column] = inverse_condition(state)
                field.locus[row, column] = math.copysign(type2_distance(robot, state), det_a(state))
        progress(row + 1, total)
    motors = {
        assembly: MotorField(*(np.full((count, count), math.nan) for _ in range(2))) for assembly in ASSEMBLY_MODES
    }
    for row, q21 in enumerate(motor_grid.q.tolist()):
        for column in np.flatnonzero(motor_grid.closure[row] > 0.0).tolist():
            q11 = float(motor_grid.q[column])
            for assembly, at_motors in motors.items():
                state = posture(robot, assembly, q11, q21)
                at_motors.kappa[row, column] = inverse_condition(state)
                at_motors.working_mode[row, column] = WORKING_MODES.index(working_mode(state))
        progress(rows + row + 1, total)
    return Fields(platform_grid, platform, motor_grid, motors)


def posture(robot: FiveBar, assembly: int, q11: float, q21: float) -> State:
    """Return the robot at rest for motor angles (rad) in an assembly mode, the passive angles from 3.37 and 3.38.

    NaN where the distal links cannot meet.
    """
    x, y = direct_geometry(robot, assembly, q11, q21)
    passive = []
    for leg, q1 in ((robot.leg1, q11), (robot.leg2, q21)):
        elbow_x, elbow_y = leg.base_x + leg.proximal * math.cos(q1), leg.proximal * math.sin(q1)
        passive.append(wrap(math.atan2(y - elbow_y, x - elbow_x) - q1))
    return state_from_joints(robot, q11, passive[0], q21, passive[1], 0.0, 0.0, 0.0, 0.0)


def working_mode(state: State) -> tuple[int, int]:
    """Return the working mode of a posture, +1 for elbows counter-clockwise of the line from base to platform."""

    def side(leg: Leg) -> int:
        return -1 if leg.sin_q2 > 0.0 else 1

    return side(state.leg1), side(state.leg2)


def closure_margin(robot: FiveBar, q11: float, q21: float) -> float:
    """Return how far (m) elbow 2 is inside the ring around elbow 1 that both distal links in a row reach.

    Negative where the loop cannot close; 0 where the distal links are stretched or folded.
    """
    chain = robot.leg1._replace(base_x=0.0, proximal=robot.leg1.distal, distal=robot.leg2.distal)
    leg1 = leg_from_joints(robot.leg1, q11, 0.0, 0.0, 0.0)
    leg2 = leg_from_joints(robot.leg2, q21, 0.0, 0.0, 0.0)
    return reach_margin(
        chain,
        robot.leg2.base_x + robot.leg2.proximal * leg2.r_x - robot.leg1.base_x - robot.leg1.proximal * leg1.r_x,
        robot.leg2.proximal * leg2.r_y - robot.leg1.proximal * leg1.r_y,
    )


def _platform_grid(robot: FiveBar, loci: Loci, count: int) -> PlatformGrid:
    """Return a grid over the workspace and one cell around it; the workspace ends where a leg is at Type 1."""
    edge = np.concatenate([piece.curve.platform for piece in loci.type1])
    low, high = np.min(edge, axis=0), np.max(edge, axis=0)
    cell = max(float(np.max(high - low)) / (count - 2), FINEST)
    columns, rows = (int(side) for side in np.ceil((high - low) / cell) + 2)
    middle = 0.5 * (low + high)
    x = middle[0] + cell * (np.arange(columns) - 0.5 * (columns - 1))
    y = middle[1] + cell * (np.arange(rows) - 0.5 * (rows - 1))
    reach = [[min(reach_margin(leg, a, b) for leg in (robot.leg1, robot.leg2)) for a in x.tolist()] for b in y.tolist()]
    return PlatformGrid(x, y, cell, np.array(reach))


def _motor_grid(robot: FiveBar, count: int) -> MotorGrid:
    q = math.pi * ((2.0 * np.arange(count) + 1.0) / count - 1.0)
    closure = [[closure_margin(robot, q11, q21) for q11 in q.tolist()] for q21 in q.tolist()]
    return MotorGrid(q, np.array(closure))
