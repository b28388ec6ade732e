# SPDX-License-Identifier: Apache-2.0
"""The node graph of a robot that rests after its motion and takes requests."""

from __future__ import annotations

from fivebar_bringup.graph.node_spec import EMULATED_ROBOT, PLANT, NodeSpec
from fivebar_bringup.odds.robot_errors import has_odds
from fivebar_bringup.scenario import Scenario
from fivebar_control.laws.registry import goal_controllers
from fivebar_control.ros.node_settings import HOLD
from fivebar_description.strict_yaml import InputError

GENERATOR = "trajectory_generator"

PLANNER = "fivebar_bringup.motions.planner_with_odds:planner_of"
"""Planner of requests where robots can be drawn to find out how likely they are to succeed."""

LONGEST = 100_000_000
"""Number of the last sample of a plant that goes on until it is stopped: 55 hours at 500 Hz."""


def check_takes_goals(scenario: Scenario) -> None:
    """Check that a scenario's controller follows requests.

    Raises:
        InputError: it does not.
    """
    if not scenario.scheme().takes_goals:
        raise InputError(
            f"controller: {scenario.controller}: accepts no goals: expected {' or '.join(goal_controllers())}"
        )


def standing(node: NodeSpec, last: int, scenario: Scenario) -> NodeSpec:
    """Return a node of a graph whose plant goes on to a last sample, as a node of a robot that rests and is asked."""
    if node.executable == GENERATOR:
        # a robot that stands is to be found there again after a fault, in lockstep too
        asked = {"after_fault": HOLD, "planner": PLANNER if has_odds(scenario) else ""}
        return node._replace(parameters={**node.parameters, **asked})
    if node.executable not in (PLANT, EMULATED_ROBOT):
        return node
    return node._replace(parameters={**node.parameters, "samples": last})
