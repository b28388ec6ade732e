# SPDX-License-Identifier: Apache-2.0
"""Vertical robots beside level ones: their files, the torque of their references, and the table."""

from __future__ import annotations

import math
from itertools import islice
from pathlib import Path

import pytest

from fivebar_description.parameters import without_external_force
from fivebar_description.robot_file import load_robot
from forces_study import (
    DIRECTIONS,
    ForcedRun,
    crossings,
    forced_run,
    table,
    vertical_file,
)


def test_a_vertical_robot_is_the_level_one_under_gravity_in_a_direction(tmp_path: Path) -> None:
    robot = load_robot(vertical_file("dextar", 0.3, tmp_path))
    assert (robot.gravity_x, robot.gravity_y) == pytest.approx((9.80665 * math.cos(0.3), 9.80665 * math.sin(0.3)))
    assert robot.leg1.moment == robot.leg2.moment == 0.02
    legs = (leg._replace(moment=0.0) for leg in robot[:2])
    assert without_external_force(robot)._replace(leg1=next(legs), leg2=next(legs)) == load_robot("dextar")


def test_the_table_counts_what_the_torque_is_enough_for_and_compares_the_errors_of_that() -> None:
    runs = [
        ForcedRun("good", "up", 2.0, True, 3e-4, 2e-4),
        ForcedRun("good", "up", 3.0, False, 5e-3, 2e-4),
        ForcedRun("good", "up", math.inf, False, math.inf, 2e-4),
        ForcedRun("good", "down", 1.0, True, 1e-4, 2e-4),
        ForcedRun("good", "sideways", 9.0, False, math.inf, 2e-4),
    ]
    text = table(runs, 4.0)
    assert "| `good` | up | 3.00 Nm | 2 of 3 | 1 of 2 (1 to 99 %) | 0.200 mm | 0.300 mm | 1.50 |" in text
    assert "| `good` | down | 1.00 Nm | 1 of 1 |" in text
    assert "| `good` | sideways | 9.00 Nm | 0 of 1 |" in text


@pytest.mark.extra
def test_a_vertical_robot_is_as_near_to_its_reference_as_the_level_one(tmp_path: Path) -> None:
    """On the rig `good`, from encoders and gyroscope; the whole study has ratios of 0.7 to 1.0."""
    runs = [
        forced_run(case, level, error, direction, 4.0, tmp_path)
        for case, level, error in islice(crossings(90210, "good", 4.0), 12)
        for direction in DIRECTIONS
    ]
    made = [run for run in runs if run.torque <= 4.0]
    assert len(made) >= 10
    assert all(run.success for run in made)
    ratios = sorted(run.error / run.level for run in made)
    assert ratios[len(ratios) // 2] < 1.5
