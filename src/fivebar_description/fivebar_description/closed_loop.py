# SPDX-License-Identifier: Apache-2.0
"""The closed-loop robot in Pinocchio: the two chains of the URDF, joined at their tips by a 3D contact constraint.

This model shares no equation with :mod:`fivebar_control.model`, so that each validates the other, as ADAMS and
MATLAB do in the thesis (section 1.4.3).
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from fivebar_description.interface import JOINTS
from fivebar_description.parameters import FiveBar
from fivebar_description.urdf import urdf_text

Vector = NDArray[np.float64]

PROXIMAL_ACCURACY = 1e-13
"""Residual of the constraint solver; the third row of the planar contact is always zero and needs regularising."""

PROXIMAL_MU = 1e-10
PROXIMAL_ITERATIONS = 20


class TipGap(NamedTuple):
    """Vector from tip 2 to tip 1 (m), and its 2x4 Jacobian by (q11, q12, q21, q22)."""

    gap: Vector
    jacobian: Vector


class ClosedLoop:
    """Pinocchio's model of the five-bar, in joint coordinates q = (q11, q12, q21, q22).

    Gravity is that in the robot's plane, zero for a level robot, and a constant force may act on the tips. All vectors
    are float64 of shape (4,), in rad, rad/s, rad/s^2 and Nm. An instance has a workspace of its own and is not
    thread-safe.
    """

    def __init__(self, robot: FiveBar) -> None:
        """Build the model from the robot's URDF."""
        self.model: Any = pin.buildModelFromXML(urdf_text(robot, "fivebar"))
        self.model.gravity.setZero()
        self.model.gravity.linear[:2] = robot.gravity_x, robot.gravity_y
        self._force = np.array([robot.force_x, robot.force_y])
        if tuple(self.model.names)[1:] != JOINTS:
            raise AssertionError(f"joint order {tuple(self.model.names)[1:]} is not {JOINTS}")
        self.data: Any = self.model.createData()
        self._tips = tuple(self.model.getFrameId(f"tip_{leg}") for leg in (1, 2))
        self._distals = tuple(
            (self.model.frames[tip].parentJoint, self.model.frames[tip].placement.translation.copy())
            for tip in self._tips
        )
        self._contacts, self._contact_data = self._join_tips()
        self._settings = pin.ProximalSettings(PROXIMAL_ACCURACY, PROXIMAL_MU, PROXIMAL_ITERATIONS)

    def _join_tips(self) -> tuple[Any, Any]:
        tip_1, tip_2 = (self.model.frames[tip] for tip in self._tips)
        contact = pin.RigidConstraintModel(
            pin.ContactType.CONTACT_3D,
            self.model,
            tip_1.parentJoint,
            tip_1.placement,
            tip_2.parentJoint,
            tip_2.placement,
            pin.ReferenceFrame.LOCAL_WORLD_ALIGNED,
        )
        contacts, contact_data = pin.StdVec_RigidConstraintModel(), pin.StdVec_RigidConstraintData()
        contacts.append(contact)
        contact_data.append(contact.createData())
        pin.initConstraintDynamics(self.model, self.data, contacts, contact_data)
        return contacts, contact_data

    def acceleration(self, q: Vector, v: Vector, tau: Vector) -> Vector:
        """Return qddot (4,) of the closed loop under the joint torques tau (4,); regular on the Type 2 locus."""
        if self._force.any():
            tau = tau + self._by_force(q)
        return np.asarray(
            pin.constraintDynamics(self.model, self.data, q, v, tau, self._contacts, self._contact_data, self._settings)
        )

    def inverse_dynamics(self, q: Vector, v: Vector, a: Vector) -> Vector:
        """Return the motor torques (2,) that give a closed-loop motion (q, v, a) away from the locus.

        The tree's torques (recursive Newton-Euler) are projected with the loop's Jacobian: J^T f takes the torque of
        the passive joints to zero.
        """
        tree = np.asarray(pin.rnea(self.model, self.data, q, v, a))
        if self._force.any():
            tree = tree - self._by_force(q)
        jacobian = self.tip_gap(q).jacobian
        force = np.linalg.solve(jacobian[:, [1, 3]].T, tree[[1, 3]])
        return np.asarray(tree[[0, 2]] - jacobian[:, [0, 2]].T @ force)

    def _by_force(self, q: Vector) -> Vector:
        """Return the joint torques (4,) of the constant force, half of it on each tip."""
        frame = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        jacobians = [pin.computeFrameJacobian(self.model, self.data, q, tip, frame)[:2] for tip in self._tips]
        return np.asarray(0.5 * (jacobians[0] + jacobians[1]).T @ self._force)

    def tip_gap(self, q: Vector) -> TipGap:
        """Return the closure gap at q and its Jacobian."""
        pin.forwardKinematics(self.model, self.data, q)
        placements = self.data.oMi
        joints = [placements[joint].translation for joint in (1, 2, 3, 4)]
        tips = [placements[joint].act(tip) for joint, tip in self._distals]
        jacobian = np.empty((2, 4))
        for column, joint in enumerate(joints):
            tip, sign = (tips[0], 1.0) if column < 2 else (tips[1], -1.0)
            jacobian[0, column] = -sign * (tip[1] - joint[1])
            jacobian[1, column] = sign * (tip[0] - joint[0])
        return TipGap((tips[0] - tips[1])[:2], jacobian)

    def close(self, q: Vector, v: Vector) -> tuple[Vector, Vector, float]:
        """Project (q, v) onto the closed loop: one Gauss-Newton step for q, an exact projection for v.

        Returns the corrected q and v and the gap (m) that was found before the correction. The 2x2 solve is in closed
        form, so that results do not depend on the linear algebra library.
        """
        gap, jacobian = self.tip_gap(q)
        normal = jacobian @ jacobian.T
        determinant = normal[0, 0] * normal[1, 1] - normal[0, 1] * normal[0, 1]
        inverse = np.array([[normal[1, 1], -normal[0, 1]], [-normal[0, 1], normal[0, 0]]]) / determinant
        pseudo_inverse = jacobian.T @ inverse
        return q - pseudo_inverse @ gap, v - pseudo_inverse @ (jacobian @ v), math.hypot(gap[0], gap[1])

    def kinetic_energy(self, q: Vector, v: Vector) -> float:
        """Return the kinetic energy (J)."""
        return float(pin.computeKineticEnergy(self.model, self.data, q, v))

    def platform(self, q: Vector, v: Vector, a: Vector) -> tuple[Vector, Vector, Vector]:
        """Return the platform's position, velocity and acceleration, each (2,), as the mean of both tips."""
        pin.forwardKinematics(self.model, self.data, q, v, a)
        pin.updateFramePlacements(self.model, self.data)
        frame = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        position = np.mean([self.data.oMf[tip].translation for tip in self._tips], axis=0)
        velocity = np.mean(
            [pin.getFrameVelocity(self.model, self.data, tip, frame).linear for tip in self._tips], axis=0
        )
        acceleration = np.mean(
            [pin.getFrameClassicalAcceleration(self.model, self.data, tip, frame).linear for tip in self._tips],
            axis=0,
        )
        return position[:2], velocity[:2], acceleration[:2]
