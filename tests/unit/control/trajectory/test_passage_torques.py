# SPDX-License-Identifier: Apache-2.0
"""The torques along a path that the time law of least torque is found from, against the inverse dynamics of motions."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fivebar_control.model.dynamics import inverse_dynamics_of_platform
from fivebar_control.model.kinematics import state_from_platform
from fivebar_control.trajectory.passage_torques import OFF_LOCUS, torques_along
from fivebar_control.trajectory.path import StraightWay
from fivebar_control.trajectory.rounded import RoundedPolyline
from fivebar_description.robot_file import load_robot

ROUND = RoundedPolyline.through([(-0.02, 0.13), (0.03, 0.12), (0.02, 0.1)], [0.01])
shares = st.floats(0.0, 1.0)


@given(
    robot=st.sampled_from(["dextar", "motkin"]),
    way=st.sampled_from([StraightWay(0.0, 0.13, 0.02, 0.11), ROUND]),
    s=shares,
    speed=st.floats(-2.0, 2.0),
    acceleration=st.floats(-5.0, 5.0),
)
def test_they_add_up_to_the_torque_of_any_passage(
    robot: str, way: StraightWay | RoundedPolyline, s: float, speed: float, acceleration: float
) -> None:
    modelled = load_robot(robot)
    rest, per_acceleration, per_speed = torques_along(modelled, (1, -1), way, np.array([s]))[:, 0]
    x, y, d_x, d_y, b_x, b_y = way.at(s)
    state = state_from_platform(modelled, (1, -1), x, y, speed * d_x, speed * d_y)
    a_x, a_y = acceleration * d_x + speed**2 * b_x, acceleration * d_y + speed**2 * b_y
    wanted = inverse_dynamics_of_platform(modelled, state, a_x, a_y, 0.0, 0.0)
    assert rest + acceleration * per_acceleration + speed**2 * per_speed == pytest.approx(wanted, abs=1e-12, rel=1e-9)


def test_where_there_are_none_those_of_a_point_beside_it_stand_in() -> None:
    """A way that begins a tenth of a nanometre out of reach."""
    robot = load_robot("dextar")
    reach = math.sqrt((robot.leg1.proximal + robot.leg1.distal) ** 2 - robot.leg1.base_x**2)
    way = StraightWay(0.0, reach + 1e-10, 0.0, 0.02)
    begins = state_from_platform(robot, (1, -1), 0.0, way.start_y, 0.0, 0.0)
    assert not math.isfinite(inverse_dynamics_of_platform(robot, begins, 0.0, 1.0, 0.0, 0.0)[0])
    found = torques_along(robot, (1, -1), way, np.array([0.0, 1.0]))
    assert np.all(np.isfinite(found))
    assert np.array_equal(found, torques_along(robot, (1, -1), way, np.array([OFF_LOCUS, 1.0])))
