# SPDX-License-Identifier: Apache-2.0
"""The screen's verdict on the motion of a scenario."""

from __future__ import annotations

from fivebar_bringup.scenario import Scenario
from fivebar_control.planning.feasibility import screen_run
from fivebar_control.planning.figures import Feasibility
from fivebar_control.scenario.law_settings import tuned_controller
from fivebar_control.scenario.motion_limits import scenario_limits
from fivebar_control.scenario.sensors import sensing_if_estimated
from fivebar_control.trajectory.planner import Plan


def screened(scenario: Scenario, plan: Plan, judge_loads: bool = True) -> Feasibility:
    """Return the screen's verdict on a scenario with its plan, with or without a judgement of the declared loads."""
    limits = scenario_limits(scenario, plan)
    if not judge_loads:
        limits = limits.without_loads()
    return screen_run(
        scenario.five_bar(), plan, scenario.rate_hz, tuned_controller(scenario), limits, sensing_if_estimated(scenario)
    )
