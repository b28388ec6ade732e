# SPDX-License-Identifier: Apache-2.0
"""The virtual holonomic constraint u3 and its three resolutions, on and off the locus."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from fivebar_control.laws.gains import RESOLUTIONS
from fivebar_control.laws.reference import Reference, reference_from_platform
from fivebar_control.laws.resolution import Enforced, resolved
from fivebar_control.laws.torque import ZERO, Torque
from fivebar_control.laws.vhc_cartesian import line_constraint, vhc_cartesian_torque
from fivebar_control.model.dynamics import direct_dynamics
from fivebar_control.model.kinematics import joint_acceleration, state_from_joints, state_from_platform
from fivebar_control.model.line import Line
from fivebar_control.model.singularity import parallel_svd
from fivebar_control.model.state import Platform, State
from fivebar_description.closed_loop import ClosedLoop
from fivebar_description.parameters import FiveBar

Vector = NDArray[np.float64]
States = Callable[[int, int], list[State]]
Vectors = Callable[[State], tuple[Vector, Vector]]
Matrices = Callable[[State], tuple[Vector, Vector]]

KP, KD = 2500.0, 100.0
EVERY_RESOLUTION = pytest.mark.parametrize("name", ["min_norm", "full_friction", "full_inverse"])


def reference_near(robot: FiveBar, state: State) -> Reference:
    modes = ((-1 if state.leg1.sin_q2 > 0.0 else 1), (-1 if state.leg2.sin_q2 > 0.0 else 1))
    return reference_from_platform(robot, modes, Platform(state.x, state.y, state.vx, state.vy, 0.0, 0.0))


def line_past(state: State, v1: Vector, random: np.random.Generator) -> Line:
    """A line about a millimetre from the platform, whose normal has |n . v1| of at least 0.3."""
    while True:
        angle = random.uniform(0.0, 2.0 * math.pi)
        if abs(v1 @ (math.sin(angle), -math.cos(angle))) >= 0.3:
            offset_x, offset_y = random.uniform(-1e-3, 1e-3, 2).tolist()
            return Line(state.x + offset_x, state.y + offset_y, math.cos(angle), math.sin(angle))


def across(line: Line) -> Vector:
    """The normal: the line's direction turned by -90 degrees."""
    return np.array([[0.0, 1.0], [-1.0, 0.0]]) @ (line.direction_x, line.direction_y)


def commanded(line: Line, state: State) -> float:
    """-(Kp h + Kd hdot)."""
    n = across(line)
    return float(-(KP * n @ (state.x - line.x, state.y - line.y) + KD * n @ (state.vx, state.vy)))


def test_constraint_of_the_thesis_path() -> None:
    """x = 0, downwards and back up: the normal turns round with the direction, so h keeps its side."""
    down = line_constraint(Line(0.0, 0.15, 0.0, -1.0), 0.002, 0.1, 0.03, -0.4)
    assert down == (-0.002, -0.03, -1.0, 0.0)
    up = line_constraint(Line(0.0, 0.035, 0.0, 1.0), 0.002, 0.1, 0.03, 0.4)
    assert up == (0.002, 0.03, 1.0, 0.0)


def test_h_is_the_signed_distance_and_dh_its_rate() -> None:
    line = Line(0.01, 0.02, 0.6, 0.8)
    x, y, vx, vy = 0.05, -0.03, 0.2, 0.5
    h = 1e-6
    found = line_constraint(line, x, y, vx, vy)
    ahead = line_constraint(line, x + h * vx, y + h * vy, vx, vy)
    assert found.h == pytest.approx(0.8 * 0.04 + 0.6 * 0.05, abs=1e-16)
    assert found.dh == pytest.approx((ahead.h - found.h) / h, rel=1e-8)
    assert line_constraint(line, line.x + 0.3 * 0.6, line.y + 0.3 * 0.8, 0.6, 0.8)[:2] == pytest.approx(
        (0, 0), abs=1e-16
    )


@EVERY_RESOLUTION
def test_on_the_locus_the_constraint_obeys_its_equation(
    name: str, robot: FiveBar, loop: ClosedLoop, locus_states: States, joint_vectors: Vectors, matrices: Matrices
) -> None:
    """n . xddot = -(Kp h + Kd hdot) when u3 acts, by the analytic model and by Pinocchio; crossings of both folds."""
    random = np.random.default_rng(60)
    folds = set()
    for state in locus_states(100, 61):
        v1 = np.linalg.svd(matrices(state)[0])[2][0]
        line = line_past(state, v1, random)
        reference = reference_near(robot, state)
        torque = vhc_cartesian_torque(robot, state, reference, line, KP, KD, RESOLUTIONS[name])
        wanted = commanded(line, state)
        n = across(line)

        motion = direct_dynamics(robot, state, *torque, reference.f1, reference.f2)
        scale = 1.0 + abs(wanted) + abs(motion.lambda1) + abs(motion.lambda2)
        assert n @ (motion.ax, motion.ay) == pytest.approx(wanted, abs=1e-11 * scale)
        net = np.array([torque.tau1 - reference.f1, 0.0, torque.tau2 - reference.f2, 0.0])
        q, v = joint_vectors(state)
        true = loop.platform(q, v, loop.acceleration(q, v, net))[2]
        assert n @ true == pytest.approx(wanted, abs=1e-10 * scale)
        folds.add(parallel_svd(state).fold)
    assert folds == {-1.0, 1.0}


@EVERY_RESOLUTION
def test_on_the_locus_every_resolution_meets_the_reduced_equation(
    name: str, robot: FiveBar, locus_states: States, matrices: Matrices
) -> None:
    """w^T tau = w^T (ZZ qddot + f) + m alpha / s1 with w = B^-1 U_1, all taken from numpy's decomposition."""
    zz = np.diag([robot.leg1.inertia, robot.leg2.inertia])
    f = np.array([0.2, -0.3])
    for state in locus_states(100, 62):
        a, b = matrices(state)
        u, s, v = np.linalg.svd(a)
        svd = parallel_svd(state)
        alpha = 3.0 * float(np.sign(v[0] @ (svd.v_x, svd.v_y)))  # numpy may have turned v1, and U_1 with it
        ax, ay = (alpha * v[0]).tolist()
        ddq = np.array([joint_acceleration(state.leg1, ax, ay), joint_acceleration(state.leg2, ax, ay)])
        torque = resolved(RESOLUTIONS[name], robot, state, svd, Enforced(3.0, *ddq.tolist(), 0.0), Torque(*f.tolist()))
        w = np.linalg.solve(b, u[:, 0])
        wanted = w @ (zz @ ddq + f) + robot.mass * alpha / s[0]
        assert w @ torque == pytest.approx(wanted, abs=1e-11 * (1.0 + np.linalg.norm(w) * np.linalg.norm(torque)))


def test_min_norm_is_the_pseudo_inverse_and_no_torque_is_smaller(
    robot: FiveBar, locus_states: States, matrices: Matrices
) -> None:
    zz = np.diag([robot.leg1.inertia, robot.leg2.inertia])
    f = np.array([0.2, -0.3])
    strictly_smaller = 0
    for state in locus_states(100, 63):
        a, b = matrices(state)
        svd = parallel_svd(state)
        ddq = np.array([joint_acceleration(leg, 3.0 * svd.v_x, 3.0 * svd.v_y) for leg in (state.leg1, state.leg2)])
        arguments = robot, state, svd, Enforced(3.0, *ddq.tolist(), 0.0), Torque(*f.tolist())
        torques = {name: np.array(resolved(number, *arguments)) for name, number in RESOLUTIONS.items()}
        w = np.linalg.solve(b, np.array([1.0, np.sign(a[0] @ a[1])]) / math.sqrt(2.0))
        right = w @ (zz @ ddq + f) + robot.mass * 3.0 / math.sqrt(2.0)
        smallest = np.linalg.lstsq(w[None, :], np.array([right]), rcond=None)[0]
        scale = float(np.linalg.norm(torques["full_inverse"]))
        np.testing.assert_allclose(torques["min_norm"], smallest, atol=1e-12 * scale)
        for other in ("full_friction", "full_inverse"):
            difference = np.linalg.norm(torques[other]) - np.linalg.norm(smallest)
            assert difference >= -1e-12 * scale
            strictly_smaller += difference > 1e-3
    assert strictly_smaller > 150


def test_full_friction_moves_friction_from_the_equation_into_both_motors(robot: FiveBar, locus_states: States) -> None:
    """tau - f is then the smallest torque of the frictionless robot."""
    for state in locus_states(40, 64):
        svd = parallel_svd(state)
        enforced = Enforced(2.0, 5.0, -7.0, 0.0)
        plain = resolved(RESOLUTIONS["min_norm"], robot, state, svd, enforced, ZERO)
        with_friction = resolved(RESOLUTIONS["full_friction"], robot, state, svd, enforced, Torque(0.25, -0.35))
        np.testing.assert_allclose(with_friction, np.add(plain, (0.25, -0.35)), atol=1e-14)


def test_full_inverse_is_exact_off_the_locus_too(
    robot: FiveBar, loop: ClosedLoop, regular_states: States, joint_vectors: Vectors
) -> None:
    """It gives xddot = alpha v1 anywhere: nothing along t_s and the commanded component across the path."""
    random = np.random.default_rng(65)
    for state in regular_states(100, 66):
        svd = parallel_svd(state)
        line = line_past(state, np.array([svd.v_x, svd.v_y]), random)
        reference = reference_near(robot, state)
        torque = vhc_cartesian_torque(robot, state, reference, line, KP, KD, RESOLUTIONS["full_inverse"])
        net = np.array([torque.tau1 - reference.f1, 0.0, torque.tau2 - reference.f2, 0.0])
        q, v = joint_vectors(state)
        true = loop.platform(q, v, loop.acceleration(q, v, net))[2]
        wanted = commanded(line, state)
        scale = 1.0 + abs(wanted) + float(np.abs(true).max())
        assert across(line) @ true == pytest.approx(wanted, abs=1e-10 * scale)
        assert abs(svd.t_x * true[0] + svd.t_y * true[1]) < 1e-10 * scale


@pytest.mark.parametrize("name", ["min_norm", "full_friction"])
def test_the_reduced_resolutions_are_not_exact_off_the_locus(name: str, dextar: FiveBar) -> None:
    """Which is why the blending zone must be narrow for them."""
    state = state_from_platform(dextar, (1, -1), 0.001, 0.12, 0.05, -0.3)
    line = Line(0.0, 0.15, 0.0, -1.0)
    reference = reference_near(dextar, state)
    torque = vhc_cartesian_torque(dextar, state, reference, line, KP, KD, RESOLUTIONS[name])
    motion = direct_dynamics(dextar, state, *torque, reference.f1, reference.f2)
    svd = parallel_svd(state)
    assert abs(svd.t_x * motion.ax + svd.t_y * motion.ay) > 0.5


@EVERY_RESOLUTION
def test_the_torque_stays_moderate_across_the_locus(name: str, dextar: FiveBar) -> None:
    """No jump and no growth while det A goes through zero, where the computed torque law is undefined."""
    y = math.sqrt(0.0081 - 0.000961)
    line = Line(0.0, 0.15, 0.0, -1.0)

    def torque(gap: float) -> Torque:
        state = state_from_platform(dextar, (1, -1), 1e-5, y + gap, 1e-3, -0.3)
        return vhc_cartesian_torque(dextar, state, reference_near(dextar, state), line, KP, KD, RESOLUTIONS[name])

    for gap in (1e-3, 1e-6, 0.0, -1e-6, -1e-3):
        assert max(map(abs, torque(gap))) < 2.0
    # the motors turn round there, so friction makes it steep (about 600 Nm/m), but not a jump
    np.testing.assert_allclose(torque(1e-12), torque(-1e-12), rtol=0.0, atol=1e-8)


@EVERY_RESOLUTION
def test_a_path_along_t_s_leaves_nothing_to_control_it_with(name: str, dextar: FiveBar) -> None:
    """The distal links are level there, so v1 = (1, 0), and a level path has its normal along t_s."""
    state = state_from_joints(dextar, 2.0, -2.0, 1.0, -1.0, 0.1, 0.0, 0.2, 0.0)
    reference = reference_near(dextar, state_from_platform(dextar, (1, -1), 0.0, 0.12, 0.0, 0.0))
    level, steep = Line(0.0, 0.08, 1.0, 0.0), Line(0.0, 0.08, 0.0, 1.0)
    along_t_s = vhc_cartesian_torque(dextar, state, reference, level, KP, KD, RESOLUTIONS[name])
    assert all(math.isnan(value) for value in along_t_s)
    along_v1 = vhc_cartesian_torque(dextar, state, reference, steep, KP, KD, RESOLUTIONS[name])
    assert all(math.isfinite(value) for value in along_v1)


@EVERY_RESOLUTION
def test_a_leg_at_type_1_makes_the_torque_undefined(name: str, dextar: FiveBar) -> None:
    state = state_from_joints(dextar, 1.0, 0.0, 2.0, -1.2, 0.1, 0.2, 0.3, 0.1)
    reference = reference_near(dextar, state_from_platform(dextar, (1, -1), 0.0, 0.12, 0.0, 0.0))
    torque = vhc_cartesian_torque(dextar, state, reference, Line(0.0, 0.15, 0.0, -1.0), KP, KD, RESOLUTIONS[name])
    assert math.isnan(torque.tau1)
