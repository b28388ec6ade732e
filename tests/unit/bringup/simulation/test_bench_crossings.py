# SPDX-License-Identifier: Apache-2.0
"""The shipped crossings of the MOTKIN bench, from its two encoders: on exact geometry, and off its file."""

from __future__ import annotations

from typing import Any

import pytest

from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_bringup.simulation.case import case_of
from fivebar_bringup.simulation.engine import crossing
from fivebar_bringup.simulation.run_metrics import RunMetrics
from fivebar_control.loop.sampled_plan import sampled
from fivebar_control.safety.stages import NO_FAULT
from fivebar_description.strict_yaml import validate
from inner_loop import ERRORS


def crossed(name: str, plant: dict[str, Any] | None = None) -> RunMetrics:
    """Return the run of a scenario; it has neither a fault nor a change of assembly mode that was not planned."""
    content = load_scenario(name).model_dump()
    content["plant"] |= plant or {}
    scenario = validate(content, Scenario, name)
    assert scenario.estimated
    plan = scenario.plan()
    samples = sampled(scenario.five_bar(), plan, scenario.rate_hz, scenario.lead_samples)
    outcome = crossing(case_of(scenario), samples)
    assert outcome.fault == NO_FAULT
    assert outcome.mode_changes == len(plan.crossings)
    return outcome


@pytest.mark.parametrize(("name", "changes"), [("motkin_middle", 2), ("motkin_multiple", 8), ("motkin_vertical", 2)])
def test_on_exact_geometry_the_bench_stays_within_a_fifth_of_a_millimetre_and_a_tenth_of_a_newton_metre(
    name: str, changes: int
) -> None:
    outcome = crossed(name)
    assert outcome.mode_changes == changes
    assert outcome.error_peak < 2e-4
    assert max(outcome.requested1, outcome.requested2) < 0.1


@pytest.mark.extra
@pytest.mark.parametrize("errors", ERRORS)
def test_with_more_mass_twice_the_friction_and_cogging_it_stays_within_half_a_millimetre(errors: str) -> None:
    assert crossed("motkin_middle", ERRORS[errors]).error_peak < 5e-4
