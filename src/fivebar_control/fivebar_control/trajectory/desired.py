"""The desired instant of a plan as the controllers take it, in whatever coordinates the motion was planned."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fivebar_control.laws.reference import Reference, reference_at_rest, reference_from_motors, reference_from_platform
from fivebar_control.machine_code import as_machine_code
from fivebar_control.model.state import Platform
from fivebar_control.trajectory.joint_segment import JointSegment
from fivebar_control.trajectory.planner import Plan
from fivebar_control.trajectory.reference_row import REFERENCE_VALUES, write_reference
from fivebar_description.parameters import FiveBar, with_floats

FloatArray = NDArray[np.float64]


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
    return reference_from_platform(robot, *plan.modes_at(t), platform)


def desired_along(robot: FiveBar, plan: Plan, times: Sequence[float]) -> FloatArray:
    """Return the desired instants at times (s) as `write_reference` writes them, [N, REFERENCE_VALUES]."""
    platforms = [plan.path.at(t) for t in times]
    rows = np.empty((len(times), REFERENCE_VALUES))
    if plan.modes:
        for t, platform, row in zip(times, platforms, rows, strict=True):
            write_reference(desired_at(robot, plan, t, platform), row)
    else:
        motion = np.array(platforms, dtype=np.float64).reshape(len(times), len(Platform._fields))
        as_machine_code(write_references)(with_floats(robot), plan.mode1, plan.mode2, motion, rows)
    return rows


def write_references(robot: FiveBar, mode1: int, mode2: int, motion: FloatArray, rows: FloatArray) -> None:
    """Write the desired instants of a platform motion in a working mode, [N, 6] as in `Platform`, into rows."""
    for number in range(len(motion)):
        m = motion[number]
        platform = Platform(float(m[0]), float(m[1]), float(m[2]), float(m[3]), float(m[4]), float(m[5]))
        write_reference(reference_from_platform(robot, mode1, mode2, platform), rows[number])
