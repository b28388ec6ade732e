# SPDX-License-Identifier: Apache-2.0
"""What nodes of one process share: the same objects give the same result once, equal ones their own."""

from __future__ import annotations

import math

from fivebar_control.loop.shared_results import SharedResult, one_robot, shared_state
from fivebar_control.model.kinematics import state_from_joints
from fivebar_description.robot_file import load_robot

POSITION, VELOCITY = (2.0, -1.5, 1.0, 1.5), (0.1, 0.2, 0.3, 0.4)


def test_the_same_objects_are_worked_out_once() -> None:
    calls: list[float] = []

    def work(sample: float, values: tuple[float, ...]) -> float:
        calls.append(sample)
        return sample + values[0]

    shared, values = SharedResult(work), (0.5,)
    assert [shared(1, values), shared(1, values)] == [1.5, 1.5]
    assert calls == [1]
    assert shared(2, values) == 2.5
    assert calls == [1, 2]


def test_equal_objects_are_not_the_same() -> None:
    shared = SharedResult(lambda sample, values: math.copysign(1.0, values[0]))
    assert [shared(0, (0.0,)), shared(0, (-0.0,))] == [1.0, -1.0]


def test_a_state_is_that_of_the_joints_for_each_robot() -> None:
    for robot in (load_robot(), load_robot("unequal"), load_robot()):
        expected = state_from_joints(robot, *POSITION, *VELOCITY)
        assert shared_state(3, robot, POSITION, VELOCITY) == expected
        assert shared_state(3, robot, POSITION, VELOCITY) == expected


def test_nodes_of_a_process_have_one_robot() -> None:
    assert one_robot(load_robot()) is one_robot(load_robot())
    assert one_robot(load_robot("unequal")) != one_robot(load_robot())
