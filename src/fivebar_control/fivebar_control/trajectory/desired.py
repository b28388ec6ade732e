"""The desired instant of a plan as the controllers take it, in whatever coordinates the motion was planned."""

from __future__ import annotations

from fivebar_control.laws.reference import (
    Reference,
    reference_at_rest,
    reference_from_motors,
    reference_from_platform,
)
from fivebar_control.model.state import Platform
from fivebar_control.trajectory.joint_segment import JointSegment
from fivebar_control.trajectory.planner import Plan
from fivebar_description.parameters import FiveBar


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
