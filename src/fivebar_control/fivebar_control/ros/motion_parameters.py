"""The parameters that describe a motion: every node that needs the plan makes it from these, so there is one plan."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from fivebar_control.laws.law import MIN_AUTHORITY
from fivebar_control.ros.model_parameters import LEAD, RATE, ROBOT, WORKING_MODE
from fivebar_control.trajectory.planner import (
    QUINTIC,
    TIME_LAWS,
    Plan,
    PlanRefused,
    ZoneRule,
    plan_motion,
)
from fivebar_description.parameters import FiveBar, load_robot
from fivebar_description.ros.node import GraphNode
from fivebar_description.ros.parameters import Spec
from fivebar_description.strict_yaml import InputError

WORKING_MODES = WORKING_MODE._replace(
    description=f"{WORKING_MODE.description} Two signs, or two for every waypoint of a motion that may meet Type 1."
)

MOTION = (
    ROBOT,
    RATE,
    WORKING_MODES,
    Spec("waypoints", [0.0, 0.15, 0.0, 0.02, 0.0, 0.15], "Rest points of the path: x1, y1, x2, y2, ...", "m"),
    Spec("segment_durations", [1.0, 1.0], "Duration of each segment.", "s"),
    Spec("time_law", QUINTIC, "How the reference passes along a segment.", choices=TIME_LAWS),
    Spec("zone_rule", "ballistic", "How the blending zones are sized.", choices=("ballistic", "fixed")),
    Spec("zone_duration_ms", 40.0, "Time with sigma = 1 at a crossing, for the ballistic rule.", "ms", 0.1, 10_000.0),
    Spec("zone_epsilon", 0.05, "Half width of the zones in 1/cond(A), for the fixed rule.", "", 1e-6, 0.5),
    Spec(
        "min_authority",
        MIN_AUTHORITY,
        "Least |n.v1| at a crossing of the Type 2 locus; 0 for a law that does not hold the path by its normal.",
        "",
        0.0,
        1.0,
    ),
    LEAD,
)


class Motion(NamedTuple):
    """What a node knows of the motion: the robot, the checked plan, the sampling rate and the lead.

    With a lead of d samples the messages that carry the stamp of sample k are about the moment of sample k + d, when
    the torque that answers sample k begins to act: the estimated state, the reference, and all that follows from them.
    """

    robot: FiveBar
    plan: Plan
    rate_hz: int
    lead_samples: int = 0


def declare_motion(node: GraphNode) -> Motion:
    """Declare the motion's parameters on a node and plan the motion from their values.

    Raises:
        InputError: a parameter is malformed or the motion is refused.
    """
    values = node.parameters(MOTION)
    robot = load_robot(values["robot"])
    try:
        plan = plan_motion(
            robot,
            values["working_mode"],
            _pairs(values["waypoints"]),
            values["segment_durations"],
            values["rate_hz"],
            ZoneRule(
                duration=values["zone_duration_ms"] / 1e3,
                epsilon=values["zone_epsilon"] if values["zone_rule"] == "fixed" else None,
            ),
            values["time_law"],
            values["min_authority"],
        )
    except PlanRefused as error:
        raise InputError(f"{node.get_name()}: motion refused: {error}") from error
    return Motion(robot, plan, values["rate_hz"], values["lead_samples"])


def _pairs(flat: Sequence[float]) -> list[tuple[float, float]]:
    if len(flat) % 2 != 0:
        raise PlanRefused(f"waypoints: {len(flat)} numbers: expected pairs x, y")
    return list(zip(flat[::2], flat[1::2], strict=True))
