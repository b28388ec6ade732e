"""The motion that a node plans from its parameters."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any, NamedTuple

from fivebar_control.loop.shared_results import one_robot
from fivebar_control.ros.node_settings import ZONE_PREFIX, MotionSettings
from fivebar_control.trajectory.planner import Plan, PlanRefused, ZoneSettings, plan_motion
from fivebar_description.parameters import FiveBar
from fivebar_description.robot_file import load_robot
from fivebar_description.ros.node import GraphNode
from fivebar_description.ros.run_agreement import RunAgreement
from fivebar_description.run_plan import HOMING, LEAD_SAMPLES, WORKING_MODE_AT_START, robot_value
from fivebar_description.settings import to_parameters
from fivebar_description.strict_yaml import InputError


class DeclaredMotion(NamedTuple):
    """The motion as a node needs it: the robot, the checked plan, the sampling rate and the lead.

    With a lead of d samples, messages stamped with sample k (the estimated state, the reference, and everything
    computed from them) describe the time of sample k + d, when the torque that answers sample k starts to act.
    """

    robot: FiveBar
    plan: Plan
    rate_hz: int
    lead_samples: int
    agreed: dict[str, Any]
    """Every value of the motion by the name of its parameter, for the plan of the run."""


def declare_motion(node: GraphNode) -> DeclaredMotion:
    """Declare the motion's parameters on a node, plan the motion from their values, and have the node keep to the plan.

    Raises:
        InputError: a parameter is malformed or the motion is refused.
    """
    settings = node.declare_settings(MotionSettings)
    zone = node.declare_settings(ZoneSettings, ZONE_PREFIX)
    robot = one_robot(load_robot(settings.robot))
    try:
        plan = _planned(robot, settings, zone)
    except PlanRefused as error:
        raise InputError(f"{node.get_name()}: motion refused: {error}") from error
    agreed = {
        **to_parameters(settings),
        **to_parameters(zone, ZONE_PREFIX),
        "robot": robot_value(settings.robot),
    }
    RunAgreement(node, settings.rate_hz, agreed)
    return DeclaredMotion(robot, plan, settings.rate_hz, settings.lead_samples, agreed)


@lru_cache(maxsize=8)
def _planned(robot: FiveBar, settings: MotionSettings, zone: ZoneSettings) -> Plan:
    """Return the plan, one for all nodes of this process."""
    return plan_motion(
        robot,
        settings.working_mode,
        _pairs(settings.waypoints),
        settings.segment_durations,
        settings.rate_hz,
        zone.as_rule(),
        settings.time_law,
        settings.min_authority,
        settings.blend_radius,
    )


def plan_values(motion: DeclaredMotion) -> dict[str, Any]:
    """Return what the plan of the run holds: the motion, and the same under the names of nodes that know part of it."""
    return {
        **motion.agreed,
        WORKING_MODE_AT_START: motion.agreed["working_mode"][:2],
        HOMING: motion.agreed["waypoints"][:2],
        LEAD_SAMPLES: motion.lead_samples,
    }


def _pairs(flat: Sequence[float]) -> list[tuple[float, float]]:
    if len(flat) % 2 != 0:
        raise PlanRefused(f"waypoints: {len(flat)} numbers: expected pairs x, y")
    return list(zip(flat[::2], flat[1::2], strict=True))
