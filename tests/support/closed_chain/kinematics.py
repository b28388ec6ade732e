# SPDX-License-Identifier: Apache-2.0
"""First and second order kinematics of a planar closed chain: 1.1 to 1.6, and their derivatives.

Per leg, with its tip's velocity once seen from the platform (1.2, 1.3) and once from the leg (1.4, 1.5):

    J_t,i t = J_a,i qdot_a + J_d,i qdot_d

The leg's passive Jacobian J_d,i splits the space of these equations in two. N_i, an orthonormal basis of its left null
space, takes the passive velocities out: the rows N_i^T J_t,i of A and N_i^T J_a,i of B (1.1). R_i, one of its range,
keeps them: the rows R_i^T of J_t, J_ta and J_td (1.6), which is how n + n_d closure equations become the n_d of 1.6.
The bases' signs are fixed by det [N_i R_i] = +1 with a positive triangle R_i^T J_d,i, so that all of it is
continuous in q. For a leg with one passive joint before the platform's joint, N_i is the unit vector along the distal
link: for the five-bar A has the rows u_i and B is diag(l_i1 sin q_i2).

The multipliers depend on the choice of these bases; J, J_d and the torques do not.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin

from closed_chain.chain import ChainLeg, ClosedChain, Vector

ALIGNED = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED


class Jacobians(NamedTuple):
    """The matrices of 1.1 and 1.6 at one posture.

    Attributes:
        a: A (n, n), parallel Jacobian, A t = B qdot_a. Singular at Type 2.
        b: B (n, n), serial Jacobian. Singular at Type 1.
        j_t: J_t (n_d, n), of the platform's twist t.
        j_ta: J_ta (n_d, n), of the active joint velocities.
        j_td: J_td (n_d, n_d), of the passive joint velocities.
        null: N (n + n_d, n), rows leg by leg as in the tips' order.
        span: R (n + n_d, n_d), likewise.
    """

    a: Vector
    b: Vector
    j_t: Vector
    j_ta: Vector
    j_td: Vector
    null: Vector
    span: Vector

    @property
    def j(self) -> Vector:
        """J = A^-1 B (n, n) of t = J qdot_a. Raises LinAlgError where A is singular to the last bit (Type 2)."""
        return solve(self.a, self.b)

    @property
    def j_d(self) -> Vector:
        """J_d = J_td^-1 (J_t J - J_ta) (n_d, n) of qdot_d = J_d qdot_a, from 1.6."""
        return solve(self.j_td, self.j_t @ self.j - self.j_ta)


class Drift(NamedTuple):
    """The velocity terms of the derivatives of 1.1 and 1.6.

    A tdot + c = B qddot_a and J_t tdot + d = J_ta qddot_a + J_td qddot_d, with c (n,) and d (n_d,).
    """

    c: Vector
    d: Vector


class ChainMotion(NamedTuple):
    """One instant of a closed chain in motion.

    Attributes:
        q, v, a: joint positions, velocities and accelerations in tree order, each (nv,).
        pose, t, dt: platform pose, twist and its derivative in the base frame, each (n,): (x, y) or (x, y, phi).
    """

    q: Vector
    v: Vector
    a: Vector
    pose: Vector
    t: Vector
    dt: Vector


def tip_points(chain: ClosedChain, q: Vector) -> Vector:
    """Return where the tips are, seen from the legs: (tips, 3) of x, y (m) and the tip's angle (rad)."""
    pin.framesForwardKinematics(chain.tree, chain.data, q)
    placements = [chain.data.oMf[leg.frame] for leg in chain.legs]
    return np.array([[*at.translation[:2], math.atan2(at.rotation[1, 0], at.rotation[0, 0])] for at in placements])


def platform_pose(chain: ClosedChain, q: Vector) -> Vector:
    """Return the platform's pose (n,) from the joint positions: the mean over the tips, best fit of the attachments.

    phi is in (-pi, pi], from the tips that are one body with the platform if there are any, else from the triangle of
    attachments.
    """
    points = tip_points(chain, q)
    phi = _platform_angle(chain, points) if chain.platform.rotates else 0.0
    arms = np.array([chain.arm(leg.tip.attachment, phi) for leg in chain.legs])
    place = np.mean(points[:, :2] - arms, axis=0)
    return np.array([*place, phi]) if chain.platform.rotates else place


def _platform_angle(chain: ClosedChain, points: Vector) -> float:
    turns = [
        complex(math.cos(angle - leg.tip.angle), math.sin(angle - leg.tip.angle))
        for leg, angle in zip(chain.legs, points[:, 2], strict=True)
        if leg.tip.angle is not None
    ]
    if not turns:
        there = np.array([complex(*leg.tip.attachment) for leg in chain.legs])
        here = points[:, 0] + 1j * points[:, 1]
        turns = [complex(np.vdot(there - there.mean(), here - here.mean()))]
    total = sum(turns)
    return math.atan2(total.imag, total.real)


def closure_gap(chain: ClosedChain, q: Vector, pose: Vector) -> Vector:
    """Return by how much the tips miss their attachments: (n + n_d,), m, and rad for tips that are one body."""
    phi = float(pose[2]) if chain.platform.rotates else 0.0
    gaps: list[float] = []
    for leg, (x, y, angle) in zip(chain.legs, tip_points(chain, q), strict=True):
        arm_x, arm_y = chain.arm(leg.tip.attachment, phi)
        gaps += [x - pose[0] - arm_x, y - pose[1] - arm_y]
        if leg.tip.angle is not None:
            gaps.append(math.remainder(angle - phi - leg.tip.angle, 2.0 * math.pi))
    return np.array(gaps)


def platform_rows(chain: ClosedChain, leg: ChainLeg, phi: float) -> Vector:
    """Return J_t,i (2 or 3, n): the twist of the platform at A_im_i by the platform's twist (1.2, 1.3).

    omega x r_PA = -[r_PA]x omega; in the plane, phidot (-r_y, r_x).
    """
    arm_x, arm_y = chain.arm(leg.tip.attachment, phi)
    whole = np.array([[1.0, 0.0, -arm_y], [0.0, 1.0, arm_x], [0.0, 0.0, 1.0]])
    return whole[: len(leg.rows), : chain.platform.freedoms]


def jacobians(chain: ClosedChain, q: Vector) -> Jacobians:
    """Return the matrices of 1.1 and 1.6 at joint positions q (nv,) that close the chain."""
    phi = float(platform_pose(chain, q)[2]) if chain.platform.rotates else 0.0
    pin.computeJointJacobians(chain.tree, chain.data, q)
    n, n_d = len(chain.active), len(chain.passive)
    closure_t, closure_a, closure_d = (np.empty((n + n_d, width)) for width in (n, n, n_d))
    null, span = np.zeros((n + n_d, n)), np.zeros((n + n_d, n_d))
    row = null_column = span_column = 0
    for leg in chain.legs:
        rows = slice(row, row + len(leg.rows))
        whole = pin.getFrameJacobian(chain.tree, chain.data, leg.frame, ALIGNED)[list(leg.rows)]
        closure_t[rows] = platform_rows(chain, leg, phi)
        closure_a[rows], closure_d[rows] = whole[:, chain.active], whole[:, chain.passive]
        left_null, image = _split(closure_d[rows][:, leg.passive])
        null[rows, null_column : null_column + left_null.shape[1]] = left_null
        span[rows, span_column : span_column + image.shape[1]] = image
        row += len(leg.rows)
        null_column += left_null.shape[1]
        span_column += image.shape[1]
    return Jacobians(
        a=null.T @ closure_t,
        b=null.T @ closure_a,
        j_t=span.T @ closure_t,
        j_ta=span.T @ closure_a,
        j_td=span.T @ closure_d,
        null=null,
        span=span,
    )


def _split(passive: Vector) -> tuple[Vector, Vector]:
    """Return orthonormal bases N of the left null space and R of the range of J_d,i (rows, passive joints)."""
    rows, joints = passive.shape
    if joints == 0:
        return np.eye(rows), np.empty((rows, 0))
    basis, triangle = np.linalg.qr(passive, mode="complete")
    image = basis[:, :joints] * np.where(np.diag(triangle) < 0.0, -1.0, 1.0)
    left_null = basis[:, joints:]
    if rows > joints and np.linalg.det(np.hstack((left_null, image))) < 0.0:
        left_null[:, 0] *= -1.0
    return left_null, image


def drift(chain: ClosedChain, matrices: Jacobians, q: Vector, v: Vector, t: Vector) -> Drift:
    """Return c and d for joint velocities v (nv,) and a twist t (n,) that belong to each other.

    Both are the platform's centripetal acceleration at the tips minus the legs', projected on N and R; the bases'
    own derivatives cancel, since the closure holds in all its rows.
    """
    phi = float(platform_pose(chain, q)[2]) if chain.platform.rotates else 0.0
    rate = float(t[2]) if chain.platform.rotates else 0.0
    pin.forwardKinematics(chain.tree, chain.data, q, v, np.zeros(chain.tree.nv))
    parts = [
        _platform_drift(chain, leg, phi, rate)
        - pin.getFrameClassicalAcceleration(chain.tree, chain.data, leg.frame, ALIGNED).vector[list(leg.rows)]
        for leg in chain.legs
    ]
    whole = np.concatenate(parts)
    return Drift(matrices.null.T @ whole, matrices.span.T @ whole)


def _platform_drift(chain: ClosedChain, leg: ChainLeg, phi: float, rate: float) -> Any:
    arm_x, arm_y = chain.arm(leg.tip.attachment, phi)
    return np.array([-rate * rate * arm_x, -rate * rate * arm_y, 0.0])[: len(leg.rows)]


def passive_velocity(matrices: Jacobians, t: Vector, dq_a: Vector) -> Vector:
    """Return qdot_d (n_d,) = J_td^-1 (J_t t - J_ta qdot_a) from 1.6; regular at Types 1 and 2."""
    return solve(matrices.j_td, matrices.j_t @ t - matrices.j_ta @ dq_a)


def passive_acceleration(matrices: Jacobians, terms: Drift, dt: Vector, ddq_a: Vector) -> Vector:
    """Return qddot_d (n_d,) = J_td^-1 (J_t tdot + d - J_ta qddot_a), the derivative of 1.6."""
    return solve(matrices.j_td, matrices.j_t @ dt + terms.d - matrices.j_ta @ ddq_a)


def motion_from_active(chain: ClosedChain, q: Vector, dq_a: Vector, ddq_a: Vector) -> ChainMotion:
    """Return the motion that active velocities and accelerations, each (n,), give at q (nv,).

    Raises:
        numpy.linalg.LinAlgError: A is singular to the last bit (Type 2).
    """
    matrices = jacobians(chain, q)
    t = solve(matrices.a, matrices.b @ dq_a)
    v = chain.joint_vector(dq_a, passive_velocity(matrices, t, dq_a))
    terms = drift(chain, matrices, q, v, t)
    dt = solve(matrices.a, matrices.b @ ddq_a - terms.c)
    a = chain.joint_vector(ddq_a, passive_acceleration(matrices, terms, dt, ddq_a))
    return ChainMotion(q, v, a, platform_pose(chain, q), t, dt)


def motion_from_platform(chain: ClosedChain, q: Vector, t: Vector, dt: Vector) -> ChainMotion:
    """Return the motion that a platform twist and its derivative, each (n,), ask for at q (nv,); regular at Type 2.

    Raises:
        numpy.linalg.LinAlgError: B is singular to the last bit (Type 1).
    """
    matrices = jacobians(chain, q)
    dq_a = solve(matrices.b, matrices.a @ t)
    v = chain.joint_vector(dq_a, passive_velocity(matrices, t, dq_a))
    terms = drift(chain, matrices, q, v, t)
    ddq_a = solve(matrices.b, matrices.a @ dt + terms.c)
    a = chain.joint_vector(ddq_a, passive_acceleration(matrices, terms, dt, ddq_a))
    return ChainMotion(q, v, a, platform_pose(chain, q), t, dt)


def solve(matrix: Vector, right: Vector) -> Vector:
    """Return matrix^-1 right for a square matrix (n, n) and a vector (n,) or a matrix (n, m).

    Raises:
        numpy.linalg.LinAlgError: the matrix is singular to the last bit.
    """
    return np.asarray(np.linalg.solve(matrix, right), dtype=np.float64)
