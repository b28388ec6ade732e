# SPDX-License-Identifier: Apache-2.0
"""The desired instant of a plan as the controllers take it, in whatever coordinates the motion was planned.

Compiled functions take desired instants by the hundred, as rows of an array.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fivebar_control.compiling import as_machine_code
from fivebar_control.laws.reference import Reference, reference_at_rest, reference_from_motors, reference_from_platform
from fivebar_control.model.state import Leg, Platform, State, WorkingMode
from fivebar_control.trajectory.joint_segment import JointSegment
from fivebar_control.trajectory.planner import Plan
from fivebar_description.parameters import FiveBar, with_floats

FloatArray = NDArray[np.float64]

LEG_VALUES = len(Leg._fields)
REFERENCE_VALUES = 2 * LEG_VALUES + 4 + len(Reference._fields) - 1
"""Numbers of a leg and of a desired instant in the row of an array."""


def desired_at(robot: FiveBar, plan: Plan, t: float, platform: Platform) -> Reference:
    """Return the desired instant at time t (s) for the platform's reference of that moment.

    The legs follow from the platform by inverse geometry, except where the motion was planned in the motors' angles:
    at Type 1 only these give the motors' speeds. A reference that has left the plan there is taken to stand still, as
    one does that is held after a fault.
    """
    segment = plan.path.segments[plan.path.segment_index(t)]
    if isinstance(segment, JointSegment):
        state = segment.state_at(t)
        if platform != segment.at(t):
            return reference_at_rest(robot, state._replace(x=platform.x, y=platform.y, vx=0.0, vy=0.0))
        motors = segment.motors_at(t)
        return reference_from_motors(robot, state, platform.ax, platform.ay, motors.ddq11, motors.ddq21)
    return reference_from_platform(robot, plan.mode_at(t), platform)


def desired_along(robot: FiveBar, plan: Plan, times: Sequence[float]) -> FloatArray:
    """Return the desired instants at times (s) as `write_reference` writes them, [N, REFERENCE_VALUES]."""
    platforms = [plan.path.at(t) for t in times]
    rows = np.empty((len(times), REFERENCE_VALUES))
    if plan.modes:
        for t, platform, row in zip(times, platforms, rows, strict=True):
            write_reference(desired_at(robot, plan, t, platform), row)
    else:
        motion = np.array(platforms, dtype=np.float64).reshape(len(times), len(Platform._fields))
        as_machine_code(write_references)(with_floats(robot), plan.mode, motion, rows)
    return rows


def write_references(robot: FiveBar, mode: WorkingMode, motion: FloatArray, rows: FloatArray) -> None:
    """Write the desired instants of a platform motion in a working mode, [N, 6] as in `Platform`, into rows."""
    for number in range(len(motion)):
        m = motion[number]
        platform = Platform(float(m[0]), float(m[1]), float(m[2]), float(m[3]), float(m[4]), float(m[5]))
        write_reference(reference_from_platform(robot, mode, platform), rows[number])


def write_reference(reference: Reference, row: NDArray[np.float64]) -> None:
    """Write a desired instant into a row, [REFERENCE_VALUES]: both legs, the platform, and the rest in order."""
    state = reference.state
    for index, value in enumerate(state.leg1):
        row[index] = value
    for index, value in enumerate(state.leg2):
        row[LEG_VALUES + index] = value
    row[24], row[25], row[26], row[27] = state.x, state.y, state.vx, state.vy
    row[28], row[29], row[30], row[31] = reference.ax, reference.ay, reference.f1, reference.f2
    row[32], row[33], row[34] = 1.0 if reference.by_motors else 0.0, reference.u1, reference.u2


def reference_of(row: NDArray[np.float64] | Sequence[float]) -> Reference:
    """Return the desired instant of such a row."""
    state = State(
        _leg_of(row, 0), _leg_of(row, LEG_VALUES), float(row[24]), float(row[25]), float(row[26]), float(row[27])
    )
    return Reference(
        state,
        float(row[28]),
        float(row[29]),
        float(row[30]),
        float(row[31]),
        row[32] != 0.0,
        float(row[33]),
        float(row[34]),
    )


def _leg_of(row: NDArray[np.float64] | Sequence[float], first: int) -> Leg:
    """Return the leg whose values begin at an index; as plain numbers, with which Python computes faster."""
    return Leg(
        float(row[first]),
        float(row[first + 1]),
        float(row[first + 2]),
        float(row[first + 3]),
        float(row[first + 4]),
        float(row[first + 5]),
        float(row[first + 6]),
        float(row[first + 7]),
        float(row[first + 8]),
        float(row[first + 9]),
        float(row[first + 10]),
        float(row[first + 11]),
    )
