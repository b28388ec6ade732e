"""The unified law: its input map, its box-constrained least squares, and what it does on the locus."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import lsq_linear

from fivebar_control.controllers.reference import reference_from_platform
from fivebar_control.controllers.unified import Box, box_least_squares, input_map, unified_torque
from fivebar_control.model.dynamics import direct_dynamics
from fivebar_control.model.kinematics import state_from_joints, state_from_platform
from fivebar_control.model.state import Platform
from fivebar_description.closed_loop import ClosedLoop
from fivebar_description.parameters import load_robot

LOCUS_Y = math.sqrt(0.0081 - 0.000961)
figures = st.floats(-20.0, 20.0)


@given(
    a=st.tuples(figures, figures, figures, figures),
    b=st.tuples(figures, figures),
    weight=st.floats(0.1, 10.0),
    middle=st.tuples(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0)),
    half=st.floats(0.1, 3.0),
)
def test_box_least_squares_equals_a_reference_solver(
    a: tuple[float, ...],
    b: tuple[float, ...],
    weight: float,
    middle: tuple[float, float],
    half: float,
) -> None:
    matrix = np.array(a).reshape(2, 2)
    stacked = np.vstack([matrix, math.sqrt(weight) * np.eye(2)])
    target = np.array([*b, 0.0, 0.0])
    low, high = np.array(middle) - half, np.array(middle) + half
    expected = lsq_linear(stacked, target, bounds=(low, high), method="bvls", tol=1e-14)
    h = matrix.T @ matrix + weight * np.eye(2)
    r = matrix.T @ np.array(b)
    found = box_least_squares(h[0, 0], h[0, 1], h[1, 1], r[0], r[1], Box(low[0], high[0], low[1], high[1]))

    def cost(u: np.ndarray) -> float:
        return float(np.sum((stacked @ u - target) ** 2))

    assert np.all(np.array(found) >= low - 1e-12)
    assert np.all(np.array(found) <= high + 1e-12)
    assert cost(np.array(found)) <= cost(expected.x) * (1.0 + 1e-9) + 1e-9


@pytest.mark.parametrize("y", [0.12, LOCUS_Y, 0.05])
def test_the_input_map_is_the_robots_response(y: float) -> None:
    """Away from the locus and on it: xddot = G u + a_0 against Pinocchio's closed loop."""
    robot = load_robot("dextar")
    state = state_from_platform(robot, 1, -1, 0.01 if y != LOCUS_Y else 0.0, y, 0.3, -0.4)
    loop = ClosedLoop(robot)
    q = np.array([state.leg1.q1, state.leg1.q2, state.leg2.q1, state.leg2.q2])
    v = np.array(
        [state.leg1.dq1, state.leg1.dtheta - state.leg1.dq1, state.leg2.dq1, state.leg2.dtheta - state.leg2.dq1]
    )
    mapped = input_map(robot, state)
    assert mapped is not None
    for u in ((0.0, 0.0), (0.7, -0.3), (-1.1, 0.4)):
        acceleration = loop.acceleration(q, v, np.array([u[0], 0.0, u[1], 0.0]))
        expected = loop.platform(q, v, acceleration)[2]
        found = (
            mapped.g_x1 * u[0] + mapped.g_x2 * u[1] + mapped.a0_x,
            mapped.g_y1 * u[0] + mapped.g_y2 * u[1] + mapped.a0_y,
        )
        assert found == pytest.approx(expected, abs=1e-9)


def test_the_input_map_is_regular_where_one_leg_is_stretched() -> None:
    """At Type 1 the acceleration still follows the constraint form; the stretched leg's motor moves nothing."""
    robot = load_robot("dextar")
    state = state_from_joints(robot, 1.2, 0.0, 1.0, 1.1, 0.2, -0.1, 0.1, 0.3)
    mapped = input_map(robot, state)
    assert mapped is not None
    motion = direct_dynamics(robot, state, 0.5, -0.2, 0.0, 0.0)
    assert mapped.g_x1 * 0.5 + mapped.g_x2 * -0.2 + mapped.a0_x == pytest.approx(motion.ax, abs=1e-10)
    assert mapped.g_y1 * 0.5 + mapped.g_y2 * -0.2 + mapped.a0_y == pytest.approx(motion.ay, abs=1e-10)
    assert (mapped.g_x1, mapped.g_y1) == (0.0, 0.0)


def test_on_the_locus_torque_stays_small_and_acts_across_the_path_only() -> None:
    robot = load_robot("dextar")
    state = state_from_platform(robot, 1, -1, 0.0, LOCUS_Y, 0.0, -0.2)
    # asks for 1 m/s^2 in the uncontrollable direction y, and for 0.5 in x
    reference = reference_from_platform(robot, 1, -1, Platform(0.0, LOCUS_Y, 0.0, -0.2, 0.5, 1.0))
    torque = unified_torque(robot, state, reference, 6400.0, 160.0, 3.0, 10.0)
    motion = direct_dynamics(robot, state, *torque, reference.f1, reference.f2)
    assert abs(motion.ay) < 1e-9
    assert 0.3 < motion.ax < 0.5
    assert max(abs(torque.tau1), abs(torque.tau2)) < 2.0


def test_the_torque_limit_is_kept() -> None:
    robot = load_robot("dextar")
    state = state_from_platform(robot, 1, -1, 0.0, 0.14, 0.0, 0.0)
    reference = reference_from_platform(robot, 1, -1, Platform(0.02, 0.12, 0.5, 0.5, 50.0, -80.0))
    torque = unified_torque(robot, state, reference, 6400.0, 160.0, 3.0, 0.6)
    assert max(abs(torque.tau1), abs(torque.tau2)) == pytest.approx(0.6, abs=1e-12)
