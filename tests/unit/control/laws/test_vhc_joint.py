"""The virtual holonomic constraint in joint coordinates, u2, and its constraints."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from fivebar_control.laws.reference import Reference, reference_from_platform
from fivebar_control.laws.resolution import RESOLUTIONS
from fivebar_control.laws.vhc_joint import path_constraints, vhc_joint_torque
from fivebar_control.model.dynamics import direct_dynamics
from fivebar_control.model.geometry import inverse_geometry, wrap
from fivebar_control.model.kinematics import joint_acceleration, state_from_joints, state_from_platform
from fivebar_control.model.line import Line
from fivebar_control.model.singularity import parallel_svd
from fivebar_control.model.state import Platform, State
from fivebar_description.closed_loop import ClosedLoop
from fivebar_description.parameters import FiveBar

Vector = NDArray[np.float64]
States = Callable[[int, int], list[State]]
Vectors = Callable[[State], tuple[Vector, Vector]]

KP, KD = 2500.0, 100.0
EVERY_RESOLUTION = pytest.mark.parametrize("name", sorted(RESOLUTIONS))


def modes(state: State) -> tuple[int, int]:
    return (-1 if state.leg1.sin_q2 > 0.0 else 1), (-1 if state.leg2.sin_q2 > 0.0 else 1)


def reference_near(robot: FiveBar, state: State) -> Reference:
    return reference_from_platform(robot, *modes(state), Platform(state.x, state.y, state.vx, state.vy, 0.0, 0.0))


def line_through(state: State, angle: float, aside: float = 0.0) -> Line:
    """A line in a direction, past the platform at a signed distance, beginning 10 mm before it."""
    c, s = math.cos(angle), math.sin(angle)
    return Line(state.x - 0.01 * c - aside * s, state.y - 0.01 * s + aside * c, c, s)


def test_constraints_are_the_motors_distance_from_the_path_point(robot: FiveBar, regular_states: States) -> None:
    """h_i = q_i1 - phi_i(s), its rate, and phi'' sdot^2, with phi differenced along the line."""
    step = 1e-4
    for number, state in enumerate(regular_states(60, 80)):
        line = line_through(state, 0.1 * number, aside=5e-4)
        along = line.direction_x * (state.x - line.x) + line.direction_y * (state.y - line.y)
        speed = line.direction_x * state.vx + line.direction_y * state.vy
        phi = np.array(
            [
                inverse_geometry(robot, *modes(state), line.x + s * line.direction_x, line.y + s * line.direction_y)
                for s in (along - step, along, along + step)
            ]
        )
        phi = np.unwrap(phi, axis=0)[:, [0, 2]]
        slope, bend = (phi[2] - phi[0]) / (2.0 * step), (phi[2] - 2.0 * phi[1] + phi[0]) / step**2
        constraints = path_constraints(robot, *modes(state), state, line)
        for found, leg, angle, rate, curve in zip(
            constraints, (state.leg1, state.leg2), phi[1], slope, bend, strict=True
        ):
            assert found.h == pytest.approx(wrap(leg.q1 - angle), abs=1e-13)
            assert found.dh == pytest.approx(leg.dq1 - rate * speed, abs=1e-3 * (1.0 + abs(rate)))
            assert found.slope == pytest.approx(rate, abs=1e-3 * (1.0 + abs(rate)))
            assert found.bend == pytest.approx(curve * speed**2, abs=1e-3 * (1.0 + abs(curve) * speed**2))


@EVERY_RESOLUTION
def test_on_the_locus_and_on_the_path_both_constraints_are_kept(
    name: str, robot: FiveBar, loop: ClosedLoop, locus_states: States, joint_vectors: Vectors
) -> None:
    """With h = hdot = 0 the motors get phi'' sdot^2, so the platform moves straight on: n . xddot = 0."""
    for number, moving in enumerate(locus_states(60, 81)):
        angle = 0.3 * number
        svd = parallel_svd(moving)
        if abs(math.sin(angle) * svd.v_x - math.cos(angle) * svd.v_y) < 0.3:
            continue
        c, s = math.cos(angle), math.sin(angle)
        state = state_from_platform(robot, *modes(moving), moving.x, moving.y, 0.3 * c, 0.3 * s)
        line, reference = line_through(state, angle), reference_near(robot, state)
        torque = vhc_joint_torque(robot, *modes(state), state, reference, line, KP, KD, RESOLUTIONS[name])
        net = np.array([torque.tau1 - reference.f1, 0.0, torque.tau2 - reference.f2, 0.0])
        q, v = joint_vectors(state)
        a = loop.acceleration(q, v, net)
        scale = 1.0 + float(np.abs(a).max())
        true = loop.platform(q, v, a)[2]
        assert abs(s * true[0] - c * true[1]) < 1e-9 * scale
        wanted = [joint_acceleration(leg, 0.0, 0.0) for leg in (state.leg1, state.leg2)]
        np.testing.assert_allclose(a[[0, 2]], wanted, rtol=0.0, atol=1e-9 * scale)


def test_beside_the_path_alpha_is_the_least_squares_compromise(robot: FiveBar, locus_states: States) -> None:
    """full_inverse shows what is asked for: tau = ZZ qddot + f + B U_1 m alpha / s1, alpha by numpy's lstsq."""
    zz = np.array([robot.leg1.inertia, robot.leg2.inertia])
    for number, state in enumerate(locus_states(40, 82)):
        line, reference = line_through(state, 0.3 * number, aside=1e-3), reference_near(robot, state)
        constraints = path_constraints(robot, *modes(state), state, line)
        v = np.array([one.bend - KP * one.h - KD * one.dh for one in constraints])
        svd = parallel_svd(state)
        b = np.array([state.leg1.b, state.leg2.b])
        a = np.array([[state.leg1.u_x, state.leg1.u_y], [state.leg2.u_x, state.leg2.u_y]])
        column = (a @ (svd.v_x, svd.v_y)) / b
        drift = np.array([state.leg1.c, state.leg2.c]) / b
        along = line.direction_x * svd.v_x + line.direction_y * svd.v_y
        asked = column - np.array([one.slope for one in constraints]) * along
        (alpha,) = np.linalg.lstsq(asked[:, None], v - drift, rcond=None)[0]
        u1 = np.array([1.0, svd.fold]) / math.sqrt(2.0)
        wanted = zz * (column * alpha + drift) + (reference.f1, reference.f2) + b * u1 * robot.mass * alpha / svd.s1
        found = vhc_joint_torque(robot, *modes(state), state, reference, line, KP, KD, RESOLUTIONS["full_inverse"])
        np.testing.assert_allclose(found, wanted, rtol=1e-9, atol=1e-9)


@EVERY_RESOLUTION
@pytest.mark.parametrize("authority", [1.0, 0.9, 0.6, 0.35])
def test_an_oblique_path_is_held_with_the_full_gain(name: str, authority: float, dextar: FiveBar) -> None:
    """At rest 10 um beside a path that meets the locus at an angle: the pull across it is Kp times the distance."""
    y = math.sqrt(0.0081 - 0.000961)
    state = state_from_platform(dextar, 1, -1, 0.0, y, 0.0, 0.0)
    svd = parallel_svd(state)
    # the normal n with n . v1 = authority, and the direction that it belongs to
    across = math.sqrt(1.0 - authority * authority)
    n_x, n_y = authority * svd.v_x + across * svd.t_x, authority * svd.v_y + across * svd.t_y
    distance = 1e-5
    line = Line(-distance * n_x, y - distance * n_y, -n_y, n_x)
    reference = reference_near(dextar, state)
    torque = vhc_joint_torque(dextar, 1, -1, state, reference, line, KP, KD, RESOLUTIONS[name])
    motion = direct_dynamics(dextar, state, *torque, reference.f1, reference.f2)
    assert n_x * motion.ax + n_y * motion.ay == pytest.approx(-KP * distance, rel=2e-3)


@EVERY_RESOLUTION
def test_an_error_across_the_path_is_pulled_back_on_the_locus(name: str, dextar: FiveBar) -> None:
    """1 mm to the side of x = 0 at the thesis' crossing: the platform is accelerated towards the path.

    Either motor's h is dq/dx times x. That slope changes along the path, so h has a rate although x has none, and its
    damping adds a twentieth to the pull.
    """
    y, step = math.sqrt(0.0081 - 0.000961), 1e-5

    def slope(y: float) -> float:
        ahead, behind = (inverse_geometry(dextar, 1, -1, x, y).q11 for x in (step, -step))
        return (ahead - behind) / (2.0 * step)

    growth = -0.3 * (slope(y + step) - slope(y - step)) / (2.0 * step) / slope(y)
    assert KD * growth == pytest.approx(0.049 * KP, rel=0.01)
    for x in (1e-3, -1e-3):
        state = state_from_platform(dextar, 1, -1, x, y, 0.0, -0.3)
        reference = reference_near(dextar, state)
        line = Line(0.0, 0.15, 0.0, -1.0)
        torque = vhc_joint_torque(dextar, 1, -1, state, reference, line, KP, KD, RESOLUTIONS[name])
        motion = direct_dynamics(dextar, state, *torque, reference.f1, reference.f2)
        assert motion.ax == pytest.approx(-(KP + KD * growth) * x, rel=2e-4)


def test_it_is_undefined_at_type_1_and_where_the_path_point_is_out_of_reach(dextar: FiveBar) -> None:
    inside = state_from_platform(dextar, 1, -1, 0.0, 0.12, 0.0, 0.0)
    reference = reference_near(dextar, inside)
    far = Line(0.3, 0.15, 0.0, -1.0)
    resolve = RESOLUTIONS["full_friction"]
    torque = vhc_joint_torque(dextar, 1, -1, inside, reference, far, KP, KD, resolve)
    assert all(math.isnan(value) for value in torque)
    stretched = state_from_joints(dextar, 1.0, 0.0, 2.0, -1.2, 0.1, 0.2, 0.3, 0.1)
    near = Line(0.0, 0.15, 0.0, -1.0)
    torque = vhc_joint_torque(dextar, 1, -1, stretched, reference, near, KP, KD, resolve)
    assert all(math.isnan(value) for value in torque)


def test_a_motor_that_was_counted_a_turn_off_makes_no_difference(dextar: FiveBar) -> None:
    """q11 is near pi on this path, so the measured angle and that of the path point may differ by a turn."""
    turn = 2.0 * math.pi
    state = state_from_platform(dextar, 1, -1, -0.0672, 0.0395, 0.0, -0.2)
    leg1, leg2 = state.leg1, state.leg2
    rates = (leg1.dq1, leg1.dtheta - leg1.dq1, leg2.dq1, leg2.dtheta - leg2.dq1)
    wound = state_from_joints(dextar, leg1.q1 - turn, leg1.q2, leg2.q1 + turn, leg2.q2, *rates)
    line, reference = Line(-0.067, 0.05, 0.0, -1.0), reference_near(dextar, state)
    resolve = RESOLUTIONS["full_inverse"]
    plain = vhc_joint_torque(dextar, 1, -1, state, reference, line, KP, KD, resolve)
    assert vhc_joint_torque(dextar, 1, -1, wound, reference, line, KP, KD, resolve) == pytest.approx(plain, rel=1e-9)
