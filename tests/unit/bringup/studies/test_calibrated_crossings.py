"""Robots of the rig `printed` before and after a calibration: they stay the same, only their file changes."""

from __future__ import annotations

import pytest

from fivebar_bringup.studies.calibrated_crossings import AFTER, BEFORE, MOTIONS, crossed, printed_robot, within
from fivebar_bringup.studies.sweep.drawing import draw, plan_of
from fivebar_bringup.studies.sweep.rigs import PRINTED, RIGS
from fivebar_bringup.studies.sweep.rows import FEASIBLE
from fivebar_description.strict_yaml import InputError

SEED = 71


def test_a_robot_is_one_of_the_rig_without_what_happens_to_it_on_a_crossing() -> None:
    """Equal random numbers make the same robot as in the sweep."""
    number = next(number for number in range(100) if _planned(number))
    swept = draw(SEED, number, "printed").scenario("unified").plant
    robot = printed_robot(SEED, number)
    assert robot["mass_scale"] == swept.mass_scale != 1.0
    assert robot["links"] == {name: getattr(swept.links, name) for name in robot["links"]}
    assert robot["encoders"]["zero_1"] == swept.encoders.zero_1 != 0.0
    assert robot["transmission"]["frequency"] == PRINTED.frequency
    assert swept.push.force > 0.0
    assert not {"push", "bus"} & set(robot)
    assert robot == printed_robot(SEED, number)
    assert robot != printed_robot(SEED, number + 1)


def _planned(number: int) -> bool:
    try:
        return bool(plan_of(draw(SEED, number, "printed")).crossings)
    except InputError:
        return False


@pytest.mark.extra
def test_a_calibration_by_hand_leaves_less_than_the_rig_of_calibrated_robots_has() -> None:
    left, crossings = crossed(SEED, 0, 3)
    assert left.gap_before > 2e-4
    assert left.gap < 5e-5
    assert left.gap < left.claimed < 6e-5
    assert left.tolerance_length <= RIGS["printed_calibrated"].spread.length
    assert left.tolerance_zero <= RIGS["printed_calibrated"].spread.zero
    assert [one.after.status for one in crossings] == [FEASIBLE] * 3
    assert sum(within(one.after) for one in crossings) >= 2
    assert len(MOTIONS) == 2
    # what changes is the file, not the robot
    before, after = (RIGS[name] for name in (BEFORE, AFTER))
    assert after.robot.endswith("calibrated.yaml")
    assert "tolerances" not in after.sections
    assert abs(after.plant["encoders"].zero_1) < 0.3 * abs(before.plant["encoders"]["zero_1"])
    assert {**before.plant, **{name: after.plant[name] for name in ("links", "encoders")}} == after.plant
