# SPDX-License-Identifier: Apache-2.0
"""The planar 3-RRR: a triangular platform on three legs with one motor each, three freedoms (x, y, phi)."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
from closed_chain.chain import ChainPlatform, ClosedChain, LinkInertia, Tip, Vector


class RrrLeg(NamedTuple):
    """Leg i: base O_i and attachment r_PA on the platform (m), link lengths (m), inertias of both links."""

    base: tuple[float, float]
    proximal: float
    distal: float
    proximal_link: LinkInertia
    distal_link: LinkInertia
    attachment: tuple[float, float]


class ThreeRrr(NamedTuple):
    """Three legs and the platform they carry."""

    leg1: RrrLeg
    leg2: RrrLeg
    leg3: RrrLeg
    platform: ChainPlatform


EXAMPLE = ThreeRrr(
    RrrLeg(
        (-0.24, -0.13), 0.200, 0.210, LinkInertia(0.31, 0.09, 1.1e-3), LinkInertia(0.22, 0.11, 0.9e-3), (-0.07, -0.04)
    ),
    RrrLeg(
        (0.26, -0.15), 0.190, 0.220, LinkInertia(0.28, 0.10, 1.0e-3), LinkInertia(0.24, 0.10, 1.0e-3), (0.08, -0.05)
    ),
    RrrLeg((0.02, 0.28), 0.210, 0.200, LinkInertia(0.33, 0.08, 1.2e-3), LinkInertia(0.20, 0.12, 0.8e-3), (0.01, 0.09)),
    ChainPlatform(mass=0.8, inertia=2.6e-3, rotates=True, centre=(0.012, -0.007)),
)
"""A robot with no two equal lengths, its centre of mass beside the controlled point."""


def three_rrr_chain(robot: ThreeRrr = EXAMPLE, welded: bool = False) -> ClosedChain:
    """Return the chain, in a horizontal plane, with q_a = (q11, q21, q31) and the pose (x, y, phi).

    Args:
        robot: its parameters.
        welded: False: q_d = (q12, q22, q32), the tips pinned to the platform. True: the third joints are in the tree
            too, q_d = (q12, q13, q22, q23, q32, q33), and each tip is one body with the platform. Same robot.
    """
    tree: Any = pin.Model()
    tree.gravity.setZero()
    legs = (robot.leg1, robot.leg2, robot.leg3)
    for number, leg in enumerate(legs, start=1):
        proximal = _revolute(tree, f"q{number}1", 0, leg.base)
        tree.appendBodyToJoint(proximal, leg.proximal_link.spatial(), pin.SE3.Identity())
        last = _revolute(tree, f"q{number}2", proximal, (leg.proximal, 0.0))
        tree.appendBodyToJoint(last, leg.distal_link.spatial(), pin.SE3.Identity())
        end = (leg.distal, 0.0)
        if welded:
            last, end = _revolute(tree, f"q{number}3", last, end), (0.0, 0.0)
        tree.addFrame(pin.Frame(f"tip_{number}", last, _placement(end), pin.FrameType.OP_FRAME))
    tips = [Tip(f"tip_{i}", leg.attachment, 0.0 if welded else None) for i, leg in enumerate(legs, start=1)]
    return ClosedChain(tree, ("q11", "q21", "q31"), tips, robot.platform)


def _revolute(tree: Any, name: str, parent: int, at: tuple[float, float]) -> int:
    return int(tree.addJoint(parent, pin.JointModelRZ(), _placement(at), name))


def _placement(at: tuple[float, float]) -> Any:
    return pin.SE3(np.eye(3), np.array([*at, 0.0]))


def inverse_geometry(robot: ThreeRrr, modes: tuple[int, int, int], pose: Vector) -> Vector:
    """Return (q11, q12, q21, q22, q31, q32) rad, each in (-pi, pi], for a pose (x, y, phi) in a working mode.

    A mode is +1 where the leg's elbow lies counter-clockwise of the line from base to attachment; NaN out of reach.
    """
    x, y, phi = pose.tolist()
    angles: list[float] = []
    for leg, mode in zip((robot.leg1, robot.leg2, robot.leg3), modes, strict=True):
        cosine, sine = math.cos(phi), math.sin(phi)
        dx = x + cosine * leg.attachment[0] - sine * leg.attachment[1] - leg.base[0]
        dy = y + sine * leg.attachment[0] + cosine * leg.attachment[1] - leg.base[1]
        bend = (dx * dx + dy * dy - leg.proximal**2 - leg.distal**2) / (2.0 * leg.proximal * leg.distal)
        if not -1.0 <= bend <= 1.0:
            angles += [math.nan, math.nan]
            continue
        q_2 = -mode * math.acos(bend)
        elbow = math.atan2(leg.distal * math.sin(q_2), leg.proximal + leg.distal * math.cos(q_2))
        angles += [math.remainder(math.atan2(dy, dx) - elbow, 2.0 * math.pi), q_2]
    return np.array(angles)
