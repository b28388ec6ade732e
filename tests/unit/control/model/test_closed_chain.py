# SPDX-License-Identifier: Apache-2.0
"""Section 1.2 for any planar closed chain, on three robots: DexTAR, the unequal five-bar and a planar 3-RRR.

The other side is, by turns, the analytic five-bar, finite differences along a motion, Lagrange's equations by finite
differences, and Pinocchio with the platform as one more body and the tips held by contact constraints.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
import three_rrr
from closed_chain.chain import ChainError, ChainPlatform, ClosedChain, LinkInertia, Tip
from closed_chain.dynamics import (
    driven_wrench,
    input_efforts_from_multipliers,
    inverse_dynamics,
    lambda_2,
    platform_wrench,
    tree_efforts,
)
from closed_chain.five_bar import five_bar_chain
from closed_chain.kinematics import (
    ChainMotion,
    closure_gap,
    drift,
    jacobians,
    motion_from_active,
    motion_from_platform,
    passive_velocity,
    platform_pose,
    platform_rows,
)
from numpy.typing import NDArray
from three_rrr import EXAMPLE, three_rrr_chain

from fivebar_control.model.dynamics import inverse_dynamics as five_bar_torque
from fivebar_control.model.dynamics import multipliers
from fivebar_control.model.geometry import inverse_geometry as five_bar_angles
from fivebar_control.model.kinematics import platform_acceleration
from fivebar_control.model.singularity import parallel_svd
from fivebar_control.model.state import State
from fivebar_description.closed_loop import ClosedLoop
from fivebar_description.parameters import FiveBar
from fivebar_description.robot_file import load_robot

pytestmark = pytest.mark.extra
"""The general equations of the thesis' first chapter, on which nothing stands but one figure."""

Vector = NDArray[np.float64]
States = Callable[[int, int], list[State]]
Vectors = Callable[[State], tuple[Vector, Vector]]
Matrices = Callable[[State], tuple[Vector, Vector]]

DISTAL = (LinkInertia(0.14, 0.05, 2.1e-4), LinkInertia(0.11, 0.04, 1.7e-4))
"""Distal links with an inertia of their own, centre of mass inside the link."""

MOTORS = ("q11", "q21", "q31")

GRAVITY = np.array([1.3, -9.4, 0.0])
"""Gravity in the plane, m/s^2: the robots hung up."""


@dataclass(frozen=True)
class Case:
    """One robot: its chain, the joint angles for a pose, and the box that poses are drawn from."""

    chain: ClosedChain
    angles: Callable[[Vector], Vector]
    low: tuple[float, ...]
    high: tuple[float, ...]

    def motions(self, count: int, seed: int) -> Iterator[ChainMotion]:
        """Random motions away from singularities, no joint faster than 5 rad/s: smooth enough to be differenced."""
        random = np.random.default_rng(seed)
        found = 0
        while found < count:
            pose = random.uniform(self.low, self.high)
            q = self.angles(pose)
            n = len(pose)
            twist, change = random.uniform(-1.0, 1.0, n), random.uniform(-5.0, 5.0, n)
            if np.isnan(q).any():
                continue
            matrices = jacobians(self.chain, q)
            if abs(np.linalg.det(matrices.a)) < 0.02 or np.abs(np.diag(matrices.b)).min() < 0.02:
                continue
            found += 1
            speed = np.abs(motion_from_platform(self.chain, q, twist, change).v).max()
            yield motion_from_platform(self.chain, q, min(1.0, 5.0 / speed) * twist, change)


def five_bar_case(name: str, distal: tuple[LinkInertia, LinkInertia] | None, modes: tuple[int, int]) -> Case:
    robot = load_robot(name)
    return Case(
        five_bar_chain(robot, distal),
        lambda pose: np.array(five_bar_angles(robot, modes, *pose.tolist())),
        (-0.1, 0.03),
        (0.1, 0.17),
    )


def rrr_case(welded: bool) -> Case:
    def angles(pose: Vector) -> Vector:
        legs = three_rrr.inverse_geometry(EXAMPLE, (1, -1, 1), pose).reshape(3, 2)
        return np.column_stack((legs, pose[2] - legs.sum(axis=1))).ravel() if welded else legs.ravel()

    return Case(three_rrr_chain(EXAMPLE, welded), angles, (-0.12, -0.12, -0.8), (0.12, 0.12, 0.8))


def hung_up(case: Case) -> Case:
    case.chain.tree.gravity.linear = GRAVITY
    return case


CASES: dict[str, Callable[[], Case]] = {
    "dextar": lambda: five_bar_case("dextar", None, (1, -1)),
    "dextar, distal inertia": lambda: five_bar_case("dextar", DISTAL, (1, -1)),
    "unequal": lambda: five_bar_case("unequal", None, (-1, -1)),
    "unequal, distal inertia": lambda: five_bar_case("unequal", DISTAL, (1, -1)),
    "unequal, distal inertia, hung up": lambda: hung_up(five_bar_case("unequal", DISTAL, (1, 1))),
    "3-RRR": lambda: rrr_case(False),
    "3-RRR, tips welded": lambda: rrr_case(True),
    "3-RRR, hung up": lambda: hung_up(rrr_case(False)),
}


@pytest.fixture(scope="module", params=list(CASES))
def case(request: pytest.FixtureRequest) -> Case:
    return CASES[request.param]()


@pytest.fixture(scope="module", params=["3-RRR", "3-RRR, tips welded"])
def rrr(request: pytest.FixtureRequest) -> Case:
    return CASES[request.param]()


def close_to(found: Vector, wanted: Vector, relative: float = 1e-12) -> None:
    """Equal within `relative` times the largest component."""
    assert found.shape == wanted.shape
    np.testing.assert_allclose(found, wanted, rtol=0.0, atol=relative * np.abs(wanted).max(initial=0.0))


def slope(function: Callable[[float], Vector], h: float = 1e-4) -> Vector:
    """Derivative at 0 by six points, error of order h^6."""
    parts = [w * (function(k * h) - function(-k * h)) for k, w in ((1, 45.0), (2, -9.0), (3, 1.0))]
    return np.asarray(sum(parts) / (60.0 * h))


def near(angles: Vector, others: Vector) -> Vector:
    """The angles in the turn that is nearest to the others'."""
    return angles - 2.0 * math.pi * np.round((angles - others) / (2.0 * math.pi))


def along(case: Case, motion: ChainMotion) -> Callable[[float], ChainMotion]:
    """The motion's neighbours in time, on a pose that is quadratic in time; angles from the inverse geometry."""

    def at(time: float) -> ChainMotion:
        pose = motion.pose + time * motion.t + 0.5 * time * time * motion.dt
        q = near(case.angles(pose), motion.q)
        return motion_from_platform(case.chain, q, motion.t + time * motion.dt, motion.dt)

    return at


# ---- the five-bar: against the analytic model -----------------------------------------------------------------------


def test_five_bars_a_and_b_are_the_analytic_ones(
    robot: FiveBar, regular_states: States, joint_vectors: Vectors, matrices: Matrices
) -> None:
    """A has the rows u_i and B is diag(l_i1 sin q_i2), signs included: the convention A t = B qdot_a."""
    chain = five_bar_chain(robot)
    for state in regular_states(200, 1):
        found = jacobians(chain, joint_vectors(state)[0])
        a, b = matrices(state)
        close_to(found.a, a)
        close_to(found.b, b)
        close_to(found.a @ np.array([state.vx, state.vy]), found.b @ np.array([state.leg1.dq1, state.leg2.dq1]))


def test_five_bars_c_is_the_analytic_one(robot: FiveBar, regular_states: States, joint_vectors: Vectors) -> None:
    chain = five_bar_chain(robot)
    for state in regular_states(200, 2):
        q, v = joint_vectors(state)
        terms = drift(chain, jacobians(chain, q), q, v, np.array([state.vx, state.vy]))
        close_to(terms.c, np.array([state.leg1.c, state.leg2.c]))


def test_five_bars_motion_is_the_analytic_one(robot: FiveBar, regular_states: States, joint_vectors: Vectors) -> None:
    chain = five_bar_chain(robot)
    random = np.random.default_rng(3)
    for state in regular_states(200, 3):
        q, v = joint_vectors(state)
        bend = random.uniform(-30.0, 30.0, 2)
        motion = motion_from_active(chain, q, v[chain.active], bend)
        close_to(motion.pose, np.array([state.x, state.y]))
        close_to(motion.t, np.array([state.vx, state.vy]))
        close_to(motion.v, v)
        close_to(motion.dt, np.array(platform_acceleration(state, *bend.tolist())))


def test_five_bars_torque_and_multipliers_are_the_analytic_ones(
    robot: FiveBar, regular_states: States, joint_vectors: Vectors
) -> None:
    """1.15 becomes 1.30 (without f), 1.14 becomes 1.31; the distal links carry nothing, so tau_td = lambda_2 = 0."""
    chain = five_bar_chain(robot)
    random = np.random.default_rng(4)
    for state in regular_states(400, 4):
        q, v = joint_vectors(state)
        bend = random.uniform(-30.0, 30.0, 2)
        motion = motion_from_active(chain, q, v[chain.active], bend)
        efforts = inverse_dynamics(chain, motion)
        acceleration = platform_acceleration(state, *bend.tolist())
        close_to(efforts.tau, np.array(five_bar_torque(robot, state, *bend.tolist(), 0.0, 0.0)))
        close_to(efforts.lambda_1, np.array(multipliers(robot, state, *acceleration)))
        close_to(efforts.w_p, robot.mass * np.array(acceleration))
        close_to(efforts.tau_ta, np.array([robot.leg1.inertia, robot.leg2.inertia]) * bend)
        assert not efforts.tau_td.any()
        assert not efforts.lambda_2.any()


def test_the_motion_asked_of_the_platform_is_regular_on_the_type_2_locus(
    robot: FiveBar, locus_states: States, joint_vectors: Vectors
) -> None:
    chain = five_bar_chain(robot)
    for state in locus_states(20, 5):
        q, v = joint_vectors(state)
        motion = motion_from_platform(chain, q, np.array([state.vx, state.vy]), np.array([0.7, -0.4]))
        close_to(motion.v, v)
        assert np.isfinite(motion.a).all()


def test_the_dynamic_criterion_holds_the_legs_inertia_too(
    robot: FiveBar, locus_states: States, joint_vectors: Vectors
) -> None:
    """1.19 in general: t_s^T (w_p + J_t^T lambda_2) = 0 with t_s in the kernel of A keeps lambda_1 finite.

    t_s^T w_p = 0, as printed, is that only when tau_td = 0; and t_s in the kernel of A^T is another vector.
    """
    chain, other = five_bar_chain(robot, DISTAL), list[float]()
    for state in locus_states(12, 6):
        q, _ = joint_vectors(state)
        svd = parallel_svd(state)
        kernel, along_links = np.array([svd.t_x, svd.t_y]), np.array([svd.v_x, svd.v_y])
        matrices, t = jacobians(chain, q), np.array([state.vx, state.vy])
        assert np.abs(matrices.a @ kernel).max() < 1e-12
        other.append(float(np.abs(matrices.a.T @ kernel).max()))

        def load(dt: Vector, q: Vector = q, t: Vector = t, matrices: Any = matrices) -> tuple[Vector, Vector]:
            motion = motion_from_platform(chain, q, t, dt)
            w_p = platform_wrench(chain, motion)
            return w_p, driven_wrench(matrices, w_p, tree_efforts(chain, motion).passive)

        start, step = 0.3 * along_links, 1.0 * kernel
        base, more = (kernel @ load(dt)[1] for dt in (start, start + step))
        dt = start - base / (more - base) * step  # the load is affine in dt
        w_p, driven = load(dt)
        assert abs(kernel @ driven) < 1e-12
        assert abs(kernel @ w_p) > 1e-6
        # a multiplier exists that balances the platform (1.8) although A^T has lost rank
        found = np.linalg.lstsq(matrices.a.T, driven, rcond=1e-6)[0]
        close_to(matrices.a.T @ found, driven, 1e-12)
    assert max(other) > 0.1


# ---- all robots: kinematics -----------------------------------------------------------------------------------------


def test_pose_and_closure(case: Case) -> None:
    for motion in case.motions(50, 10):
        pose = platform_pose(case.chain, motion.q)
        close_to(near(case.angles(pose), motion.q), motion.q, 1e-13)
        assert np.abs(closure_gap(case.chain, motion.q, pose)).max() < 1e-14


def test_gap_is_what_the_loop_is_open_by(rrr: Case) -> None:
    for motion in rrr.motions(10, 11):
        off = motion.pose + np.array([1e-3, -2e-3, 0.0])
        size = len(rrr.chain.legs[0].rows)
        wanted = np.tile([-1e-3, 2e-3, 0.0][:size], 3)
        np.testing.assert_allclose(closure_gap(rrr.chain, motion.q, off), wanted, atol=1e-15)


def test_platforms_rows_are_the_derivatives_of_its_points(rrr: Case) -> None:
    """1.2 and 1.3: the block of 1.3 is minus the cross product matrix of r_PA."""
    for motion in rrr.motions(20, 12):
        for leg in rrr.chain.legs:

            def point(time: float, leg: Any = leg, motion: ChainMotion = motion) -> Vector:
                x, y, phi = motion.pose + time * motion.t
                arm_x, arm_y = rrr.chain.arm(leg.tip.attachment, phi)
                return np.array([x + arm_x, y + arm_y, phi])[: len(leg.rows)]

            close_to(platform_rows(rrr.chain, leg, motion.pose[2]) @ motion.t, slope(point), 1e-11)


def test_a_t_is_b_qdot_by_finite_differences(case: Case) -> None:
    """1.1 in this project's sign, its velocities from the geometry alone."""
    for motion in case.motions(40, 13):
        dq_a = slope(lambda time, m=motion: near(case.angles(m.pose + time * m.t), m.q)[case.chain.active])
        matrices = jacobians(case.chain, motion.q)
        left, right = matrices.a @ motion.t, matrices.b @ dq_a
        close_to(left, right, 1e-10)
        assert np.abs(left + right).max() > 1e-3  # 1.1 as printed


def test_joint_velocities_and_accelerations_by_finite_differences(case: Case) -> None:
    """Active ones from 1.1, passive ones from 1.6, and the derivatives of both."""
    for motion in case.motions(40, 14):
        neighbour = along(case, motion)
        close_to(motion.v, slope(lambda time, at=neighbour: at(time).q), 1e-9)
        close_to(motion.a, slope(lambda time, at=neighbour: at(time).v), 1e-9)


def test_both_ways_into_a_motion_agree(case: Case) -> None:
    for motion in case.motions(100, 15):
        active = case.chain.active
        again = motion_from_active(case.chain, motion.q, motion.v[active], motion.a[active])
        for found, wanted in zip(again, motion, strict=True):
            close_to(found, wanted, 1e-12)


def test_j_and_j_d_give_the_twist_and_the_passive_velocities(case: Case) -> None:
    for motion in case.motions(100, 16):
        matrices = jacobians(case.chain, motion.q)
        dq_a, dq_d = motion.v[case.chain.active], motion.v[case.chain.passive]
        close_to(matrices.j @ dq_a, motion.t, 1e-12)
        close_to(matrices.j_d @ dq_a, dq_d, 1e-12)
        close_to(matrices.j_t @ motion.t - matrices.j_ta @ dq_a, matrices.j_td @ dq_d, 1e-12)
        close_to(passive_velocity(matrices, motion.t, dq_a), dq_d, 1e-12)


def test_bases_are_orthonormal_and_take_the_passive_velocities_out(case: Case) -> None:
    for motion in case.motions(20, 17):
        matrices = jacobians(case.chain, motion.q)
        basis = np.hstack((matrices.null, matrices.span))
        assert basis.shape == (len(basis), len(basis))
        np.testing.assert_allclose(basis.T @ basis, np.eye(len(basis)), atol=1e-14)
        np.testing.assert_allclose(matrices.null.T @ matrices.span @ matrices.j_td, 0.0, atol=1e-14)


# ---- all robots: dynamics -------------------------------------------------------------------------------------------


def test_the_three_equations_1_7_to_1_9(case: Case) -> None:
    for motion in case.motions(100, 20):
        matrices, efforts = jacobians(case.chain, motion.q), inverse_dynamics(case.chain, motion)
        first, second = efforts.lambda_1, efforts.lambda_2
        scale = np.abs(efforts.tau).max()
        found = input_efforts_from_multipliers(matrices, efforts.tau_ta, first, second)
        np.testing.assert_allclose(found, efforts.tau, rtol=0.0, atol=1e-12 * scale)  # 1.7 is 1.15
        close_to(matrices.a.T @ first - matrices.j_t.T @ second, efforts.w_p, 1e-12)  # 1.8
        close_to(matrices.j_td.T @ second, efforts.tau_td, 1e-12)  # 1.9


def test_equations_hold_as_printed_with_b_turned_round(case: Case) -> None:
    """1.1, 1.7 and 1.26 are in one convention, B' = -B; the J = A^-1 B beside 1.15 is not in it."""
    for motion in case.motions(20, 21):
        matrices, efforts = jacobians(case.chain, motion.q), inverse_dynamics(case.chain, motion)
        printed_b, dq_a = -matrices.b, motion.v[case.chain.active]
        scale = np.abs(matrices.a @ motion.t).max()
        assert np.abs(matrices.a @ motion.t + printed_b @ dq_a).max() <= 1e-12 * scale  # 1.1
        second = matrices.j_ta.T @ efforts.lambda_2
        close_to(efforts.tau_ta - printed_b.T @ efforts.lambda_1 - second, efforts.tau, 1e-12)  # 1.7
        close_to(-printed_b.T @ np.linalg.inv(matrices.a).T, matrices.j.T, 1e-12)  # 1.26
        assert np.abs(np.linalg.solve(matrices.a, printed_b) @ dq_a - motion.t).max() > 1e-3  # J = A^-1 B
        # 1.26 in the convention in which J = A^-1 B and the five-bar's 1.30 are printed
        with_1_26 = efforts.tau_ta - matrices.b.T @ np.linalg.inv(matrices.a).T @ efforts.w_p
        assert (
            np.abs(with_1_26 + matrices.j_d.T @ efforts.tau_td - efforts.tau).max() > 1e-3 * np.abs(efforts.w_p).max()
        )


@pytest.mark.parametrize("name", ["dextar", "unequal"])
def test_1_25_lacks_the_passive_joints_share(name: str) -> None:
    """tau = tau_ta + J^T w_p is 1.15 for the reduced model only."""
    for distal, holds in ((None, True), (DISTAL, False)):
        case = five_bar_case(name, distal, (1, -1))
        for motion in case.motions(50, 22):
            efforts = inverse_dynamics(case.chain, motion)
            error = np.abs(efforts.tau_ta + jacobians(case.chain, motion.q).j.T @ efforts.w_p - efforts.tau).max()
            assert (error <= 1e-12 * np.abs(efforts.tau).max()) == holds


def free_platform(chain: ClosedChain, pose: Vector, twist: Vector) -> tuple[float, float]:
    """Kinetic and potential energy (J) of the free platform, from its centre of mass."""
    phi, rate = (float(pose[2]), float(twist[2])) if chain.platform.rotates else (0.0, 0.0)
    x, y = chain.arm(chain.platform.centre, phi)
    velocity = np.array([twist[0] - rate * y, twist[1] + rate * x])
    mass, gravity = chain.platform.mass, chain.tree.gravity.linear[:2]
    kinetic = 0.5 * mass * velocity @ velocity + 0.5 * chain.platform.inertia * rate**2
    return float(kinetic), float(-mass * gravity @ (pose[:2] + np.array([x, y])))


def virtual_tree(chain: ClosedChain, q: Vector, v: Vector) -> tuple[float, float]:
    """Kinetic and potential energy (J) of the legs with the platform taken off."""
    kinetic = pin.computeKineticEnergy(chain.tree, chain.data, q, v)
    return float(kinetic), float(pin.computePotentialEnergy(chain.tree, chain.data, q))


def test_motors_power_is_the_change_of_energy(case: Case) -> None:
    """The pins do no work."""
    for motion in case.motions(40, 23):
        efforts, neighbour = inverse_dynamics(case.chain, motion), along(case, motion)
        power = efforts.tau @ motion.v[case.chain.active]

        def energy(time: float, at: Callable[[float], ChainMotion] = neighbour) -> Vector:
            then = at(time)
            parts = virtual_tree(case.chain, then.q, then.v) + free_platform(case.chain, then.pose, then.t)
            return np.array([sum(parts)])

        change = slope(energy)[0]
        parts = [
            efforts.tau_ta @ motion.v[case.chain.active],
            efforts.tau_td @ motion.v[case.chain.passive],
            efforts.w_p @ motion.t,
        ]
        scale = np.abs(parts).max()
        assert abs(power - change) <= 1e-9 * scale
        assert abs(power - sum(parts)) <= 1e-12 * scale


def lagrange(
    energies: Callable[[Vector, Vector], tuple[float, float]], at: Callable[[float], tuple[Vector, Vector]]
) -> Vector:
    """d/dt dL/dqdot - dL/dq at time 0 along a motion; both by finite differences of the energies."""
    q, v = at(0.0)
    unit = np.eye(len(q))

    def momentum(time: float) -> Vector:
        here, moving = at(time)
        # kinetic energy is a quadratic form in the velocity: one central difference of any width is exact
        return np.array([0.5 * (energies(here, moving + e)[0] - energies(here, moving - e)[0]) for e in unit])

    def lagrangian(place: Vector) -> Vector:
        kinetic, potential = energies(place, v)
        return np.array([kinetic - potential])

    slopes = [slope(lambda step, e=e: lagrangian(q + step * e), 1e-2)[0] for e in unit]
    return slope(momentum) - np.array(slopes)


def test_tree_efforts_are_lagranges_of_the_virtual_tree(case: Case) -> None:
    """1.10 and 1.12."""
    for motion in case.motions(10, 24):
        neighbour = along(case, motion)
        wanted = lagrange(
            lambda q, v: virtual_tree(case.chain, q, v),
            lambda time, at=neighbour: (at(time).q, at(time).v),
        )
        found = tree_efforts(case.chain, motion)
        close_to(case.chain.joint_vector(found.active, found.passive), wanted, 1e-8)


def test_platforms_wrench_is_lagranges_of_the_free_platform(case: Case) -> None:
    """1.11, the centre of mass beside the controlled point."""
    for motion in case.motions(10, 25):

        def at(time: float, motion: ChainMotion = motion) -> tuple[Vector, Vector]:
            pose = motion.pose + time * motion.t + 0.5 * time * time * motion.dt
            return pose, motion.t + time * motion.dt

        wanted = lagrange(lambda pose, twist: free_platform(case.chain, pose, twist), at)
        close_to(platform_wrench(case.chain, motion), wanted, 1e-9)


class WholeRobot:
    """Pinocchio's model of legs and platform as bodies of one tree, the tips held by contact constraints."""

    def __init__(self, chain: ClosedChain) -> None:
        self.chain = chain
        self.model = pin.Model(chain.tree)
        platform = chain.platform
        kinds: list[Any] = [pin.JointModelPX(), pin.JointModelPY()]
        if platform.rotates:
            kinds.append(pin.JointModelRZ())
        joint = 0
        for number, kind in enumerate(kinds):
            joint = self.model.addJoint(joint, kind, pin.SE3.Identity(), f"platform_{number}")
        centre = np.array([*platform.centre, 0.0])
        self.model.appendBodyToJoint(
            joint, pin.Inertia(platform.mass, centre, np.diag([0.0, 0.0, platform.inertia])), pin.SE3.Identity()
        )
        self.contacts, self.contact_data = pin.StdVec_RigidConstraintModel(), pin.StdVec_RigidConstraintData()
        self.attachments: list[int] = []
        for number, leg in enumerate(chain.legs):
            tip = self.model.frames[leg.frame]
            there = pin.SE3(np.eye(3), np.array([*leg.tip.attachment, 0.0]))
            contact = pin.RigidConstraintModel(
                pin.ContactType.CONTACT_3D,
                self.model,
                tip.parentJoint,
                tip.placement,
                joint,
                there,
                pin.ReferenceFrame.LOCAL_WORLD_ALIGNED,
            )
            self.contacts.append(contact)
            self.contact_data.append(contact.createData())
            frame = pin.Frame(f"attachment_{number}", joint, there, pin.FrameType.OP_FRAME)
            self.attachments.append(self.model.addFrame(frame))
        self.data = self.model.createData()

    def vectors(self, motion: ChainMotion) -> tuple[Vector, Vector, Vector]:
        """q, v and a of all bodies."""
        return (
            np.concatenate((motion.q, motion.pose)),
            np.concatenate((motion.v, motion.t)),
            np.concatenate((motion.a, motion.dt)),
        )

    def projected_rnea(self, motion: ChainMotion) -> tuple[Vector, Vector]:
        """tau (n,) and the pins' forces, from rnea = S^T tau + K^T force with K of all contacts."""
        efforts = np.asarray(pin.rnea(self.model, self.data, *self.vectors(motion)))
        q = self.vectors(motion)[0]
        pin.computeJointJacobians(self.model, self.data, q)
        pin.updateFramePlacements(self.model, self.data)
        whole = np.vstack(
            [
                (self.frame_jacobian(leg.frame) - self.frame_jacobian(there))[list(leg.rows)]
                for leg, there in zip(self.chain.legs, self.attachments, strict=True)
            ]
        )
        choose = np.zeros((self.model.nv, len(self.chain.active)))
        choose[self.chain.active, range(len(self.chain.active))] = 1.0
        answer = np.linalg.solve(np.hstack((choose, whole.T)), efforts)
        return answer[: len(self.chain.active)], answer[len(self.chain.active) :]

    def frame_jacobian(self, frame: int) -> Vector:
        return np.asarray(pin.getFrameJacobian(self.model, self.data, frame, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED))

    def acceleration(self, motion: ChainMotion, tau: Vector) -> Vector:
        """All bodies' accelerations under the motors' torques, by Pinocchio's constrained forward dynamics."""
        q, v, _ = self.vectors(motion)
        efforts = np.zeros(self.model.nv)
        efforts[self.chain.active] = tau
        pin.initConstraintDynamics(self.model, self.data, self.contacts, self.contact_data)
        settings = pin.ProximalSettings(1e-14, 1e-10, 50)
        return np.asarray(
            pin.constraintDynamics(self.model, self.data, q, v, efforts, self.contacts, self.contact_data, settings)
        )


def test_torque_is_pinocchios_projected_rnea(case: Case) -> None:
    """1.15 against the inverse dynamics of one tree with the platform in it."""
    whole = WholeRobot(case.chain)
    for motion in case.motions(100, 26):
        close_to(inverse_dynamics(case.chain, motion).tau, whole.projected_rnea(motion)[0], 1e-12)


@pytest.mark.parametrize(
    "name", ["dextar, distal inertia", "unequal, distal inertia, hung up", "3-RRR", "3-RRR, hung up"]
)
def test_torque_gives_the_motion_back_in_pinocchios_forward_dynamics(name: str) -> None:
    """Robots whose passive joints carry an inertia: Pinocchio inverts the mass matrix of the open tree."""
    case = CASES[name]()
    whole = WholeRobot(case.chain)
    for motion in case.motions(50, 27):
        found = whole.acceleration(motion, inverse_dynamics(case.chain, motion).tau)
        close_to(found, whole.vectors(motion)[2], 1e-9)


@pytest.mark.parametrize("name", ["dextar", "unequal"])
def test_reduced_models_torque_gives_the_motion_back_in_the_closed_loop(name: str) -> None:
    """The URDF's halves of the platform mass on the distal links against the platform as a body of its own."""
    case, loop = five_bar_case(name, None, (1, -1)), ClosedLoop(load_robot(name))
    for motion in case.motions(50, 32):
        tau = inverse_dynamics(case.chain, motion).tau
        close_to(loop.acceleration(motion.q, motion.v, case.chain.joint_vector(tau, np.zeros(2))), motion.a, 1e-9)
        close_to(loop.inverse_dynamics(motion.q, motion.v, motion.a), tau, 1e-12)


def test_multipliers_are_the_pins_forces_on_the_platform(case: Case) -> None:
    """lambda_1 and lambda_2 are one vector of pin forces, N lambda_1 - R lambda_2, that moves the platform (1.8)."""
    whole = WholeRobot(case.chain)
    for motion in case.motions(50, 28):
        matrices, efforts = jacobians(case.chain, motion.q), inverse_dynamics(case.chain, motion)
        forces = matrices.null @ efforts.lambda_1 - matrices.span @ efforts.lambda_2
        total, row = np.zeros(case.chain.platform.freedoms), 0
        for leg in case.chain.legs:
            phi = float(motion.pose[2]) if case.chain.platform.rotates else 0.0
            total += platform_rows(case.chain, leg, phi).T @ forces[row : row + len(leg.rows)]
            row += len(leg.rows)
        close_to(total, efforts.w_p, 1e-12)
        # Pinocchio's are the forces on the legs
        close_to(forces, -whole.projected_rnea(motion)[1], 1e-12)


def test_lambda_1_belongs_to_w_p(case: Case) -> None:
    """1.14 both ways: A^T lambda_1 is the platform's wrench and what the legs' own inertia adds."""
    for motion in case.motions(50, 29):
        matrices, efforts = jacobians(case.chain, motion.q), inverse_dynamics(case.chain, motion)
        added = matrices.j_t.T @ lambda_2(matrices, efforts.tau_td)
        close_to(matrices.a.T @ efforts.lambda_1, efforts.w_p + added, 1e-12)
        close_to(efforts.lambda_1, np.linalg.inv(matrices.a).T @ (efforts.w_p + added), 1e-12)


def test_the_torque_does_not_depend_on_where_the_platform_is_cut_off() -> None:
    """Third joints in the tree or between tip and platform: same A, B, torque and lambda_1, other n_d."""
    pinned, welded = CASES["3-RRR"](), CASES["3-RRR, tips welded"]()
    assert (len(pinned.chain.passive), len(welded.chain.passive)) == (3, 6)
    for motion in pinned.motions(50, 30):
        q = welded.angles(motion.pose)
        other = motion_from_platform(welded.chain, q, motion.t, motion.dt)
        here, there = jacobians(pinned.chain, motion.q), jacobians(welded.chain, q)
        close_to(there.a, here.a, 1e-12)
        close_to(there.b, here.b, 1e-12)
        one, two = inverse_dynamics(pinned.chain, motion), inverse_dynamics(welded.chain, other)
        close_to(two.tau, one.tau, 1e-12)
        close_to(two.w_p, one.w_p, 1e-12)
        close_to(two.lambda_1, one.lambda_1, 1e-12)


def test_a_welded_tip_may_stand_at_an_angle() -> None:
    """Third joints that are counted from another direction of the platform."""
    plain = CASES["3-RRR, tips welded"]()
    angles = (0.4, -1.1, 2.9)
    tips = [leg.tip._replace(angle=angle) for leg, angle in zip(plain.chain.legs, angles, strict=True)]
    turned = ClosedChain(three_rrr_chain(welded=True).tree, MOTORS, tips, EXAMPLE.platform)
    for motion in plain.motions(20, 33):
        q = motion.q.copy()
        q[2::3] += angles
        close_to(platform_pose(turned, q), motion.pose)
        assert np.abs(closure_gap(turned, q, motion.pose)).max() < 1e-14
        other = motion_from_platform(turned, q, motion.t, motion.dt)
        close_to(inverse_dynamics(turned, other).tau, inverse_dynamics(plain.chain, motion).tau)


@pytest.mark.parametrize("name", ["dextar", "unequal"])
def test_a_platform_that_cannot_turn_may_be_welded_to_its_legs(name: str) -> None:
    """The five-bar with a wrist on each leg, both holding the platform's direction: the wrists take no part."""
    case = five_bar_case(name, DISTAL, (1, -1))
    tree = pin.Model(case.chain.tree)
    for number in (1, 2):
        tip = tree.frames[tree.getFrameId(f"tip_{number}")]
        wrist = tree.addJoint(tip.parentJoint, pin.JointModelRZ(), tip.placement, f"q{number}3")
        tree.addFrame(pin.Frame(f"hand_{number}", wrist, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
    hands = [Tip("hand_1", angle=0.0), Tip("hand_2", angle=0.0)]
    held = ClosedChain(tree, ("q11", "q21"), hands, case.chain.platform)
    wrists = [tree.joints[tree.getJointId(f"q{number}3")].idx_v for number in (1, 2)]
    others = [index for index in range(6) if index not in wrists]
    for motion in case.motions(20, 34):
        q = np.empty(6)
        q[others], q[wrists] = motion.q, -motion.q.reshape(2, 2).sum(axis=1)
        other = motion_from_platform(held, q, motion.t, motion.dt)
        close_to(other.pose, motion.pose)
        close_to(other.v[wrists], -motion.v.reshape(2, 2).sum(axis=1))
        close_to(inverse_dynamics(held, other).tau, inverse_dynamics(case.chain, motion).tau)


def test_3_rrr_rows_of_a_are_the_wrenches_of_its_distal_links() -> None:
    """One passive joint before the pin: row i is the unit vector along distal link i and its moment about P."""
    case = CASES["3-RRR"]()
    for motion in case.motions(50, 31):
        found = jacobians(case.chain, motion.q)
        for i, (leg, q_1, q_2) in enumerate(zip(EXAMPLE[:3], motion.q[::2], motion.q[1::2], strict=True)):
            u_x, u_y = math.cos(q_1 + q_2), math.sin(q_1 + q_2)
            r_x, r_y = case.chain.arm(leg.attachment, float(motion.pose[2]))
            np.testing.assert_allclose(found.a[i], [u_x, u_y, r_x * u_y - r_y * u_x], atol=1e-14)
            assert found.b[i, i] == pytest.approx(leg.proximal * math.sin(q_2), abs=1e-14)
        np.testing.assert_array_equal(found.b, np.diag(np.diag(found.b)))


# ---- what is refused ------------------------------------------------------------------------------------------------


def three_legs(active: tuple[str, ...], tips: list[Tip], rotates: bool = True) -> ClosedChain:
    return ClosedChain(three_rrr_chain().tree, active, tips, ChainPlatform(1.0, 1.0, rotates))


TIPS = [Tip("tip_1", (-0.07, -0.04)), Tip("tip_2", (0.08, -0.05)), Tip("tip_3", (0.01, 0.09))]


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda: three_legs(("q11", "q21", "q41"), TIPS), "joint q41: not in the tree"),
        (lambda: three_legs(MOTORS, [*TIPS[:2], Tip("tip_4")]), "tip tip_4: not a frame"),
        (lambda: three_legs(("q11", "q21", "q21"), TIPS), "named twice"),
        (lambda: three_legs(MOTORS, TIPS[:2]), "passive joint q32: moves 0 tips"),
        (lambda: three_legs(MOTORS, [*TIPS, TIPS[0]]), "passive joint q12: moves 2 tips"),
        (lambda: three_legs(MOTORS, TIPS, rotates=False), "3 active and 3 passive joints, 2 platform freedoms"),
        (lambda: three_legs((*MOTORS, "q12"), TIPS), "4 active and 2 passive joints"),
        (
            lambda: ClosedChain(three_rrr_chain(welded=True).tree, MOTORS[1:], TIPS, ChainPlatform(1.0, 1.0, True)),
            "3 passive joints, its closure fixes only 2",
        ),
    ],
)
def test_parts_that_do_not_fit_are_refused_by_name(build: Callable[[], ClosedChain], words: str) -> None:
    with pytest.raises(ChainError, match=words):
        build()


def test_a_tree_that_leaves_the_plane_is_refused() -> None:
    tree = three_rrr_chain().tree
    tree.jointPlacements[2] = pin.SE3(pin.utils.rotate("x", 0.1), tree.jointPlacements[2].translation)
    with pytest.raises(ChainError, match="tip tip_1: moves out of the xy plane"):
        ClosedChain(tree, MOTORS, TIPS, ChainPlatform(1.0, 1.0, True))


def test_a_joint_of_more_freedoms_is_refused() -> None:
    tree = three_rrr_chain().tree
    tree.addJoint(0, pin.JointModelPlanar(), pin.SE3.Identity(), "cart")
    with pytest.raises(ChainError, match="joint cart: has 4 coordinates and 3 freedoms"):
        ClosedChain(tree, MOTORS, TIPS, ChainPlatform(1.0, 1.0, True))


def test_out_of_reach_is_nan() -> None:
    angles = three_rrr.inverse_geometry(EXAMPLE, (1, 1, 1), np.array([0.5, 0.0, 0.0]))
    assert np.isnan(angles).any()
