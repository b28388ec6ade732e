# SPDX-License-Identifier: Apache-2.0
"""The study of the motor board's inner loop."""

from __future__ import annotations

import pytest

from inner_loop import ERRORS, GAINS, crossed


@pytest.mark.extra
def test_a_robot_with_cogging_crosses_with_the_stiffest_inner_loop_too() -> None:
    run = crossed(ERRORS["cogging 2 mNm"], GAINS[-1], seed=0)
    assert run.completed
    assert run.rms < run.error < 1e-3
    # what the motors did is what law and inner loop asked for, within the drives' limit
    assert 0.0 < run.motor < 0.186
