# SPDX-License-Identifier: Apache-2.0
"""Applies the planner's feasibility screen to the runs of a comparison."""

from __future__ import annotations

from itertools import pairwise

from fivebar_bringup.scenario import Scenario
from fivebar_control.planning.course import Course
from fivebar_control.planning.feasibility import screen
from fivebar_control.planning.pacing import NoPace, Task, pace_of, slowest_pace
from fivebar_control.scenario.law_settings import tuned_controller
from fivebar_control.scenario.motion_limits import scenario_limits
from fivebar_control.trajectory.planner import Plan, PlanRefused
from fivebar_control.trajectory.time_laws import QUINTIC


def objections(scenario: Scenario, plan: Plan) -> tuple[str, ...]:
    """Return why the screen refuses a motion under the scenario's torque limit; empty where it does not."""
    tuned, limits = tuned_controller(scenario), scenario_limits(scenario)
    return tuple(screen(scenario.five_bar(), plan, scenario.rate_hz, tuned, limits).reasons)


def has_quickest(scenario: Scenario) -> bool:
    """Return whether the screen can find the quickest pace: of straight fifth-order segments in one working mode."""
    return scenario.time_law == QUINTIC and scenario.working_modes is None and not scenario.rounded


def quickest_durations(scenario: Scenario) -> tuple[float, ...]:
    """Return the shortest durations (s) of the segments that the screen allows under the scenario's torque limit.

    They are found for ballistic blending zones.

    Raises:
        PlanRefused: a segment has none, or the motion is not one of straight fifth-order segments in one working mode.
    """
    if not has_quickest(scenario):
        raise PlanRefused("the quickest pace is only known for straight fifth-order segments in one working mode")
    robot, mode = scenario.five_bar(), scenario.working_mode
    task = Task(robot, mode, scenario.rate_hz, tuned_controller(scenario), scenario_limits(scenario))
    durations = []
    for number, (start, end) in enumerate(pairwise(scenario.waypoints), start=1):
        slowest = slowest_pace(task, Course((start, end)).for_robot(task.robot))
        if isinstance(slowest, NoPace):
            raise PlanRefused(f"segment {number}: {slowest.reason}")
        durations.append(pace_of(task, slowest).fastest)
    return tuple(durations)
