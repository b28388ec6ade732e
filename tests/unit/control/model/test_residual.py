# SPDX-License-Identifier: Apache-2.0
"""Residual inertias of the distal links against Pinocchio, whose bodies are the links themselves."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from fivebar_control.estimation.platform_motion import Applied, platform_acceleration
from fivebar_control.identification.regressor import platform_load
from fivebar_control.laws.resolution import Enforced, resolved
from fivebar_control.laws.torque import ZERO
from fivebar_control.laws.unified import input_map
from fivebar_control.model.dynamics import (
    direct_dynamics,
    direct_dynamics_of_platform,
    inverse_dynamics,
    inverse_dynamics_of_platform,
    platform_model,
)
from fivebar_control.model.kinematics import (
    assembly_mode,
    distal_acceleration_by_motor,
    elbow_side,
    joint_acceleration,
    leg_from_joints,
    leg_from_platform,
    state_from_platform,
    working_mode,
)
from fivebar_control.model.kinematics import platform_acceleration as platform_acceleration_of_motors
from fivebar_control.model.singularity import parallel_svd
from fivebar_control.model.state import MotorMotion, Platform, State
from fivebar_control.trajectory.criterion import criterion_residual
from fivebar_control.trajectory.planner import plan_motion
from fivebar_control.trajectory.zones import ZoneSettings
from fivebar_description.closed_loop import ClosedLoop
from fivebar_description.parameters import FiveBar, has_residual
from fivebar_description.robot_file import (
    DistalLink,
    DistalLinks,
    EndEffector,
    Friction,
    Lengths,
    Links,
    ProximalLink,
    ProximalLinks,
    RobotFile,
    load_robot,
)

Vector = NDArray[np.float64]

TOLERANCE = 1e-12
"""Of the largest term. What it leaves is 25 times the largest difference in 2000 cases of each kind, 4e-14."""


class Case(NamedTuple):
    """A robot of rigid links at a posture in motion, and torques of its motors (Nm)."""

    file: RobotFile
    robot: FiveBar
    state: State
    torques: tuple[float, float]


def rigid(draw: st.DrawFn, length: float) -> tuple[float, float, float]:
    """Mass, centre and inertia of a link: the inertia at will, of a point or of a dumb-bell longer than the link."""
    mass, centre = draw(st.floats(0.1, 1.0)), draw(st.floats(0.2, 0.8)) * length
    return mass, centre, mass * length**2 * draw(st.floats(0.02, 0.6))


@st.composite
def cases(draw: st.DrawFn, where: str) -> Case:
    """A posture at will, regular or at a singularity; bases and l_21 are such that the loop closes there."""
    l_11, l_12, l_22 = (draw(st.floats(0.06, 0.12)) for _ in range(3))
    q11 = draw(st.floats(0.3, 2.8))
    q12 = draw(st.sampled_from((-1, 1))) * draw(st.floats(0.5, 2.6)) if where != "type 1" else 0.0
    theta1 = q11 + q12
    between = draw(st.sampled_from((0.0, math.pi))) if where == "type 2" else draw(st.floats(0.4, 2.7))
    theta2 = theta1 + between
    x, y = l_11 * math.cos(q11) + l_12 * math.cos(theta1), l_11 * math.sin(q11) + l_12 * math.sin(theta1)
    elbow_x, elbow_y = x - l_22 * math.cos(theta2), y - l_22 * math.sin(theta2)
    l_21 = max(draw(st.floats(0.06, 0.12)), 1.1 * abs(elbow_y))
    q21 = math.asin(elbow_y / l_21)
    q22 = theta2 - q21
    assume(abs(math.sin(q22)) > 0.3)
    base = elbow_x - l_21 * math.cos(q21)
    near = [ProximalLink(mass_kg=m, centre_m=c, inertia_kg_m2=i) for m, c, i in (rigid(draw, l_11), rigid(draw, l_21))]
    far = [DistalLink(mass_kg=m, centre_m=c, inertia_kg_m2=i) for m, c, i in (rigid(draw, l_12), rigid(draw, l_22))]
    file = RobotFile(
        name="drawn",
        lengths_m=Lengths(a=1.0, l_11=l_11, l_12=l_12, l_21=l_21, l_22=l_22),
        proximal_links=ProximalLinks(leg_1=near[0], leg_2=near[1]),
        distal_links=DistalLinks(leg_1=far[0], leg_2=far[1]),
        end_effector=EndEffector(mass_kg=draw(st.floats(0.0, 0.5)), inertia_kg_m2=draw(st.floats(0.0, 1e-3))),
        friction=Friction(f_s11=0.0, f_s21=0.0, f_off11=0.0, f_off21=0.0, width_rad_s=0.02),
    )
    grouped = file.five_bar()
    robot = grouped._replace(leg1=grouped.leg1._replace(base_x=0.0), leg2=grouped.leg2._replace(base_x=base))
    rates = draw(st.floats(-3.0, 3.0)), draw(st.floats(-3.0, 3.0))
    leg1 = leg_from_joints(robot.leg1, q11, q12, rates[0], rates[1])
    vx = -l_11 * leg1.dq1 * leg1.r_y - l_12 * leg1.dtheta * leg1.u_y
    vy = l_11 * leg1.dq1 * leg1.r_x + l_12 * leg1.dtheta * leg1.u_x
    state = State(leg1, leg_from_platform(robot.leg2, q21, q22, vx, vy), x, y, vx, vy)
    return Case(file, robot, state, (draw(st.floats(-1.0, 1.0)), draw(st.floats(-1.0, 1.0))))


class Bodies:
    """Pinocchio's tree of a case, from the links and not from the grouped parameters."""

    def __init__(self, case: Case) -> None:
        self.model: Any = pin.Model()
        self.model.gravity.setZero()
        links = case.file.weighed()
        assert isinstance(links, Links)
        self.tips = []
        pairs = (links.proximal.leg_1, links.distal.leg_1), (links.proximal.leg_2, links.distal.leg_2)
        for number, (leg, (near, far)) in enumerate(zip(case.robot[:2], pairs, strict=True), start=1):
            first = self._joint(0, leg.base_x, f"q{number}1")
            second = self._joint(first, leg.proximal, f"q{number}2")
            self._add(first, near.mass_kg, near.centre_m, near.inertia_kg_m2)
            self._add(second, far.mass_kg, far.centre_m, far.inertia_kg_m2)
            end = pin.SE3(np.eye(3), np.array([leg.distal, 0.0, 0.0]))
            self.tips.append(self.model.addFrame(pin.Frame(f"tip_{number}", second, end, pin.FrameType.OP_FRAME)))
        self._add(4, links.effector.mass_kg, case.robot.leg2.distal, links.effector.inertia_kg_m2)
        self.data: Any = self.model.createData()

    def _joint(self, parent: int, at_x: float, name: str) -> int:
        place = pin.SE3(np.eye(3), np.array([at_x, 0.0, 0.0]))
        return int(self.model.addJoint(parent, pin.JointModelRZ(), place, name))

    def _add(self, joint: int, mass: float, centre: float, inertia: float) -> None:
        body = pin.Inertia(mass, np.array([centre, 0.0, 0.0]), np.diag([0.0, 0.0, inertia]))
        self.model.appendBodyToJoint(joint, body, pin.SE3.Identity())

    def gap(self, q: Vector) -> Vector:
        """Return the Jacobian of the vector between the tips."""
        pin.computeJointJacobians(self.model, self.data, q)
        pin.updateFramePlacements(self.model, self.data)
        frame = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        one, two = (pin.getFrameJacobian(self.model, self.data, tip, frame)[:2] for tip in self.tips)
        return np.asarray(one - two)


def vectors(state: State) -> tuple[Vector, Vector]:
    one, two = state.leg1, state.leg2
    q = np.array([one.q1, one.q2, two.q1, two.q2])
    return q, np.array([one.dq1, one.dtheta - one.dq1, two.dq1, two.dtheta - two.dq1])


def joint_accelerations(case: Case, ddq11: float, ddq21: float, ax: float, ay: float) -> Vector:
    robot, state = case.robot, case.state
    ddtheta1 = distal_acceleration_by_motor(robot.leg1, state.leg1, ddq11, ax, ay)
    ddtheta2 = distal_acceleration_by_motor(robot.leg2, state.leg2, ddq21, ax, ay)
    return np.array([ddq11, ddtheta1 - ddq11, ddq21, ddtheta2 - ddq21])


@pytest.mark.parametrize("where", ["regular", "type 1", "type 2"])
@given(data=st.data())
@settings(max_examples=40)
def test_the_motion_under_torques_is_that_of_the_links(where: str, data: st.DataObject) -> None:
    """Newton and Euler's torques of the motion are those of the motors and of a force between the tips, no others."""
    case = data.draw(cases(where))
    motion = direct_dynamics(case.robot, case.state, *case.torques, 0.0, 0.0)
    bodies, (q, v) = Bodies(case), vectors(case.state)
    a = joint_accelerations(case, motion.ddq11, motion.ddq21, motion.ax, motion.ay)
    gap = bodies.gap(q)
    turning = pin.rnea(bodies.model, bodies.data, q, v, a)
    size = np.abs(pin.crba(bodies.model, bodies.data, q)).max() * (np.abs(a).max() + np.abs(v).max() ** 2)
    left = turning - np.array([case.torques[0], 0.0, case.torques[1], 0.0])
    force = np.linalg.lstsq(gap.T, left, rcond=1e-9)[0]
    np.testing.assert_allclose(left - gap.T @ force, 0.0, atol=TOLERANCE * size)
    # the tolerance of subnormal speeds is zero
    np.testing.assert_allclose(gap @ v, 0.0, atol=TOLERANCE * np.abs(v).max() + np.finfo(float).tiny)
    drift = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    pin.forwardKinematics(bodies.model, bodies.data, q, v, a)
    one, two = (
        pin.getFrameClassicalAcceleration(bodies.model, bodies.data, tip, drift).linear[:2] for tip in bodies.tips
    )
    np.testing.assert_allclose(one, two, atol=TOLERANCE * (np.abs(a).max() + np.abs(v).max() ** 2))
    np.testing.assert_allclose(one, [motion.ax, motion.ay], atol=TOLERANCE * (np.abs(a).max() + np.abs(v).max() ** 2))


@given(case=cases("regular"))
@settings(max_examples=40)
def test_torques_for_a_motion_are_those_of_the_links(case: Case) -> None:
    robot, state, (ddq11, ddq21) = case.robot, case.state, (40.0 * case.torques[0], 40.0 * case.torques[1])
    bodies, (q, v) = Bodies(case), vectors(state)
    ax, ay = platform_acceleration_of_motors(state, ddq11, ddq21)
    a = joint_accelerations(case, ddq11, ddq21, ax, ay)
    gap = bodies.gap(q)
    turning = pin.rnea(bodies.model, bodies.data, q, v, a)
    force = np.linalg.solve(gap[:, [1, 3]].T, turning[[1, 3]])
    wanted = turning[[0, 2]] - gap[:, [0, 2]].T @ force
    size = np.abs(turning).max() + np.abs(gap[:, [0, 2]].T @ force).max()
    near = 10.0 / abs(math.sin(state.leg2.q1 + state.leg2.q2 - state.leg1.q1 - state.leg1.q2))
    found = inverse_dynamics(robot, state, ddq11, ddq21, 0.0, 0.0)
    np.testing.assert_allclose(found, wanted, atol=TOLERANCE * near * size)
    found = inverse_dynamics_of_platform(robot, state, ax, ay, 0.0, 0.0)
    np.testing.assert_allclose(found, wanted, atol=TOLERANCE * near * size)


@pytest.mark.parametrize("where", ["regular", "type 2"])
@given(data=st.data())
@settings(max_examples=30)
def test_all_forms_of_the_model_agree(where: str, data: st.DataObject) -> None:
    """The platform form and the estimator's, and the law's map of torques, at Type 2 as elsewhere."""
    case = data.draw(cases(where))
    robot, state, (tau1, tau2) = case.robot, case.state, case.torques
    wanted = direct_dynamics(robot, state, tau1, tau2, 0.0, 0.0)
    size = abs(wanted.ax) + abs(wanted.ay) + max(abs(state.leg1.c), abs(state.leg2.c))
    form = direct_dynamics_of_platform(robot, state, tau1, tau2, 0.0, 0.0)
    np.testing.assert_allclose(form, wanted[2:4], atol=TOLERANCE * size)
    mapped = input_map(robot, state)
    assert mapped is not None
    law = mapped.g_x1 * tau1 + mapped.g_x2 * tau2 + mapped.a0_x, mapped.g_y1 * tau1 + mapped.g_y2 * tau2 + mapped.a0_y
    np.testing.assert_allclose(law, wanted[2:4], atol=TOLERANCE * size)
    place = working_mode(state), state.x, state.y, state.vx, state.vy
    filtered = platform_acceleration(robot, *place, Applied(tau1, tau2, 0.0, 0.0))
    np.testing.assert_allclose(filtered, wanted[2:4], atol=TOLERANCE * size)


@pytest.mark.parametrize("where", [(0.01, 0.09), (0.0, 0.0331662479035540)])
def test_the_plant_of_the_bench_has_its_residual_inertias(where: tuple[float, float]) -> None:
    """Pinocchio's plant is made from the grouped parameters: masses at the tips, with inertias that are negative."""
    robot = load_robot("motkin")
    state = state_from_platform(robot, (1, -1), *where, 0.1, -0.2)
    q, v = vectors(state)
    a = ClosedLoop(robot).acceleration(q, v, np.array([0.01, 0.0, -0.02, 0.0]))
    motion = direct_dynamics(robot, state, 0.01, -0.02, 0.0, 0.0)
    np.testing.assert_allclose([motion.ddq11, motion.ddq21], a[[0, 2]], atol=TOLERANCE * np.abs(a).max())
    still = FiveBar(robot.leg1._replace(residual=0.0), robot.leg2._replace(residual=0.0), robot.mass)
    without = direct_dynamics(still, state, 0.01, -0.02, 0.0, 0.0)
    assert abs(motion.ddq11 - without.ddq11) > 0.01 * abs(motion.ddq11)


@pytest.mark.parametrize("resolution", range(3))
@given(case=cases("type 2"), alpha=st.floats(-5.0, 5.0))
@settings(max_examples=20)
def test_constraint_laws_get_the_acceleration_along_v1(resolution: int, case: Case, alpha: float) -> None:
    """No torque acts along t_s, where the platform's balance alone gives the acceleration beta."""
    robot, state = case.robot, case.state
    svd, model = parallel_svd(state), platform_model(robot, state)
    v, t = np.array([svd.v_x, svd.v_y]), np.array([svd.t_x, svd.t_y])
    mass = np.array([[model.m_xx, model.m_xy], [model.m_xy, model.m_yy]])
    beta = float(-(t @ (model.h_x, model.h_y) + alpha * t @ mass @ v) / (t @ mass @ t))
    ddq11, ddq21 = (joint_acceleration(leg, *(alpha * v + beta * t).tolist()) for leg in state[:2])
    torque = resolved(resolution, robot, state, svd, Enforced(alpha, ddq11, ddq21, beta), ZERO)
    motion = direct_dynamics(robot, state, torque.tau1, torque.tau2, 0.0, 0.0)
    size = abs(alpha) + abs(beta) + max(abs(state.leg1.c), abs(state.leg2.c))
    np.testing.assert_allclose(v @ (motion.ax, motion.ay), alpha, atol=TOLERANCE * size)
    np.testing.assert_allclose(t @ (motion.ax, motion.ay), beta, atol=TOLERANCE * size)
    # and so the criterion says
    place = Platform(state.x, state.y, state.vx, state.vy, *(alpha * v + beta * t).tolist())
    modes = elbow_side(state.leg1.sin_q2), elbow_side(state.leg2.sin_q2)
    assert abs(criterion_residual(robot, modes, place)) <= TOLERANCE * robot.mass * size


@pytest.mark.parametrize("inertias", [(0.0, 0.0), (1e-6, 0.0), (0.0, -1e-6), (1e-6, -1e-6)])
def test_one_residual_inertia_is_enough_to_have_some(inertias: tuple[float, float]) -> None:
    legs = (leg._replace(residual=one) for leg, one in zip(load_robot("motkin")[:2], inertias, strict=True))
    assert has_residual(FiveBar(*legs, 0.01)) == any(inertias)


def test_a_time_law_meets_the_criterion_with_residual_inertias() -> None:
    robot = load_robot("motkin")
    waypoints = ((0.004, 0.11), (-0.003, 0.002))
    plan = plan_motion(robot, (1, -1), waypoints, (0.6,), 500, ZoneSettings().as_rule(), "criterion")
    (crossing,) = plan.crossings
    motion = plan.path.at(crossing.time)
    assert math.hypot(motion.ax, motion.ay) > 0.05
    scale = robot.mass * math.hypot(motion.ax, motion.ay)
    assert abs(criterion_residual(robot, (1, -1), motion)) < 1e-6 * scale


def test_a_motors_share_of_residual_inertias_is_not_identified_but_taken_off() -> None:
    robot = load_robot("motkin")
    state = state_from_platform(robot, (1, -1), 0.02, 0.09, 0.3, -0.2)
    motion = MotorMotion(state.leg1.q1, state.leg2.q1, state.leg1.dq1, state.leg2.dq1, 20.0, -35.0)
    load = platform_load(robot, assembly_mode(state), motion)
    torques = inverse_dynamics(robot, state, 20.0, -35.0, 0.0, 0.0)
    assert load.known1 != 0.0
    assert robot.leg1.inertia * 20.0 + robot.mass * load.load1 + load.known1 == pytest.approx(torques[0], rel=TOLERANCE)
    assert robot.leg2.inertia * -35.0 + robot.mass * load.load2 + load.known2 == pytest.approx(
        torques[1], rel=TOLERANCE
    )
