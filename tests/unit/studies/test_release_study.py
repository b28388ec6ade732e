# SPDX-License-Identifier: Apache-2.0
"""The study of releases from the locus: what it counts, and a rest of each branch."""

from __future__ import annotations

import pytest

from fivebar_control.planning.release_step import RELEASED, STUCK
from release_study import ReleaseRun, drawn_rest, line, released


def test_the_line_counts_damage_wrong_modes_and_refusals() -> None:
    good = ReleaseRun(RELEASED, 1, 1, 0.5, 1.0, 0.1, 0.4, 0.2, False)
    runs = [
        good,
        good._replace(actual=-1),
        good._replace(serial=0.001),
        good._replace(phase=STUCK, assembly=0),
        "in assembly mode + the robot would come to where a limit is: near_type_1",
    ]
    text = line("good", "folded", runs)
    assert text.startswith("good folded: of 5 rests 4 released, 3 of these with the mode found, right 2; damaged 1 (")
    assert "otherwise {'stuck': 1}" in text
    assert "refused {'in assembly mode + the robot would come to where a limit is': 1}" in text


@pytest.mark.extra
def test_a_robot_of_a_rig_is_released_from_either_branch() -> None:
    for number in (0, 1):
        run = next(one for one in map(released, (drawn_rest("good", 5, number + 2 * k) for k in range(20))) if one)
        assert isinstance(run, ReleaseRun)
        assert (run.phase, run.assembly) == (RELEASED, run.actual)
        assert run.kappa > 0.1
        assert run.motor_speed < 2.0
