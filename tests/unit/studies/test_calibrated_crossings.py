# SPDX-License-Identifier: Apache-2.0
"""Robots of the rig `printed` before and after a calibration: they stay the same, only their file changes."""

from __future__ import annotations

from pathlib import Path

import pytest

from calibrated_crossings import (
    calibrated,
    crossed,
    left_error,
    rigs_of,
    robot_of_rig,
)
from fivebar_bringup.odds.robot_errors import drawn_gyro_bias
from fivebar_description.robot_file import read_robot
from fivebar_description.strict_yaml import InputError
from fivebar_studies.rigs.named import find_rig
from fivebar_studies.sweep.drawing import draw, plan_of
from fivebar_studies.sweep.rows import FEASIBLE

SEED, PRINTED = 71, find_rig("printed")


def test_a_robot_is_one_of_the_rig_without_what_happens_to_it_on_a_crossing() -> None:
    """Equal random numbers make the same robot as in the sweep."""
    number = next(number for number in range(100) if _planned(number))
    swept = draw(SEED, number, "printed").scenario("unified").plant
    robot = robot_of_rig(PRINTED, SEED, number)
    assert robot["mass_scale"] == swept.mass_scale != 1.0
    assert robot["links"] == {name: getattr(swept.links, name) for name in robot["links"]}
    assert robot["encoders"]["zero_1"] == swept.encoders.zero_1 != 0.0
    assert robot["transmission"]["frequency"] == swept.transmission.frequency == 150.0
    assert swept.push.force > 0.0
    assert not {"push", "bus"} & set(robot)
    assert robot == robot_of_rig(PRINTED, SEED, number)
    assert robot != robot_of_rig(PRINTED, SEED, number + 1)


def _planned(number: int) -> bool:
    try:
        return bool(plan_of(draw(SEED, number, "printed")).crossings)
    except InputError:
        return False


@pytest.mark.extra
def test_a_calibration_by_hand_leaves_less_than_the_rig_of_calibrated_robots_has(tmp_path: Path) -> None:
    plant = robot_of_rig(PRINTED, SEED, 0)
    result = calibrated(PRINTED, plant, drawn_gyro_bias(PRINTED.errors, SEED, 0))
    left = left_error(result)
    assert left.gap_before > 2e-4
    assert left.gap < left.claimed < 6e-5
    assert left.tolerance_length <= find_rig("printed_calibrated").errors.length
    assert left.tolerance_zero <= find_rig("printed_calibrated").errors.zero
    # what changes is the file, not the robot
    before, after = (find_rig(str(path)) for path in rigs_of(PRINTED, plant, result, tmp_path))
    file, drawn = read_robot(str(tmp_path / "calibrated.yaml")), read_robot("motkin")
    actual = [
        robot.five_bar().leg1.distal + links
        for robot, links in ((drawn, before.plant["links"]["l_12"]), (file, after.plant["links"]["l_12"]))
    ]
    assert actual[0] == pytest.approx(actual[1], abs=1e-8)
    assert file.tolerances.length == left.tolerance_length
    # the gyroscope's low-pass lags behind by 2 ms, which is declared and not the clock's
    assert abs(file.sensors.imu_clock) < 2e-4
    assert "tolerances" not in after.scenario
    # the odds are those of robots that are as well known as this one
    assert (after.errors.length, after.errors.base, after.errors.zero) == file.tolerances[:3]
    assert before.errors == PRINTED.errors
    assert {**before.plant, **{name: after.plant[name] for name in ("links", "encoders")}} == after.plant
    # the first is out of reach
    (crossing,) = crossed(PRINTED, SEED, (1000, 1131), plant, result)
    assert crossing.after.status == FEASIBLE
    assert crossing.after.within(2e-3)
