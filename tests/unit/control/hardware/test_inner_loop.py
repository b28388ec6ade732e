# SPDX-License-Identifier: Apache-2.0
"""The inner loop of a motor board: where it fades, and that all currents together keep the limit."""

from __future__ import annotations

import math
from typing import Any

import pytest

from fivebar_control.hardware.drive_interface import JointTarget
from fivebar_control.hardware.inner_loop import OPEN, LoopTargets, away_from_jump, set_point
from fivebar_control.laws.blend import blending_weight
from fivebar_control.model.kinematics import joints_of, state_from_platform
from fivebar_control.model.singularity import inverse_condition
from fivebar_control.model.state import WorkingMode
from fivebar_description.robot_file import load_robot
from fivebar_motkin.board_file import BoardDrive, BoardFile
from fivebar_motkin.board_units import current_limit

ROBOT = load_robot("motkin")
STILL = (0.0,) * 4
LOCUS = 0.033166
"""Where the locus is met on x = 0 (m)."""


def board(**inner_loop: Any) -> BoardFile:
    motor = {"torque_limit_nm": 0.124}
    content = {"name": "bench", "port": "none", "motors": {"q11": motor, "q21": motor}, "inner_loop": inner_loop}
    return BoardFile.model_validate(content)


def target(y: float, state_y: float | None = None, mode: WorkingMode = (1, -1)) -> JointTarget | None:
    loop = LoopTargets(board(stiffness=1.0, epsilon=0.05).inner_loop, 2000)
    position = tuple(joints_of(state_from_platform(ROBOT, mode, 0.0, y if state_y is None else state_y, 0.0, 0.0)))[:4]
    return loop.target((0.0, y, 0.0, -0.1), position, STILL)


def test_it_is_off_by_default() -> None:
    assert not board().inner_loop.on
    assert board(damping=0.01).inner_loop.on


@pytest.mark.parametrize("mode", [(1, -1), (-1, 1)])
def test_the_target_is_the_reference_in_the_working_mode_of_the_robot(mode: WorkingMode) -> None:
    found = target(0.12, mode=mode)
    assert found is not None
    desired = state_from_platform(ROBOT, mode, 0.0, 0.12, 0.0, -0.1)
    for angle, speed, leg in zip(found.positions, found.velocities, (desired.leg1, desired.leg2), strict=True):
        # the middle of the period of 2 ms for which it is held
        assert (angle, speed) == pytest.approx((leg.q1 + 1e-3 * leg.dq1, leg.dq1), abs=1e-12)


def test_it_fades_with_the_zone_of_the_supervisor_and_is_zero_on_the_locus() -> None:
    weights = []
    for step in range(200):
        y = LOCUS + 1e-4 * step
        found = target(y)
        kappa = inverse_condition(state_from_platform(ROBOT, (1, -1), 0.0, y, 0.0, 0.0))
        weights.append(0.0 if found is None else found.weight)
        assert weights[-1] == pytest.approx(1.0 - blending_weight(kappa, 0.05), abs=1e-9)
    assert weights[0] == 0.0 and weights[-1] == 1.0
    assert sum(0.0 < weight < 1.0 for weight in weights) > 5
    # whichever is nearer to the locus counts, and beyond it is another assembly mode
    assert target(0.12, LOCUS + 1e-4) is None
    assert target(LOCUS + 1e-4, 0.12) is None
    assert target(0.12, 0.0) is None
    # out of reach
    assert target(0.5, 0.12) is None


@pytest.mark.parametrize("turns", [(0, 0), (1, 0), (-1, 2)])
def test_the_target_is_on_the_turn_on_which_the_motor_is(turns: tuple[int, int]) -> None:
    # the left crank points to the left here, where its angle in the reference jumps from -pi to pi
    angles = []
    for x in (-0.047, -0.049, -0.051, -0.053):
        state = state_from_platform(ROBOT, (1, -1), x, 0.08, 0.0, 0.0)
        angles.append(state.leg1.q1)
        position = list(joints_of(state))[:4]
        for number, turn in enumerate(turns):
            position[2 * number] += 0.01 + turn * math.tau
        found = LoopTargets(board(stiffness=1.0).inner_loop, 2000).target((x, 0.08, 0.0, 0.0), position, STILL)
        assert found is not None
        assert found.positions == pytest.approx([motor - 0.01 for motor in position[::2]])
    assert max(angles) - min(angles) > 6.0


@pytest.mark.parametrize("current", [0.0, 1.5, -1.9])
@pytest.mark.parametrize("error", [1e-3, -3e-2, 0.8, -2.0])
def test_the_sum_of_all_currents_keeps_the_limit_and_the_loop_its_share(current: float, error: float) -> None:
    # 0.124 Nm are 2 A
    file = board(stiffness=5.0, damping=0.1, share=0.25)
    drive: BoardDrive = file.motors.q11
    for angle, speed in ((0.3, 20.0), (-0.3, -0.5)):
        point = set_point(
            file.inner_loop, current_limit(drive), current, 0.5, (angle, angle + error), (speed, speed + 40.0 * error)
        )
        assert (point.kp, point.kd) == (2.5, 0.05)
        by_angle, by_speed = point.kp * (point.angle - angle), point.kd * (point.speed - speed)
        assert max(abs(by_angle), abs(by_speed)) <= 0.5 * 0.25 * 2.0 + 1e-12
        assert abs(current + by_angle + by_speed) <= 2.0 + 1e-12
        if abs(error) <= 1e-3:
            # a small error is met in full
            assert (point.angle, point.speed) == pytest.approx((angle + error, speed + 40.0 * error))


def test_where_the_reading_jumps_there_is_no_inner_loop() -> None:
    shares = [away_from_jump(reading) for reading in (0.0, math.pi - 1.01, -math.pi + 0.75, math.pi - 0.4)]
    assert shares == pytest.approx([1.0, 1.0, 0.5, 0.0])
    file = board(stiffness=5.0)
    limit, targets = current_limit(file.motors.q11), ((3.1, 3.2), (0.0, 0.0))
    assert set_point(file.inner_loop, limit, 0.0, away_from_jump(3.1), *targets) == OPEN


def test_where_the_law_takes_all_the_current_there_is_no_inner_loop() -> None:
    file = board(stiffness=5.0)
    assert set_point(file.inner_loop, current_limit(file.motors.q11), -2.0, 1.0, (0.3, 0.4), (0.0, 0.0)) == OPEN
