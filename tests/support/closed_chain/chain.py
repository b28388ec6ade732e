# SPDX-License-Identifier: Apache-2.0
"""A planar closed chain: a tree of legs, which joints are driven, and where the tips meet the platform."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

Vector = NDArray[np.float64]
Indices = NDArray[np.intp]

OUT_OF_PLANE = [2, 3, 4]
"""Rows v_z, w_x and w_y of a Jacobian in Pinocchio's order."""

PLANAR_TOLERANCE = 1e-12
"""Largest out-of-plane entry of a tip's Jacobian that still counts as planar."""


class ChainError(ValueError):
    """The parts do not make a planar closed chain that section 1.2 can describe."""


class ChainPlatform(NamedTuple):
    """The free platform.

    Attributes:
        mass: kg.
        inertia: kg m^2 about the centre of mass; without effect if the platform does not rotate.
        rotates: True: pose (x, y, phi), twist (vx, vy, phidot). False: (x, y) and (vx, vy), phi = 0 for good.
        centre: centre of mass (m) seen from the controlled point P, in the platform's frame.
    """

    mass: float
    inertia: float
    rotates: bool
    centre: tuple[float, float] = (0.0, 0.0)

    @property
    def freedoms(self) -> int:
        """Number of components of pose and twist."""
        return 3 if self.rotates else 2


class Tip(NamedTuple):
    """The end of one leg, A_im_i of figure 1.6, and how it meets the platform.

    Attributes:
        frame: name of the tip's frame in the tree.
        attachment: where it meets the platform: r_PA (m) seen from P, in the platform's frame.
        angle: None: the tip and the platform are pinned by a passive revolute joint that is in neither of them (two
            closure equations). A number: they are one body, the tip's x axis at this angle (rad) in the platform's
            frame (three closure equations); the leg's last passive joint is then a joint of the tree.
    """

    frame: str
    attachment: tuple[float, float] = (0.0, 0.0)
    angle: float | None = None


class ChainLeg(NamedTuple):
    """One tip with what the equations need of it.

    Attributes:
        tip: as it was given.
        frame: the tip's frame number in the tree.
        rows: which of (v_x, v_y, v_z, w_x, w_y, w_z) the tip shares with the platform.
        passive: columns, in qdot_d, of the passive joints that move this tip.
    """

    tip: Tip
    frame: int
    rows: tuple[int, ...]
    passive: Indices


class ClosedChain:
    """A planar chain closed over a platform: virtual tree, active joints, tips, platform.

    Attributes:
        tree: Pinocchio model of the legs *without* the platform; all joints have one freedom. Its gravity acts on the
            platform too.
        data: work space of Pinocchio: use one chain per thread.
        active, passive: velocity indices, in the tree, of q_a (n,) in the given order and of q_d (n_d,) in tree order.
        legs: one per tip.
        platform: as given.
    """

    def __init__(self, tree: Any, active: Sequence[str], tips: Sequence[Tip], platform: ChainPlatform) -> None:
        """Join the tips of a tree by a platform.

        Raises:
            ChainError: a name is unknown, the tree is not planar, or the numbers of joints, freedoms and closure
                equations do not make A and J_td square.
        """
        self.tree = tree
        self.data: Any = tree.createData()
        self.platform = platform
        for name, joint in zip(list(tree.names)[1:], list(tree.joints)[1:], strict=True):
            if (joint.nq, joint.nv) != (1, 1):
                raise ChainError(f"joint {name}: has {joint.nq} coordinates and {joint.nv} freedoms, expected one each")
        driven = [self._velocity_index(name) for name in active]
        if len(set(driven)) != len(driven):
            raise ChainError(f"active joints {', '.join(active)}: one is named twice")
        self.active: Indices = np.array(driven, dtype=np.intp)
        self.passive: Indices = np.array([i for i in range(tree.nv) if i not in driven], dtype=np.intp)
        self.legs = tuple(self._leg(tip) for tip in tips)
        self._check_counts()
        self._check_planar()

    def _velocity_index(self, name: str) -> int:
        if not self.tree.existJointName(name):
            raise ChainError(f"joint {name}: not in the tree")
        return int(self.tree.joints[self.tree.getJointId(name)].idx_v)

    def _leg(self, tip: Tip) -> ChainLeg:
        if not self.tree.existFrame(tip.frame):
            raise ChainError(f"tip {tip.frame}: not a frame of the tree")
        frame = int(self.tree.getFrameId(tip.frame))
        moving = {self.tree.joints[joint].idx_v for joint in self.tree.supports[self._parent(frame)] if joint}
        passive = np.array([k for k, index in enumerate(self.passive) if index in moving], dtype=np.intp)
        rows = (0, 1) if tip.angle is None else (0, 1, 5)
        if len(passive) > len(rows):
            raise ChainError(f"tip {tip.frame}: {len(passive)} passive joints, its closure fixes only {len(rows)}")
        return ChainLeg(tip, frame, rows, passive)

    def _parent(self, frame: int) -> int:
        return int(self.tree.frames[frame].parentJoint)

    def _check_counts(self) -> None:
        used = np.concatenate([leg.passive for leg in self.legs]) if self.legs else np.empty(0, dtype=np.intp)
        names = list(self.tree.names)[1:]
        for k, index in enumerate(self.passive):
            count = int(np.sum(used == k))
            if count != 1:
                raise ChainError(f"passive joint {names[index]}: moves {count} tips, expected one")
        n, freedoms = len(self.active), self.platform.freedoms
        equations = sum(len(leg.rows) for leg in self.legs)
        if n != freedoms or equations != n + len(self.passive):
            raise ChainError(
                f"{n} active and {len(self.passive)} passive joints, {freedoms} platform freedoms and {equations} "
                "closure equations: active joints must equal freedoms, and equations the number of joints"
            )

    def _check_planar(self) -> None:
        posture = 0.7 * np.arange(1.0, self.tree.nv + 1.0)
        pin.computeJointJacobians(self.tree, self.data, posture)
        pin.updateFramePlacements(self.tree, self.data)
        for leg in self.legs:
            jacobian = pin.getFrameJacobian(self.tree, self.data, leg.frame, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
            if np.abs(jacobian[OUT_OF_PLANE]).max(initial=0.0) > PLANAR_TOLERANCE:
                raise ChainError(f"tip {leg.tip.frame}: moves out of the xy plane")

    def arm(self, point: tuple[float, float], phi: float) -> tuple[float, float]:
        """Return a point of the platform (m) seen from P in the base frame, the platform being turned by phi (rad)."""
        cosine, sine = math.cos(phi), math.sin(phi)
        return cosine * point[0] - sine * point[1], sine * point[0] + cosine * point[1]

    def joint_vector(self, active: Vector, passive: Vector) -> Vector:
        """Return the tree's vector (nv,) of what active joints (n,) and passive joints (n_d,) have."""
        whole = np.empty(self.tree.nv)
        whole[self.active], whole[self.passive] = active, passive
        return whole


class LinkInertia(NamedTuple):
    """Mass (kg), its centre (m) along the link from the link's joint, and moment of inertia (kg m^2) about it."""

    mass: float
    centre: float
    inertia: float

    def spatial(self) -> Any:
        """Return it as Pinocchio's inertia in the frame of the link's joint, x along the link, z out of the plane."""
        return pin.Inertia(self.mass, np.array([self.centre, 0.0, 0.0]), np.diag([0.0, 0.0, self.inertia]))
