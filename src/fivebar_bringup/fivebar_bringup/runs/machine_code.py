# SPDX-License-Identifier: Apache-2.0
"""Machine code that the nodes of a run load: compiled before they start, since that takes longer than they wait."""

from __future__ import annotations

from fivebar_bringup.graph.node_spec import Mode
from fivebar_bringup.scenario import Scenario
from fivebar_control.ros.node_settings import runs_compiled
from fivebar_control.scenario.guard_settings import guard_settings
from fivebar_control.scenario.law_settings import tuned_controller


def compile_for(scenario: Scenario, mode: Mode, finds_odds: bool = False) -> None:
    """Compile what the nodes of a run have compiled, where no earlier run has; some ten seconds the first time.

    With `finds_odds` also the engine, on which the planner of requests tries drawn robots.
    """
    if finds_odds:
        # here, because the engine takes long to load
        from fivebar_bringup.odds.trials import declared_odds

        declared_odds(scenario, 1)
    if not runs_compiled(mode.value, scenario.rate_hz):
        return
    # numba takes most of a second to import
    from fivebar_control.loop.part_choice import estimator_part, guard_part, law_part, supervisor_part

    robot, plan, lead = scenario.five_bar(), scenario.plan(), scenario.lead_samples
    tuned = tuned_controller(scenario)
    for law in tuned.laws:
        law_part(law, True, robot, plan, scenario.rate_hz, lead)
    guard_part(True)(robot, scenario.working_mode, scenario.rate_hz, guard_settings(scenario))
    supervisor_part(True)(robot, plan, scenario.rate_hz, lead, scenario.scheme().weighting)
    if scenario.estimated:
        from fivebar_control.controller.estimator import estimator_of

        estimator_of(scenario, kind=estimator_part(True)).warm_up()
