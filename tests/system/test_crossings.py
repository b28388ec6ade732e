# SPDX-License-Identifier: Apache-2.0
"""Both blended controllers, both motions, every speed, with the default zones and resolution: what they must keep.

All of them compiled, and one of each controller by what `fivebar reproduce` makes of its run.
"""

from __future__ import annotations

import pytest
from engine_agreement import expect_completed, outcome_of

from fivebar_studies.reproduce.cases import FULL, JOINT, ReproductionCase
from fivebar_studies.reproduce.runner import run_case

pytestmark = pytest.mark.extra

CASES = [case for controller in (JOINT, "multi_cartesian") for case in FULL.grid(controller)]
MODE_CHANGES = {"middle": 2, "multiple": 8}
CONSTRAINT_ERROR_M = {"middle": 2e-5, "multiple": 1e-4}
TRACKING_ERROR_M = 2.5e-3
TORQUE_NM = 1.2


def test_there_are_sixteen() -> None:
    assert len(CASES) == 16
    assert {case.duration for case in CASES} == {0.5, 1.0, 2.0, 3.0}


@pytest.mark.parametrize("case", CASES, ids=[case.label for case in CASES])
def test_the_crossing_keeps_its_bounds(case: ReproductionCase) -> None:
    scenario = case.scenario()
    outcome = outcome_of(scenario)
    expect_completed(outcome, scenario, MODE_CHANGES[case.motion])
    assert outcome.saturated == 0
    assert 0.0 < outcome.constraint_error <= CONSTRAINT_ERROR_M[case.motion]
    assert 0.0 < outcome.error_peak <= TRACKING_ERROR_M
    assert 0.0 < max(outcome.requested1, outcome.requested2) <= TORQUE_NM


@pytest.mark.parametrize("controller", [JOINT, "multi_cartesian"])
def test_the_reproduction_finds_the_same(controller: str) -> None:
    case = ReproductionCase(controller, "middle", 0.5)
    result, outcome = run_case(case), outcome_of(case.scenario())
    assert result.completed, result.why_not
    assert result.summary is not None
    assert result.summary.assembly_mode_changes == outcome.mode_changes
    assert result.summary.faults == []
    assert result.saturated == 0
    assert result.constraint_error == pytest.approx(outcome.constraint_error, rel=1e-3)
    assert result.tracking_error == pytest.approx(outcome.error_peak, rel=1e-3)
    assert result.requested == pytest.approx(max(outcome.requested1, outcome.requested2), rel=1e-3)
