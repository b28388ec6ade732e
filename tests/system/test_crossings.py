"""Both blended controllers, both motions, every speed, with the default zones and resolution: what they must keep."""

from __future__ import annotations

import pytest

from fivebar_bringup.studies.reproduce.cases import FULL, JOINT, ReproductionCase
from fivebar_bringup.studies.reproduce.runner import run_case

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
    result = run_case(case)
    assert result.completed, result.why_not
    assert result.summary is not None
    assert result.summary.assembly_mode_changes == MODE_CHANGES[case.motion]
    assert result.summary.faults == []
    assert result.saturated == 0
    assert result.constraint_error is not None
    assert result.constraint_error <= CONSTRAINT_ERROR_M[case.motion]
    assert result.tracking_error is not None
    assert result.tracking_error <= TRACKING_ERROR_M
    assert result.requested is not None
    assert result.requested <= TORQUE_NM
