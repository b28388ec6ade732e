# SPDX-License-Identifier: Apache-2.0
"""Frames of a robot that do not move, from its URDF: against the frames that Pinocchio makes of the same file."""

from __future__ import annotations

import numpy as np
import pinocchio
import pytest

from fivebar_description.imu import ImuSettings
from fivebar_description.robot_description import robot_description
from fivebar_description.robot_file import read_robot
from fivebar_description.static_frames import static_frames

FIXED = {"base_link", "left_motor", "right_motor", "camera", "camera_optical"}


@pytest.mark.parametrize("robot", ["dextar", "unequal"])
def test_frames_are_where_others_find_them(robot: str) -> None:
    file = read_robot(robot)
    urdf = robot_description(file.five_bar(), file.name, ImuSettings(), file.weighed())
    frames = static_frames(urdf)
    assert set(frames) == FIXED
    model = pinocchio.buildModelFromXML(urdf)
    data = model.createData()
    pinocchio.framesForwardKinematics(model, data, pinocchio.neutral(model))
    point = (0.1, -0.2, 0.3)
    for name, placed in frames.items():
        there = data.oMf[model.getFrameId(name)]
        assert placed.to_base(point) == pytest.approx(there.act(np.array(point)), abs=1e-12)
