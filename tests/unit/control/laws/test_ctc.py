# SPDX-License-Identifier: Apache-2.0
"""Computed torque control: with an exact model the motors' errors obey a linear second-order equation."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from fivebar_control.laws.ctc import ctc_torque
from fivebar_control.laws.reference import Reference, reference_from_platform
from fivebar_control.model.dynamics import direct_dynamics
from fivebar_control.model.geometry import inverse_geometry, wrap
from fivebar_control.model.kinematics import state_from_joints, state_from_platform
from fivebar_control.model.state import Platform, State, WorkingMode
from fivebar_description.parameters import FiveBar

States = Callable[[int, int], list[State]]

KP, KD = 900.0, 45.0


def modes(state: State) -> tuple[int, int]:
    return (-1 if state.leg1.sin_q2 > 0.0 else 1), (-1 if state.leg2.sin_q2 > 0.0 else 1)


def desired(robot: FiveBar, state: State, random: np.random.Generator) -> tuple[Platform, Reference]:
    """A reference about a millimetre from a state, with another velocity."""
    dx, dy, dvx, dvy, ax, ay = (random.uniform(-1.0, 1.0, 6) * [1e-3, 1e-3, 0.02, 0.02, 3.0, 3.0]).tolist()
    platform = Platform(state.x + dx, state.y + dy, state.vx + dvx, state.vy + dvy, ax, ay)
    return platform, reference_from_platform(robot, modes(state), platform)


def motor_acceleration(robot: FiveBar, mode: WorkingMode, platform: Platform) -> list[float]:
    """The desired accelerations of both motors as second differences of the inverse geometry."""
    h = 1e-4
    rows = [
        inverse_geometry(
            robot,
            mode,
            platform.x + platform.vx * t + 0.5 * platform.ax * t * t,
            platform.y + platform.vy * t + 0.5 * platform.ay * t * t,
        )
        for t in (-h, 0.0, h)
    ]
    before, now, after = rows
    return [(wrap(after[joint] - now[joint]) - wrap(now[joint] - before[joint])) / h**2 for joint in (0, 2)]


def test_errors_of_the_motors_obey_the_chosen_equation(robot: FiveBar, regular_states: States) -> None:
    """qddot = qddot^d + Kd (qdot^d - qdot) + Kp (q^d - q) results when u1 acts on the exact model."""
    random = np.random.default_rng(50)
    for state in regular_states(100, 51):
        platform, reference = desired(robot, state, random)
        torque = ctc_torque(robot, state, reference, KP, KD)
        motion = direct_dynamics(robot, state, *torque, reference.f1, reference.f2)
        for found, feedforward, now, wanted in zip(
            (motion.ddq11, motion.ddq21),
            motor_acceleration(robot, modes(state), platform),
            (state.leg1, state.leg2),
            (reference.state.leg1, reference.state.leg2),
            strict=True,
        ):
            closed_loop = feedforward + KD * (wanted.dq1 - now.dq1) + KP * wrap(wanted.q1 - now.q1)
            assert found == pytest.approx(closed_loop, abs=1e-4 * (1.0 + abs(feedforward)))


def test_gains_act_exactly_as_written(robot: FiveBar, regular_states: States) -> None:
    """Without an approximation: the difference that each gain makes to the motors' accelerations."""
    random = np.random.default_rng(52)
    for state in regular_states(100, 53):
        _, reference = desired(robot, state, random)

        def accelerations(kp: float, kd: float, state: State = state, reference: Reference = reference) -> list[float]:
            torque = ctc_torque(robot, state, reference, kp, kd)
            return list(direct_dynamics(robot, state, *torque, reference.f1, reference.f2)[:2])

        pairs = ((state.leg1, reference.state.leg1), (state.leg2, reference.state.leg2))
        bare = accelerations(0.0, 0.0)
        scale = 1.0 + float(np.abs(bare).max())
        by_kp = np.subtract(accelerations(KP, 0.0), bare)
        by_kd = np.subtract(accelerations(0.0, KD), bare)
        np.testing.assert_allclose(by_kp, [KP * wrap(d.q1 - m.q1) for m, d in pairs], atol=1e-11 * scale)
        np.testing.assert_allclose(by_kd, [KD * (d.dq1 - m.dq1) for m, d in pairs], atol=1e-11 * scale)


def test_on_its_reference_the_platform_gets_the_reference_acceleration(robot: FiveBar, regular_states: States) -> None:
    for state in regular_states(50, 54):
        platform = Platform(state.x, state.y, state.vx, state.vy, 2.0, -1.5)
        reference = reference_from_platform(robot, modes(state), platform)
        torque = ctc_torque(robot, state, reference, KP, KD)
        motion = direct_dynamics(robot, state, *torque, reference.f1, reference.f2)
        assert (motion.ax, motion.ay) == pytest.approx((2.0, -1.5), abs=1e-8)


def test_the_reference_friction_is_that_of_the_reference_speed(dextar: FiveBar) -> None:
    reference = reference_from_platform(dextar, (1, -1), Platform(0.0, 0.13, 0.0, -0.5, 0.0, 0.0))
    signs = [math.copysign(1.0, leg.dq1) for leg in (reference.state.leg1, reference.state.leg2)]
    assert signs[0] != signs[1]
    assert (reference.f1, reference.f2) == pytest.approx((0.345 * signs[0] + 0.0855, 0.43 * signs[1]), abs=1e-12)
    assert (reference.ax, reference.ay) == (0.0, 0.0)


def test_an_error_across_the_half_turn_is_a_small_one(dextar: FiveBar) -> None:
    """q11 is near pi there: a measured angle on the other side must not look like a whole turn."""
    state = state_from_platform(dextar, (1, -1), -0.0672, 0.0395, 0.1, 0.1)
    reference = reference_from_platform(dextar, (1, -1), Platform(-0.0672, 0.0400, 0.1, 0.1, 0.0, 0.0))
    turn = 2.0 * math.pi
    leg1, leg2 = state.leg1, state.leg2
    wound = state_from_joints(
        dextar,
        leg1.q1 - turn,
        leg1.q2,
        leg2.q1 + turn,
        leg2.q2,
        leg1.dq1,
        leg1.dtheta - leg1.dq1,
        leg2.dq1,
        leg2.dtheta - leg2.dq1,
    )
    assert ctc_torque(dextar, wound, reference, KP, KD) == pytest.approx(
        ctc_torque(dextar, state, reference, KP, KD), rel=1e-9
    )


def test_the_torque_grows_without_bound_towards_the_locus_and_is_undefined_on_it(dextar: FiveBar) -> None:
    y = math.sqrt(0.0081 - 0.000961)
    reference = reference_from_platform(dextar, (1, -1), Platform(0.001, y, 0.0, -0.3, 0.0, 0.0))

    def peak(gap: float) -> float:
        state = state_from_platform(dextar, (1, -1), 0.0, y + gap, 0.0, -0.3)
        return max(map(abs, ctc_torque(dextar, state, reference, KP, KD)))

    # with the inverse of A once in xddot and once more in lambda
    for gap in (1e-6, 1e-7):
        assert peak(0.1 * gap) == pytest.approx(100.0 * peak(gap), rel=0.1)
    assert peak(1e-8) > 1e9
    exact = state_from_joints(dextar, 1.0, -1.0, 2.0, -2.0, 0.1, 0.0, 0.1, 0.0)
    assert all(math.isnan(torque) for torque in ctc_torque(dextar, exact, reference, KP, KD))
