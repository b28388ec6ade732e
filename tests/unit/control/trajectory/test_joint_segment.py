# SPDX-License-Identifier: Apache-2.0
"""Motions planned in the motors' angles: what they tell of platform and legs, at Type 1 too."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fivebar_control.laws.reference import reference_from_motors, reference_from_platform
from fivebar_control.model.dynamics import direct_dynamics
from fivebar_control.model.geometry import inverse_geometry
from fivebar_control.model.kinematics import (
    joint_acceleration,
    state_from_joints,
    state_from_motors,
    state_from_platform,
)
from fivebar_control.model.state import Platform
from fivebar_control.trajectory.desired import desired_at
from fivebar_control.trajectory.joint_segment import JointSegment
from fivebar_control.trajectory.planner import Plan, plan_motion
from fivebar_control.trajectory.time_scaling import rest_to_rest, rest_to_rest_without_jerk
from fivebar_control.trajectory.zones import ZoneRule
from fivebar_description.parameters import FiveBar, friction_torque

A, BEYOND = (0.0, 0.15), (0.03, 0.13)
BOUNDARY = (0.049, 0.144)
"""0.18 m from motor 1, in the ratio 3 : 4 : 5."""

MODES = ((1, -1), (-1, -1))


def plan_through(robot: FiveBar) -> Plan:
    return plan_motion(robot, (*MODES[0], *MODES[1]), (A, BEYOND), (1.0,), 500, ZoneRule())


def segment_of(plan: Plan) -> JointSegment:
    segment = plan.path.segments[0]
    assert isinstance(segment, JointSegment)
    return segment


def test_the_state_from_the_motors_is_the_one_from_the_platform(dextar: FiveBar) -> None:
    """Away from Type 1 both ways lead to the same state."""
    for mode in MODES:
        wanted = state_from_platform(dextar, mode, 0.01, 0.12, 0.2, -0.3)
        found = state_from_motors(dextar, 1, wanted.leg1.q1, wanted.leg2.q1, wanted.leg1.dq1, wanted.leg2.dq1)
        assert found[2:] == pytest.approx(wanted[2:], abs=1e-12)
        for leg, other in zip(found[:2], wanted[:2], strict=True):
            assert leg == pytest.approx(other, abs=1e-10)


def test_the_reference_is_its_own_derivative_through_type_1(dextar: FiveBar) -> None:
    """Velocity and acceleration against finite differences of the place, also where leg 1 is stretched."""
    plan = plan_through(dextar)
    h = 1e-4
    stretched = plan.meetings[0].time
    for t in (0.2, 0.4, stretched - 1e-3, stretched, stretched + 1e-3, 0.7, 0.9):
        before, now, after = (np.array(plan.path.at(t + step)) for step in (-h, 0.0, h))
        assert now[2:4] == pytest.approx((after[:2] - before[:2]) / (2.0 * h), abs=1e-6)
        assert now[4:6] == pytest.approx((after[2:4] - before[2:4]) / (2.0 * h), abs=1e-4)


def test_the_legs_are_the_joints_of_the_place(dextar: FiveBar) -> None:
    segment = segment_of(plan_through(dextar))
    for step in range(21):
        state = segment.state_at(0.05 * step)
        leg1, leg2 = state.leg1, state.leg2
        forward = state_from_joints(
            dextar,
            leg1.q1,
            leg1.q2,
            leg2.q1,
            leg2.q2,
            leg1.dq1,
            leg1.dtheta - leg1.dq1,
            leg2.dq1,
            leg2.dtheta - leg2.dq1,
        )
        assert forward[2:] == pytest.approx(state[2:], abs=1e-12)


def test_it_ends_in_the_postures_of_both_working_modes(dextar: FiveBar) -> None:
    plan = plan_through(dextar)
    segment = segment_of(plan)
    for t, mode, place in ((0.0, MODES[0], A), (1.0, MODES[1], BEYOND)):
        q = inverse_geometry(dextar, mode, *place)
        motors = segment.motors_at(t)
        assert math.remainder(motors.q11 - q.q11, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-12)
        assert math.remainder(motors.q21 - q.q21, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-12)
        assert motors[2:] == (0.0, 0.0, 0.0, 0.0)
        assert plan.mode_at(t) == mode


def test_its_torque_is_what_the_motion_takes(dextar: FiveBar) -> None:
    """The direct model under the reference's torque accelerates as planned, also at Type 1."""
    plan = plan_through(dextar)
    segment = segment_of(plan)
    for t in (0.3, plan.meetings[0].time, 0.8):
        platform, motors = plan.path.at(t), segment.motors_at(t)
        reference = desired_at(dextar, plan, t, platform)
        motion = direct_dynamics(dextar, reference.state, reference.u1, reference.u2, 0.0, 0.0)
        assert (motion.ddq11, motion.ddq21) == pytest.approx((motors.ddq11, motors.ddq21), abs=1e-8)
        assert (motion.ax, motion.ay) == pytest.approx((platform.ax, platform.ay), abs=1e-9)
        assert reference.f1 == friction_torque(dextar.leg1, motors.dq11)
        assert reference.by_motors


def test_a_reference_that_has_left_the_plan_stands_still(dextar: FiveBar) -> None:
    """A held reference must not pull the motors along the plan."""
    plan = plan_through(dextar)
    held = Platform(0.02, 0.14, 0.0, 0.0, 0.0, 0.0)
    reference = desired_at(dextar, plan, 0.5, held)
    assert (reference.state.x, reference.state.y, reference.state.vx, reference.state.vy) == held[:4]
    assert (reference.by_motors, reference.u1, reference.u2, reference.ax, reference.ay) == (False, 0.0, 0.0, 0.0, 0.0)
    assert (reference.f1, reference.f2) == (dextar.leg1.offset, dextar.leg2.offset)


def test_on_straight_segments_the_reference_is_that_of_the_platform(dextar: FiveBar) -> None:
    waypoints, modes = (A, BEYOND, (0.03, 0.1)), (*MODES[0], *MODES[1], *MODES[1])
    plan = plan_motion(dextar, modes, waypoints, (1.0, 1.0), 500, ZoneRule())
    platform = plan.path.at(1.3)
    assert desired_at(dextar, plan, 1.3, platform) == reference_from_platform(dextar, MODES[1], platform)


def test_where_the_distal_links_cannot_meet_there_is_no_place(dextar: FiveBar) -> None:
    state = state_from_motors(dextar, 1, math.pi, 0.0, 0.0, 0.0)
    assert all(math.isnan(value) for value in state[2:])
    reference = reference_from_motors(dextar, state, 0.0, 0.0, 0.0, 0.0)
    assert math.isnan(reference.u1)


def test_a_straight_way_to_the_boundary_needs_the_seventh_order(dextar: FiveBar) -> None:
    """The motor's angle goes with the root of the distance: of (1 - u)^3 it has no bounded acceleration, of (1 - u)^4
    it has. Planned in the motors' angles there is no root."""

    def acceleration(law: object, rest: float) -> float:
        s, ds, dds = law(1.0 - rest)  # type: ignore[operator]
        dx, dy = BOUNDARY[0] - A[0], BOUNDARY[1] - A[1]
        state = state_from_platform(dextar, MODES[0], A[0] + dx * s, A[1] + dy * s, dx * ds, dy * ds)
        return abs(joint_acceleration(state.leg1, dx * dds, dy * dds))

    for law, grows in ((rest_to_rest, True), (rest_to_rest_without_jerk, False)):
        far, near = acceleration(law, 1e-2), acceleration(law, 1e-3)
        # ten times nearer: by the root of ten
        assert near / far == pytest.approx(math.sqrt(10.0) if grows else 1.0, rel=0.1)

    plan = plan_motion(dextar, MODES[0] * 2, (A, BOUNDARY), (1.0,), 500, ZoneRule())
    segment = segment_of(plan)
    largest = max(abs(segment.motors_at(step / 100.0).ddq11) for step in range(101))
    assert largest < 10.0
    assert abs(segment.state_at(1.0).leg1.sin_q2) < 1e-8
