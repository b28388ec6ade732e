# SPDX-License-Identifier: Apache-2.0
"""The package by itself: the shipped robot is read, and Pinocchio closes its loop."""

import math

import numpy as np
import pytest

from fivebar_description.closed_loop import ClosedLoop
from fivebar_description.robot_file import load_robot


def test_the_shipped_robot_is_a_closed_loop() -> None:
    loop = ClosedLoop(load_robot("dextar"))
    joints, still = np.array([2.0, -1.2, math.pi - 2.0, 1.1]), np.zeros(4)
    assert np.hypot(*loop.tip_gap(joints).gap) > 1e-3
    for _ in range(6):
        joints, still, gap = loop.close(joints, still)
    assert gap < 1e-12
    # at rest and free of gravity it stays
    assert loop.acceleration(joints, still, np.zeros(4)) == pytest.approx(np.zeros(4), abs=1e-9)
