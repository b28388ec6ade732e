# SPDX-License-Identifier: Apache-2.0
"""The unified law: its input map, its box-constrained least squares, and what it does on the locus."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import lsq_linear

from fivebar_control.laws.gains import UnifiedSettings
from fivebar_control.laws.law import TunedLaw
from fivebar_control.laws.reference import Reference, reference_from_motors, reference_from_platform
from fivebar_control.laws.torque import Torque
from fivebar_control.laws.unified import (
    INITIAL_MEMORY,
    LAW,
    Box,
    InputMap,
    UnifiedMemory,
    box_least_squares,
    input_map,
    observed_disturbance,
    unified_step,
)
from fivebar_control.loop.law_runner import LawRunner
from fivebar_control.model.dynamics import direct_dynamics
from fivebar_control.model.kinematics import state_from_joints, state_from_motors, state_from_platform
from fivebar_control.model.state import Platform, State
from fivebar_control.trajectory.planner import plan_motion
from fivebar_control.trajectory.zones import ZoneRule
from fivebar_description.closed_loop import ClosedLoop
from fivebar_description.parameters import FiveBar, LegParameters
from fivebar_description.robot_file import load_robot

States = Callable[[int, int], list[State]]

LOCUS_Y = math.sqrt(0.0081 - 0.000961)
PERIOD = 0.002
figures = st.floats(-20.0, 20.0)


def torque_of(robot: FiveBar, state: State, reference: Reference, limit: float = math.inf) -> Torque:
    """Return the first torque of the law with its default gains."""
    settings = UnifiedSettings(torque_limit=limit)
    return unified_step(robot, state, reference, INITIAL_MEMORY, settings, PERIOD)[0]


def unified_law(settings: UnifiedSettings) -> LawRunner:
    """Return the law over the samples of a run at 500 Hz; the plan only says where straight segments lie."""
    robot = load_robot("dextar")
    plan = plan_motion(robot, (1, -1), ((0.0, 0.15), (0.0, 0.035)), (0.5,), 500, ZoneRule())
    return LawRunner(TunedLaw(LAW, settings), robot, plan, 500)


def acceleration_by_pinocchio(robot: FiveBar, state: State, tau1: float, tau2: float) -> tuple[float, float]:
    """Return xddot of the frictionless robot under motor torques."""
    loop = ClosedLoop(robot)
    leg1, leg2 = state.leg1, state.leg2
    q = np.array([leg1.q1, leg1.q2, leg2.q1, leg2.q2])
    v = np.array([leg1.dq1, leg1.dtheta - leg1.dq1, leg2.dq1, leg2.dtheta - leg2.dq1])
    bend = loop.acceleration(q, v, np.array([tau1, 0.0, tau2, 0.0]))
    ax, ay = loop.platform(q, v, bend)[2].tolist()
    return ax, ay


def expected(mapped: InputMap, push: tuple[float, float]) -> tuple[float, float]:
    return (
        mapped.g_x1 * push[0] + mapped.g_x2 * push[1] + mapped.a0_x,
        mapped.g_y1 * push[0] + mapped.g_y2 * push[1] + mapped.a0_y,
    )


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
    """Away from the Type 2 locus and on it: xddot = G u + a_0 against Pinocchio's closed loop."""
    robot = load_robot("dextar")
    state = state_from_platform(robot, (1, -1), 0.01 if y != LOCUS_Y else 0.0, y, 0.3, -0.4)
    mapped = input_map(robot, state)
    assert mapped is not None
    for u in ((0.0, 0.0), (0.7, -0.3), (-1.1, 0.4)):
        assert expected(mapped, u) == pytest.approx(acceleration_by_pinocchio(robot, state, *u), abs=1e-9)


@pytest.mark.parametrize("name", ["dextar", "unequal"])
def test_the_input_map_is_regular_where_a_leg_is_stretched(name: str) -> None:
    """At Type 1, moving, against Pinocchio: the stretched leg's motor moves nothing, the other one does."""
    robot = load_robot(name)
    # leg 1 points from motor 1 to the platform
    reach = robot.leg1.proximal + robot.leg1.distal
    x, y = robot.leg1.base_x + 0.6 * reach, 0.8 * reach
    q21 = state_from_platform(robot, (1, -1), x, y, 0.0, 0.0).leg2.q1
    state = state_from_motors(robot, 1, math.atan2(0.8, 0.6), q21, 1.3, -0.8)
    assert abs(state.leg1.sin_q2) < 1e-8
    mapped = input_map(robot, state)
    assert mapped is not None
    for u in ((0.0, 0.0), (0.7, -0.3)):
        assert expected(mapped, u) == pytest.approx(acceleration_by_pinocchio(robot, state, *u), abs=1e-8)
    assert math.hypot(mapped.g_x1, mapped.g_y1) < 1e-6 < math.hypot(mapped.g_x2, mapped.g_y2)


@pytest.mark.parametrize("leg", [1, 2])
@pytest.mark.parametrize("turns", [0, 1, -2])
def test_at_type_1_the_stretched_legs_motor_is_held_to_its_plan(leg: int, turns: int) -> None:
    """The platform does not feel that motor there; its own acceleration is the planned one plus the feedback.

    The plan is 2 mrad behind the motor, however many turns the motor is counted off, and 0.1 rad/s faster.
    """
    robot, settings = load_robot("dextar"), UnifiedSettings()
    whole = 2.0 * math.pi * turns
    # leg 1 points from motor 1 to (0.049, 0.144), leg 2 from motor 2 to the mirror image
    q11 = math.atan2(0.8, 0.6)
    q21 = state_from_platform(robot, (1, -1), 0.049, 0.144, 0.0, 0.0).leg2.q1
    if leg == 1:
        state = state_from_motors(robot, 1, q11, q21, 1.0, -0.5)
        desired = state_from_motors(robot, 1, q11 - 0.002 + whole, q21, 1.1, -0.5)
        reference = reference_from_motors(robot, desired, 0.0, 0.0, 3.0, 0.0)
    else:
        state = state_from_motors(robot, 1, math.pi - q21, math.pi - q11, 0.5, -1.0)
        desired = state_from_motors(robot, 1, math.pi - q21, math.pi - q11 - 0.002 + whole, 0.5, -0.9)
        reference = reference_from_motors(robot, desired, 0.0, 0.0, 0.0, 3.0)
    torque = torque_of(robot, state, reference)
    motion = direct_dynamics(robot, state, *torque, reference.f1, reference.f2)
    found = motion.ddq11 if leg == 1 else motion.ddq21
    # at the plan's place, 2 mrad off, the platform takes a little of the motor's torque
    planned = reference.u1 / robot.leg1.inertia if leg == 1 else reference.u2 / robot.leg2.inertia
    assert planned == pytest.approx(3.0, abs=0.01)
    assert found == pytest.approx(planned + settings.kd * 0.1 - settings.kp * 0.002, abs=1e-5)


def test_on_the_locus_torque_stays_small_and_acts_across_the_path_only() -> None:
    robot = load_robot("dextar")
    state = state_from_platform(robot, (1, -1), 0.0, LOCUS_Y, 0.0, -0.2)
    # asks for 1 m/s^2 in the uncontrollable direction y, and for 0.5 in x
    reference = reference_from_platform(robot, (1, -1), Platform(0.0, LOCUS_Y, 0.0, -0.2, 0.5, 1.0))
    torque = torque_of(robot, state, reference)
    motion = direct_dynamics(robot, state, *torque, reference.f1, reference.f2)
    assert abs(motion.ay) < 1e-9
    assert 0.3 < motion.ax < 0.5
    assert max(abs(torque.tau1), abs(torque.tau2)) < 2.0


def test_along_each_direction_of_the_input_map_the_law_gives_its_share() -> None:
    """Damped least squares: of what is asked along a singular direction, s^2 / (s^2 + w) is given."""
    robot = load_robot("dextar")
    state = state_from_platform(robot, (1, -1), 0.004, 0.0853, 0.0, 0.0)
    mapped = input_map(robot, state)
    assert mapped is not None
    left, s, _ = np.linalg.svd(np.array([[mapped.g_x1, mapped.g_x2], [mapped.g_y1, mapped.g_y2]]))
    assert s[1] < 1.0 < 3.0 < s[0]
    for direction, value in zip(left.T, s.tolist(), strict=True):
        asked = 2.0 * direction + [mapped.a0_x, mapped.a0_y]
        platform = Platform(state.x, state.y, 0.0, 0.0, *asked.tolist())
        reference = reference_from_platform(robot, (1, -1), platform)
        torque = torque_of(robot, state, reference)
        got = expected(mapped, (torque.tau1 - reference.f1, torque.tau2 - reference.f2))
        given = np.array(got) - [mapped.a0_x, mapped.a0_y]
        share = value * value / (value * value + UnifiedSettings().weight)
        assert given == pytest.approx(2.0 * share * direction, abs=1e-9)


def test_the_torque_limit_is_kept() -> None:
    robot = load_robot("dextar")
    state = state_from_platform(robot, (1, -1), 0.0, 0.14, 0.0, 0.0)
    reference = reference_from_platform(robot, (1, -1), Platform(0.02, 0.12, 0.5, 0.5, 50.0, -80.0))
    torque = torque_of(robot, state, reference, 0.6)
    assert max(abs(torque.tau1), abs(torque.tau2)) == pytest.approx(0.6, abs=1e-12)


disturbances = st.floats(-0.4, 0.4)


@given(
    x=st.floats(-0.03, 0.03),
    y=st.one_of(st.just(LOCUS_Y), st.floats(0.03, 0.14)),
    true=st.tuples(disturbances, disturbances),
    believed=st.tuples(disturbances, disturbances),
    push=st.tuples(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0)),
    rate=st.floats(0.1, 1e4),
)
def test_the_disturbances_error_grows_by_no_more_than_the_input_map_changes(
    x: float,
    y: float,
    true: tuple[float, float],
    believed: tuple[float, float],
    push: tuple[float, float],
    rate: float,
) -> None:
    """Wherever the robot is, on the locus too, one sample takes the estimate no further from the truth.

    The platform moves on between the two samples, and with it the input map: by so much the error may miss its bound.
    """
    robot = load_robot("dextar")
    x, vx, vy = 0.0 if y == LOCUS_Y else x, 0.3, -0.4
    state = state_from_platform(robot, (1, -1), x, y, vx, vy)
    state_before = state_from_platform(robot, (1, -1), x - vx * PERIOD, y - vy * PERIOD, vx, vy)
    mapped, mapped_before = input_map(robot, state), input_map(robot, state_before)
    assert mapped is not None
    assert mapped_before is not None
    given, thought = (push[0] + true[0], push[1] + true[1]), (push[0] + believed[0], push[1] + believed[1])
    ax, ay = (0.5 * (a + b) for a, b in zip(expected(mapped_before, given), expected(mapped, given), strict=True))
    memory = UnifiedMemory(
        *believed, False, *push, vx - ax * PERIOD, vy - ay * PERIOD, *expected(mapped_before, thought)
    )
    settings = UnifiedSettings(observer_rate=rate)
    found = observed_disturbance(mapped, state, memory, settings, PERIOD)
    error_before, error = math.dist(believed, true), math.dist(found, true)
    g, g_before = input_matrix(mapped), input_matrix(mapped_before)
    gain = 1.0 - math.exp(-rate * PERIOD)
    # no singular value of (G^T G + w)^-1 G^T is above 1 / (2 sqrt(w))
    change = gain * 0.5 * float(np.linalg.norm(g - g_before, 2)) / (2.0 * math.sqrt(settings.weight))
    # with the eigenvalues of (I - gamma S)
    s = np.linalg.svd(g, compute_uv=False)
    slowest = 1.0 - gain * s[1] ** 2 / (s[1] ** 2 + settings.weight)
    assert error <= (slowest + change) * error_before + 1e-9


def input_matrix(mapped: InputMap) -> np.ndarray:
    return np.array([[mapped.g_x1, mapped.g_x2], [mapped.g_y1, mapped.g_y2]])


def modes(state: State) -> tuple[int, int]:
    return (-1 if state.leg1.sin_q2 > 0.0 else 1), (-1 if state.leg2.sin_q2 > 0.0 else 1)


def reference_near(robot: FiveBar, state: State) -> Reference:
    """Return an instant a millimetre off a state, with another velocity and an acceleration of its own."""
    platform = Platform(state.x + 6e-4, state.y - 8e-4, state.vx - 0.05, state.vy + 0.03, 2.0, -3.0)
    return reference_from_platform(robot, modes(state), platform)


@pytest.mark.parametrize("disturbance", [(0.0, 0.0), (0.3, 0.1), (-0.2, 0.4)])
def test_a_moving_platform_gets_the_wanted_acceleration_under_a_known_disturbance(
    disturbance: tuple[float, float], robot: FiveBar, regular_states: States
) -> None:
    """Where torque costs next to nothing: xddot_d + Kd e' + Kp e, in both directions, whatever the velocity is."""
    settings = UnifiedSettings(weight=1e-9)
    memory = INITIAL_MEMORY._replace(d1=disturbance[0], d2=disturbance[1])
    for state in regular_states(20, 90):
        reference = reference_near(robot, state)
        torque = unified_step(robot, state, reference, memory, settings, PERIOD)[0]
        acting = torque.tau1 + disturbance[0], torque.tau2 + disturbance[1]
        motion = direct_dynamics(robot, state, *acting, reference.f1, reference.f2)
        desired = reference.state
        wanted = (
            2.0 + settings.kd * (desired.vx - state.vx) + settings.kp * (desired.x - state.x),
            -3.0 + settings.kd * (desired.vy - state.vy) + settings.kp * (desired.y - state.y),
        )
        assert (motion.ax, motion.ay) == pytest.approx(wanted, rel=1e-5, abs=1e-5)


@pytest.mark.parametrize("disturbance", [(0.3, 0.1), (-0.2, 0.4)])
def test_the_torque_limit_counts_what_is_given_against_the_disturbance(
    disturbance: tuple[float, float], robot: FiveBar, regular_states: States
) -> None:
    """The limit is the drives': friction and disturbance are made up for within it. What is left is used in full."""
    limit = 0.5
    memory = INITIAL_MEMORY._replace(d1=disturbance[0], d2=disturbance[1])
    for state in regular_states(20, 91):
        reference = reference_near(robot, state)
        free, cut = (
            unified_step(robot, state, reference, memory, UnifiedSettings(torque_limit=at_most), PERIOD)[0]
            for at_most in (math.inf, limit)
        )
        assert max(map(abs, cut)) <= limit + 1e-12
        if max(map(abs, free)) <= limit:
            assert cut == free
        else:
            assert max(map(abs, cut)) == pytest.approx(limit, abs=1e-12)


def one_period_on(
    robot: FiveBar, state: State, torque: Torque, disturbance: tuple[float, float], reference: Reference
) -> State:
    """Return the state after a period under held torques, by the trapezoidal rule.

    The friction is that of the reference, the one that the law makes up for.
    """

    def acceleration(state: State) -> tuple[float, float]:
        acting = torque.tau1 + disturbance[0], torque.tau2 + disturbance[1]
        motion = direct_dynamics(robot, state, *acting, reference.f1, reference.f2)
        return motion.ax, motion.ay

    (ax, ay), x, y = acceleration(state), state.x + PERIOD * state.vx, state.y + PERIOD * state.vy
    later = state
    # c depends on the velocity that is looked for
    for _ in range(30):
        bx, by = (ax, ay) if later is state else acceleration(later)
        vx, vy = state.vx + 0.5 * PERIOD * (ax + bx), state.vy + 0.5 * PERIOD * (ay + by)
        later = state_from_platform(robot, modes(state), x, y, vx, vy)
    return later


def test_what_the_model_expected_teaches_nothing(robot: FiveBar, regular_states: States) -> None:
    """The velocity changes by the mean of the accelerations at both ends of the period: the estimate was right."""
    disturbance = (0.2, -0.3)
    memory = INITIAL_MEMORY._replace(d1=disturbance[0], d2=disturbance[1])
    settings = UnifiedSettings(observer_rate=400.0)
    for state in regular_states(20, 92):
        reference = reference_near(robot, state)
        torque, kept = unified_step(robot, state, reference, memory, settings, PERIOD)
        later = one_period_on(robot, state, torque, disturbance, reference)
        found = unified_step(robot, later, reference, kept, settings, PERIOD)[1]
        assert (found.d1, found.d2) == pytest.approx(disturbance, abs=1e-9)


@pytest.mark.parametrize("disturbance", [(0.3, 0.1), (-0.2, 0.4)])
def test_a_constant_disturbance_is_found_on_the_way(disturbance: tuple[float, float], dextar: FiveBar) -> None:
    """The platform goes at 0.25 m/s, so both samples of a pair have input maps and drifts of their own."""
    law_memory, settings = INITIAL_MEMORY, UnifiedSettings(weight=0.01, observer_rate=200.0)
    state = state_from_platform(dextar, (1, -1), -0.02, 0.14, 0.15, -0.2)
    errors = []
    for sample in range(1, 76):
        t = sample * PERIOD
        platform = Platform(-0.02 + 0.15 * t, 0.14 - 0.2 * t, 0.15, -0.2, 0.0, 0.0)
        reference = reference_from_platform(dextar, (1, -1), platform)
        torque, law_memory = unified_step(dextar, state, reference, law_memory, settings, PERIOD)
        state = one_period_on(dextar, state, torque, disturbance, reference)
        errors.append(math.dist((law_memory.d1, law_memory.d2), disturbance))
    assert errors[0] == math.hypot(*disturbance)
    # 50 samples at 200 /s: exp(-20), and S takes a little
    assert errors[50] < 1e-4
    assert max(errors[50:]) < 1e-4


def type_3_robot(dextar: FiveBar) -> FiveBar:
    """A five-bar whose legs can both be stretched along x at once: there Types 1 and 2 meet in both legs."""

    def leg(base_x: float, proximal: float, distal: float) -> LegParameters:
        return dextar.leg1._replace(base_x=base_x, proximal=proximal, distal=distal)

    return FiveBar(leg(-0.05, 0.1, 0.1), leg(0.05, 0.06, 0.04), 0.5)


@pytest.mark.parametrize("rate", [1.0, 40.0, 400.0])
def test_away_from_the_locus_the_error_fades_at_the_rate_of_the_observer(
    rate: float, robot: FiveBar, regular_states: States
) -> None:
    """Where torque costs next to nothing S is the unit matrix: exp(-rate T) of the error is left of either motor's."""
    true, believed, push = (0.3, -0.2), (-0.1, 0.1), (0.4, 0.5)
    settings = UnifiedSettings(weight=1e-9, observer_rate=rate)
    left = math.exp(-rate * PERIOD)
    for state in regular_states(20, 93):
        mapped = input_map(robot, state)
        assert mapped is not None
        ax, ay = expected(mapped, (push[0] + true[0], push[1] + true[1]))
        thought = expected(mapped, (push[0] + believed[0], push[1] + believed[1]))
        memory = UnifiedMemory(*believed, False, *push, state.vx - ax * PERIOD, state.vy - ay * PERIOD, *thought)
        found = observed_disturbance(mapped, state, memory, settings, PERIOD)
        wanted = tuple(t + left * (b - t) for t, b in zip(true, believed, strict=True))
        assert found == pytest.approx(wanted, rel=1e-5, abs=1e-7)


def test_without_an_observer_no_sample_depends_on_the_one_before(dextar: FiveBar) -> None:
    """Its period may be infinite, for a law that is asked for single instants."""
    settings = UnifiedSettings(observer_rate=0.0)
    state = state_from_platform(dextar, (1, -1), 0.01, 0.12, 0.1, -0.2)
    reference = reference_near(dextar, state)
    first, memory = unified_step(dextar, state, reference, INITIAL_MEMORY, settings, math.inf)
    assert all(math.isfinite(value) for value in first)
    again = state_from_platform(dextar, (1, -1), 0.02, 0.13, -0.3, 0.1)
    memory = unified_step(dextar, again, reference, memory, settings, math.inf)[1]
    assert unified_step(dextar, state, reference, memory, settings, math.inf)[0] == first


def test_a_heavy_platform_has_an_input_map_too(dextar: FiveBar) -> None:
    """With 50 kg the platform hardly moves, which is no singularity: against Pinocchio."""
    heavy = dextar._replace(mass=50.0)
    for state in (state_from_platform(heavy, (1, -1), 0.0, y, 0.3, -0.4) for y in (0.12, 0.16, 0.05)):
        mapped = input_map(heavy, state)
        assert mapped is not None
        found = expected(mapped, (0.7, -0.3))
        assert found == pytest.approx(acceleration_by_pinocchio(heavy, state, 0.7, -0.3), abs=1e-9)


def test_after_an_undefined_torque_nothing_is_learned_but_what_was_known_stays(dextar: FiveBar) -> None:
    """What acted while there was no torque is not known. The disturbance found before that still is."""
    robot, settings = type_3_robot(dextar), UnifiedSettings(kp=0.0, kd=0.0)
    singular = state_from_joints(robot, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    regular = state_from_platform(robot, (1, -1), 0.02, 0.06, 0.2, 0.1)
    reference = reference_from_platform(robot, (1, -1), Platform(0.02, 0.06, 0.0, 0.0, 0.0, 0.0))
    known = INITIAL_MEMORY._replace(d1=0.2, d2=-0.1, unset=False)
    torque, kept = unified_step(robot, singular, reference, known, settings, PERIOD)
    assert all(math.isnan(value) for value in torque)
    without, after = unified_step(robot, regular, reference, known._replace(unset=True), settings, PERIOD)
    assert unified_step(robot, regular, reference, kept, settings, PERIOD) == (without, after)
    assert (after.d1, after.d2, after.unset) == (0.2, -0.1, False)
    # with the memory of another sample it would have learned
    assert unified_step(robot, regular, reference, known, settings, PERIOD)[0] != without


def test_the_disturbance_is_bounded_on_the_locus_whatever_is_measured() -> None:
    """A robot that rests on the locus under wildly wrong speeds: the estimate stays within its limit."""
    robot, settings = load_robot("dextar"), UnifiedSettings(observer_rate=200.0)
    law = unified_law(settings)
    random = np.random.default_rng(3)
    reference = reference_from_platform(robot, (1, -1), Platform(0.0, LOCUS_Y, 0.0, 0.0, 0.0, 0.0))
    bound = settings.disturbance_limit
    least = unified_law(settings._replace(observer_rate=0.0))
    for sample in range(2000):
        state = state_from_platform(robot, (1, -1), 0.0, LOCUS_Y, *random.normal(0.0, 1.0, 2).tolist())
        torque, without = law(sample, state, reference), least(sample, state, reference)
        # the torques differ by what is believed
        assert max(abs(torque.tau1 - without.tau1), abs(torque.tau2 - without.tau2)) <= bound + 1e-9


def test_a_gap_between_samples_teaches_nothing() -> None:
    """The estimate stays over a gap: what happened in it is not known. The next sample teaches again."""
    robot = load_robot("dextar")
    reference = reference_from_platform(robot, (1, -1), Platform(0.0, 0.12, 0.0, 0.0, 0.0, 0.0))
    still = state_from_platform(robot, (1, -1), 0.0, 0.12, 0.0, 0.0)
    fast = state_from_platform(robot, (1, -1), 0.0, 0.12, 0.0, -0.1)
    settings = UnifiedSettings(kp=0.0, kd=0.0)
    after_gap, after_none = unified_law(settings), unified_law(settings)
    after_gap(0, still, reference), after_none(0, still, reference)
    memoryless = unified_law(settings._replace(observer_rate=0.0))
    assert after_gap(2, fast, reference) == memoryless(2, fast, reference)
    assert after_none(1, fast, reference) != memoryless(1, fast, reference)
