# SPDX-License-Identifier: Apache-2.0
"""Inverse dynamics of a planar closed chain: 1.7 to 1.15, for any motion that closes the chain.

The virtual tree and the free platform each have a Lagrangian of their own. Pinocchio's recursive Newton-Euler
algorithm on the tree gives what Lagrange's equations of L_t give (1.10, 1.12); the platform is one rigid body (1.11).
Friction is not part of it: add it to tau, as in 1.30.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pinocchio as pin

from closed_chain.chain import ClosedChain, Vector
from closed_chain.kinematics import ChainMotion, Jacobians, jacobians, solve


class TreeEfforts(NamedTuple):
    """Efforts of the virtual tree: tau_ta (n,) of 1.10 and tau_td (n_d,) of 1.12, Nm (N at sliding joints)."""

    active: Vector
    passive: Vector


class Efforts(NamedTuple):
    """All efforts of one motion.

    Attributes:
        tau: input efforts (n,) of 1.15.
        tau_ta, tau_td: efforts of the virtual tree (1.10, 1.12), (n,) and (n_d,).
        w_p: wrench of the free platform at P, base frame (1.11), (n,): N, N and Nm.
        lambda_1, lambda_2: multipliers of 1.1 and 1.6 (1.14, 1.13), (n,) and (n_d,).
    """

    tau: Vector
    tau_ta: Vector
    tau_td: Vector
    w_p: Vector
    lambda_1: Vector
    lambda_2: Vector


def tree_efforts(chain: ClosedChain, motion: ChainMotion) -> TreeEfforts:
    """Return tau_ta and tau_td (1.10, 1.12): recursive Newton-Euler of the tree with the platform taken off."""
    whole = np.asarray(pin.rnea(chain.tree, chain.data, motion.q, motion.v, motion.a))
    return TreeEfforts(whole[chain.active], whole[chain.passive])


def platform_wrench(chain: ClosedChain, motion: ChainMotion) -> Vector:
    """Return w_p (n,) of 1.11: the wrench, reduced to P, that gives the free platform its motion against gravity."""
    platform, gravity = chain.platform, chain.tree.gravity.linear
    rotates = platform.rotates
    arm_x, arm_y = chain.arm(platform.centre, float(motion.pose[2]) if rotates else 0.0)
    rate, bend = (float(motion.t[2]), float(motion.dt[2])) if rotates else (0.0, 0.0)
    force_x = platform.mass * (motion.dt[0] - bend * arm_y - rate * rate * arm_x - gravity[0])
    force_y = platform.mass * (motion.dt[1] + bend * arm_x - rate * rate * arm_y - gravity[1])
    moment = platform.inertia * bend + arm_x * force_y - arm_y * force_x
    return np.array([force_x, force_y, moment][: platform.freedoms])


def lambda_2(matrices: Jacobians, tau_td: Vector) -> Vector:
    """Return lambda_2 (n_d,) = J_td^-T tau_td (1.13), from 1.9."""
    return solve(matrices.j_td.T, tau_td)


def driven_wrench(matrices: Jacobians, w_p: Vector, tau_td: Vector) -> Vector:
    """Return w_p + J_t^T lambda_2 (n,): what the active joints have to bring to the platform, A^T lambda_1.

    On the Type 2 locus it must do no work on t_s, the kernel of A. That is 1.19 with the legs' inertia in it; the
    printed t_s^T w_p = 0 is the case of tau_td = 0.
    """
    return np.asarray(w_p + matrices.j_t.T @ lambda_2(matrices, tau_td))


def lambda_1(matrices: Jacobians, w_p: Vector, tau_td: Vector) -> Vector:
    """Return lambda_1 (n,) = A^-T (w_p + J_t^T J_td^-T tau_td) (1.14), from 1.8.

    Raises:
        numpy.linalg.LinAlgError: A is singular to the last bit (Type 2).
    """
    return solve(matrices.a.T, driven_wrench(matrices, w_p, tau_td))


def input_efforts(matrices: Jacobians, tree: TreeEfforts, w_p: Vector) -> Vector:
    """Return tau (n,) = tau_ta + J^T w_p + J_d^T tau_td (1.15), with J = A^-1 B."""
    return np.asarray(tree.active + matrices.j.T @ w_p + matrices.j_d.T @ tree.passive)


def input_efforts_from_multipliers(matrices: Jacobians, tau_ta: Vector, first: Vector, second: Vector) -> Vector:
    """Return tau (n,) = tau_ta + B^T lambda_1 - J_ta^T lambda_2 (1.7, its B turned round as 1.1 is)."""
    return np.asarray(tau_ta + matrices.b.T @ first - matrices.j_ta.T @ second)


def inverse_dynamics(chain: ClosedChain, motion: ChainMotion) -> Efforts:
    """Return the input efforts that a motion takes, with all they are made of.

    Raises:
        numpy.linalg.LinAlgError: A is singular to the last bit (Type 2).
    """
    matrices = jacobians(chain, motion.q)
    tree = tree_efforts(chain, motion)
    w_p = platform_wrench(chain, motion)
    return Efforts(
        tau=input_efforts(matrices, tree, w_p),
        tau_ta=tree.active,
        tau_td=tree.passive,
        w_p=w_p,
        lambda_1=lambda_1(matrices, w_p, tree.passive),
        lambda_2=lambda_2(matrices, tree.passive),
    )
