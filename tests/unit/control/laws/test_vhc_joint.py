# SPDX-License-Identifier: Apache-2.0
"""The virtual holonomic constraint in joint coordinates, u2, and its constraints."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from fivebar_control.laws.adaptive_gain import NO_MEMORY, GainMemory
from fivebar_control.laws.gains import RESOLUTIONS
from fivebar_control.laws.law import MIN_AUTHORITY, Instant
from fivebar_control.laws.reference import Reference, reference_from_platform
from fivebar_control.laws.torque import Torque
from fivebar_control.laws.vhc_cartesian import vhc_cartesian_torque
from fivebar_control.laws.vhc_joint import VhcJointSettings, path_constraints, vhc_joint_step, vhc_joint_torque
from fivebar_control.model.dynamics import direct_dynamics
from fivebar_control.model.geometry import inverse_geometry, wrap
from fivebar_control.model.kinematics import joint_acceleration, state_from_joints, state_from_platform
from fivebar_control.model.line import Line
from fivebar_control.model.singularity import parallel_svd
from fivebar_control.model.state import Platform, State
from fivebar_description.closed_loop import ClosedLoop
from fivebar_description.parameters import FiveBar
from fivebar_description.settings import as_numbers

Vector = NDArray[np.float64]
States = Callable[[int, int], list[State]]
Vectors = Callable[[State], tuple[Vector, Vector]]

KP, KD = 2500.0, 100.0
EVERY_RESOLUTION = pytest.mark.parametrize("name", sorted(RESOLUTIONS))


def modes(state: State) -> tuple[int, int]:
    return (-1 if state.leg1.sin_q2 > 0.0 else 1), (-1 if state.leg2.sin_q2 > 0.0 else 1)


def reference_near(robot: FiveBar, state: State) -> Reference:
    return reference_from_platform(robot, modes(state), Platform(state.x, state.y, state.vx, state.vy, 0.0, 0.0))


def line_through(state: State, angle: float, aside: float = 0.0) -> Line:
    """A line in a direction, past the platform at a signed distance, beginning 10 mm before it."""
    c, s = math.cos(angle), math.sin(angle)
    return Line(state.x - 0.01 * c - aside * s, state.y - 0.01 * s + aside * c, c, s)


def test_constraints_are_the_motors_distance_from_the_path_point(robot: FiveBar, regular_states: States) -> None:
    """h_i = q_i1 - phi_i(s), its rate, phi', p = dq_i1/deps and its rate, phi differenced along and across the line."""
    step = 1e-4
    for number, state in enumerate(regular_states(60, 80)):
        line = line_through(state, 0.1 * number, aside=5e-4)
        d_x, d_y = line.direction_x, line.direction_y
        along = d_x * (state.x - line.x) + d_y * (state.y - line.y)
        speed = d_x * state.vx + d_y * state.vy
        steps = (-step, 0.0, step)
        x, y = line.x + along * d_x, line.y + along * d_y
        phi = np.array(
            [
                [inverse_geometry(robot, modes(state), x + s * d_x + n * d_y, y + s * d_y - n * d_x) for n in steps]
                for s in steps
            ]
        )
        phi = np.unwrap(np.unwrap(phi, axis=0), axis=1)[:, :, [0, 2]]
        slope = (phi[2, 1] - phi[0, 1]) / (2.0 * step)
        across = (phi[1, 2] - phi[1, 0]) / (2.0 * step)
        twist = (phi[2, 2] - phi[2, 0] - phi[0, 2] + phi[0, 0]) / (4.0 * step * step)
        constraints = path_constraints(robot, modes(state), state, line)
        for leg, found in enumerate(constraints):
            measured = (state.leg1, state.leg2)[leg]
            assert found.h == pytest.approx(wrap(measured.q1 - phi[1, 1, leg]), abs=1e-13)
            assert found.dh == pytest.approx(measured.dq1 - slope[leg] * speed, abs=1e-3 * (1.0 + abs(slope[leg])))
            assert found.slope == pytest.approx(slope[leg], abs=1e-3 * (1.0 + abs(slope[leg])))
            assert found.across == pytest.approx(across[leg], abs=1e-3 * (1.0 + abs(across[leg])))
            assert found.across_rate == pytest.approx(twist[leg] * speed, abs=1e-3 * (1.0 + abs(twist[leg] * speed)))


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
        state = state_from_platform(robot, modes(moving), moving.x, moving.y, 0.3 * c, 0.3 * s)
        line, reference = line_through(state, angle), reference_near(robot, state)
        torque = vhc_joint_torque(robot, modes(state), state, reference, line, KP, KD, RESOLUTIONS[name])
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
        constraints = path_constraints(robot, modes(state), state, line)
        h = np.array([one.h for one in constraints])
        (distance,) = np.linalg.lstsq(np.array([[one.across] for one in constraints]), h, rcond=None)[0]
        v = np.array([-KP * one.h - KD * (one.dh - one.across_rate * distance) for one in constraints])
        svd = parallel_svd(state)
        b = np.array([state.leg1.b, state.leg2.b])
        a = np.array([[state.leg1.u_x, state.leg1.u_y], [state.leg2.u_x, state.leg2.u_y]])
        column = (a @ (svd.v_x, svd.v_y)) / b
        drift = np.array([state.leg1.c, state.leg2.c]) / b
        along = line.direction_x * svd.v_x + line.direction_y * svd.v_y
        asked = column - np.array([one.slope for one in constraints]) * along
        (alpha,) = np.linalg.lstsq(asked[:, None], v, rcond=None)[0]
        u1 = np.array([1.0, svd.fold]) / math.sqrt(2.0)
        wanted = zz * (column * alpha + drift) + (reference.f1, reference.f2) + b * u1 * robot.mass * alpha / svd.s1
        found = vhc_joint_torque(robot, modes(state), state, reference, line, KP, KD, RESOLUTIONS["full_inverse"])
        np.testing.assert_allclose(found, wanted, rtol=1e-9, atol=1e-9)


@EVERY_RESOLUTION
@pytest.mark.parametrize("authority", [1.0, 0.9, 0.6, 0.35])
def test_an_oblique_path_is_held_with_the_full_gain(name: str, authority: float, dextar: FiveBar) -> None:
    """At rest 10 um beside a path that meets the locus at an angle: the pull across it is Kp times the distance."""
    y = math.sqrt(0.0081 - 0.000961)
    state = state_from_platform(dextar, (1, -1), 0.0, y, 0.0, 0.0)
    svd = parallel_svd(state)
    # the normal n with n . v1 = authority, and the direction that it belongs to
    across = math.sqrt(1.0 - authority * authority)
    n_x, n_y = authority * svd.v_x + across * svd.t_x, authority * svd.v_y + across * svd.t_y
    distance = 1e-5
    line = Line(-distance * n_x, y - distance * n_y, -n_y, n_x)
    reference = reference_near(dextar, state)
    torque = vhc_joint_torque(dextar, (1, -1), state, reference, line, KP, KD, RESOLUTIONS[name])
    motion = direct_dynamics(dextar, state, *torque, reference.f1, reference.f2)
    assert n_x * motion.ax + n_y * motion.ay == pytest.approx(-KP * distance, rel=2e-3)


@EVERY_RESOLUTION
def test_an_error_across_the_path_is_pulled_back_on_the_locus(name: str, dextar: FiveBar) -> None:
    """1 mm to the side of x = 0 at the thesis' crossing, at 0.3 m/s: the platform is pulled to the path with Kp x."""
    y = math.sqrt(0.0081 - 0.000961)
    for x in (1e-3, -1e-3):
        state = state_from_platform(dextar, (1, -1), x, y, 0.0, -0.3)
        reference = reference_near(dextar, state)
        line = Line(0.0, 0.15, 0.0, -1.0)
        torque = vhc_joint_torque(dextar, (1, -1), state, reference, line, KP, KD, RESOLUTIONS[name])
        motion = direct_dynamics(dextar, state, *torque, reference.f1, reference.f2)
        assert motion.ax == pytest.approx(-KP * x, rel=2e-4)


class Linearised(NamedTuple):
    """How a law pulls towards a line while the platform moves along it: n . xddot = -kp eps - kd epsdot."""

    kp: float
    kd: float


def linearised(robot: FiveBar, state: State, pull: Callable[[State], Torque]) -> Linearised:
    """Difference the acceleration of the full model across the path, by place and by velocity."""
    speed = math.hypot(state.vx, state.vy)
    n_x, n_y = state.vy / speed, -state.vx / speed
    reference = reference_near(robot, state)

    def away(aside: float, drift: float) -> float:
        place = state.x + aside * n_x, state.y + aside * n_y, state.vx + drift * n_x, state.vy + drift * n_y
        there = state_from_platform(robot, modes(state), *place)
        motion = direct_dynamics(robot, there, *pull(there), reference.f1, reference.f2)
        return n_x * motion.ax + n_y * motion.ay

    step, kick = 1e-6, 1e-4
    return Linearised(
        (away(-step, 0.0) - away(step, 0.0)) / (2.0 * step), (away(0.0, -kick) - away(0.0, kick)) / (2.0 * kick)
    )


def test_the_path_is_held_with_the_full_gains_wherever_and_however_fast_it_is_crossed(
    robot: FiveBar, locus_states: States
) -> None:
    """Random crossings, oblique ones and ones near Type 1 among them, at up to 1 m/s: never below 0.9 Kp."""
    resolve = RESOLUTIONS["full_inverse"]
    crossings = 0
    for state in locus_states(160, 83):
        svd = parallel_svd(state)
        speed = math.hypot(state.vx, state.vy)
        authority = abs(state.vy * svd.v_x - state.vx * svd.v_y) / speed
        if authority < MIN_AUTHORITY:
            continue
        line, reference = line_through(state, math.atan2(state.vy, state.vx)), reference_near(robot, state)

        def by_joints(there: State, at: State = state, line: Line = line, reference: Reference = reference) -> Torque:
            return vhc_joint_torque(robot, modes(at), there, reference, line, KP, KD, resolve)

        found = linearised(robot, state, by_joints)
        assert found.kp > 0.9 * KP
        assert found == pytest.approx((KP, KD), rel=1e-2)
        crossings += 1
    assert crossings > 100


@EVERY_RESOLUTION
def test_to_first_order_it_is_the_cartesian_law(name: str, robot: FiveBar, locus_states: States) -> None:
    """Beside the path both laws pull alike, whatever the resolution leaves uncompensated."""
    resolve = RESOLUTIONS[name]
    for state in locus_states(60, 84):
        svd = parallel_svd(state)
        if abs(state.vy * svd.v_x - state.vx * svd.v_y) < MIN_AUTHORITY * math.hypot(state.vx, state.vy):
            continue
        line, reference = line_through(state, math.atan2(state.vy, state.vx)), reference_near(robot, state)

        def by_joints(there: State, at: State = state, line: Line = line, reference: Reference = reference) -> Torque:
            return vhc_joint_torque(robot, modes(at), there, reference, line, KP, KD, resolve)

        def by_place(there: State, line: Line = line, reference: Reference = reference) -> Torque:
            return vhc_cartesian_torque(robot, there, reference, line, KP, KD, resolve)

        joints, place = linearised(robot, state, by_joints), linearised(robot, state, by_place)
        assert joints.kp == pytest.approx(place.kp, abs=1e-2 * KP)
        assert joints.kd == pytest.approx(place.kd, abs=1e-2 * KD)


def test_it_is_undefined_at_type_1_and_where_the_path_point_is_out_of_reach(dextar: FiveBar) -> None:
    inside = state_from_platform(dextar, (1, -1), 0.0, 0.12, 0.0, 0.0)
    reference = reference_near(dextar, inside)
    far = Line(0.3, 0.15, 0.0, -1.0)
    resolve = RESOLUTIONS["full_friction"]
    torque = vhc_joint_torque(dextar, (1, -1), inside, reference, far, KP, KD, resolve)
    assert all(math.isnan(value) for value in torque)
    stretched = state_from_joints(dextar, 1.0, 0.0, 2.0, -1.2, 0.1, 0.2, 0.3, 0.1)
    near = Line(0.0, 0.15, 0.0, -1.0)
    torque = vhc_joint_torque(dextar, (1, -1), stretched, reference, near, KP, KD, resolve)
    assert all(math.isnan(value) for value in torque)
    # beside a line on which leg 1 is stretched
    reach = dextar.leg1.base_x + dextar.leg1.proximal + dextar.leg1.distal
    assert state_from_platform(dextar, (1, -1), reach, 0.0, 0.0, 0.0).leg1.b == 0.0
    bent = state_from_platform(dextar, (1, -1), reach - 0.002, 0.0, 0.0, 0.0)
    torque = vhc_joint_torque(dextar, (1, -1), bent, reference, Line(reach, 0.0, 0.0, 1.0), KP, KD, resolve)
    assert all(math.isnan(value) for value in torque)


def test_a_motor_that_was_counted_a_turn_off_makes_no_difference(dextar: FiveBar) -> None:
    """q11 is near pi on this path, so the measured angle and that of the path point may differ by a turn."""
    turn = 2.0 * math.pi
    state = state_from_platform(dextar, (1, -1), -0.0672, 0.0395, 0.0, -0.2)
    leg1, leg2 = state.leg1, state.leg2
    rates = (leg1.dq1, leg1.dtheta - leg1.dq1, leg2.dq1, leg2.dtheta - leg2.dq1)
    wound = state_from_joints(dextar, leg1.q1 - turn, leg1.q2, leg2.q1 + turn, leg2.q2, *rates)
    line, reference = Line(-0.067, 0.05, 0.0, -1.0), reference_near(dextar, state)
    resolve = RESOLUTIONS["full_inverse"]
    plain = vhc_joint_torque(dextar, (1, -1), state, reference, line, KP, KD, resolve)
    assert vhc_joint_torque(dextar, (1, -1), wound, reference, line, KP, KD, resolve) == pytest.approx(plain, rel=1e-9)


@pytest.mark.parametrize(
    ("settings", "zone_weight", "jump", "factors"),
    [
        (VhcJointSettings(alpha=3.0), 0.5, (0.0, 2e-4), (9.0, 3.0)),
        (VhcJointSettings(alpha=3.0), 0.5, (-2e-4, 0.0), (9.0, 3.0)),
        (VhcJointSettings(alpha=3.0, keep_damping=False), 1e-9, (0.0, -2e-4), (3.0, 3.0)),
        (VhcJointSettings(alpha=3.0), 0.5, (5e-5, -5e-5), (1.0, 1.0)),
        (VhcJointSettings(alpha=3.0), 0.0, (0.0, 2e-4), (1.0, 1.0)),
        (VhcJointSettings(alpha=3.0, adaptive_gain=False), 0.5, (0.0, 2e-4), (1.0, 1.0)),
    ],
)
def test_a_jump_of_the_tracked_error_inside_a_zone_raises_the_gains(
    settings: VhcJointSettings,
    zone_weight: float,
    jump: tuple[float, float],
    factors: tuple[float, float],
    dextar: FiveBar,
) -> None:
    """By more than 0.1 mm in either coordinate since the sample before the zone, when it was 1 mm and -2 mm."""
    numbers = as_numbers(settings)
    desired = state_from_platform(dextar, (1, -1), 0.0, 0.1, 0.0, -0.2)
    reference, line = reference_near(dextar, desired), Line(0.0, 0.15, 0.0, -1.0)
    memory = NO_MEMORY
    for weight, (off_x, off_y) in ((0.0, (0.0, 0.0)), (zone_weight, jump)):
        state = state_from_platform(dextar, (1, -1), 1e-3 + off_x, 0.1 - 2e-3 + off_y, 0.05, -0.2)
        torque, memory = vhc_joint_step(
            dextar, Instant(state, reference, line, (1, -1), weight, 0.002, None), memory, numbers
        )
    gains = settings.kp * factors[0], settings.kd * factors[1]
    wanted = vhc_joint_torque(dextar, (1, -1), state, reference, line, *gains, RESOLUTIONS[settings.resolution])
    assert torque == pytest.approx(wanted, rel=1e-9)
    if settings.adaptive_gain:
        left = (1e-3, -2e-3) if zone_weight > 0.0 else (1e-3 + jump[0], -2e-3 + jump[1])
        assert memory == pytest.approx(GainMemory(*left), abs=1e-15)
    else:
        assert memory is NO_MEMORY
