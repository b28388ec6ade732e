# SPDX-License-Identifier: Apache-2.0
"""The motion of the run's file in a node of the control chain, and what the nodes agree on about it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from fivebar_control.loop.shared_results import one_robot
from fivebar_control.scenario.keys import parameters_of
from fivebar_control.scenario.motion_file import MotionFile
from fivebar_control.scenario.start import initial_joints
from fivebar_control.trajectory.planner import Plan, PlanRefused
from fivebar_description.parameters import FiveBar
from fivebar_description.ros.node import GraphNode
from fivebar_description.ros.run_agreement import RunAgreement
from fivebar_description.run_plan import HOMING, LEAD_SAMPLES, START, WORKING_MODE_AT_START, MotionStart, robot_value
from fivebar_description.strict_yaml import InputError

if TYPE_CHECKING:
    from fivebar_control.scenario.scenario import ControlScenario


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
    """Every value of the motion by the name of its key, for the plan of the run."""


def declared_motion(node: GraphNode, scenario: MotionFile) -> DeclaredMotion:
    """Plan the motion of a run's file, and have the node keep to the plan of the run.

    Raises:
        InputError: the motion is refused.
    """
    try:
        plan = scenario.plan()
    except PlanRefused as error:
        raise InputError(f"{node.get_name()}: motion refused: {error}") from error
    agreed = {
        "robot": robot_value(scenario.robot),
        "rate_hz": scenario.rate_hz,
        "working_mode": list(scenario.signs()),
        "waypoints": [coordinate for waypoint in scenario.waypoints for coordinate in waypoint],
        "segment_duration": list(scenario.durations()),
        "time_law": scenario.time_law,
        "min_authority": scenario.min_authority,
        "blend_radius": list(scenario.blend_radii()),
        **({"trajectory": scenario.trajectory} if scenario.trajectory else {}),
        **parameters_of(scenario, ("zone",)),
    }
    RunAgreement(node, scenario.rate_hz, {**agreed, LEAD_SAMPLES: scenario.lead_samples})
    return DeclaredMotion(one_robot(scenario.five_bar()), plan, scenario.rate_hz, scenario.lead_samples, agreed)


def plan_values(motion: DeclaredMotion, scenario: ControlScenario) -> dict[str, Any]:
    """Return what the plan of the run holds: the motion, and what nodes need of it that know part of the file only."""
    return {
        **motion.agreed,
        **start_values(scenario),
        HOMING: motion.agreed["waypoints"][:2],
        LEAD_SAMPLES: motion.lead_samples,
        START: MotionStart(
            motion.plan.path.samples(motion.rate_hz), initial_joints(scenario), scenario.reads_late
        )._asdict(),
    }


def start_values(scenario: MotionFile) -> dict[str, Any]:
    """Return what a node agrees on with the plan that knows the start of the motion only."""
    return {"robot": robot_value(scenario.robot), WORKING_MODE_AT_START: list(scenario.working_mode)}
