# SPDX-License-Identifier: Apache-2.0
"""The package by itself: the plant is driven out of rest, and its loop stays closed."""

import math

import numpy as np

from fivebar_description.closed_loop import ClosedLoop
from fivebar_description.robot_file import load_robot
from fivebar_sim.plant import Plant


def test_a_torque_moves_the_plant() -> None:
    robot = load_robot("dextar")
    joints, still = np.array([2.0, -1.2, math.pi - 2.0, 1.1]), np.zeros(4)
    for _ in range(6):
        joints, still, _ = ClosedLoop(robot).close(joints, still)
    plant = Plant(robot, joints.tolist(), 500)
    for _ in range(50):
        plant.advance((0.5, 0.0))
    assert plant.measure().position[0] > joints[0] + 0.01
    assert plant.measure().effort[0] == 0.5
    assert plant.closure_error < 1e-6
