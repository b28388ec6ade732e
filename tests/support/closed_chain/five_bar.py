# SPDX-License-Identifier: Apache-2.0
"""The five-bar as a closed chain: the two chains of its URDF with the platform's mass taken off, joined in a point."""

from __future__ import annotations

from typing import Any

import pinocchio as pin

from closed_chain.chain import ChainPlatform, ClosedChain, LinkInertia, Tip
from fivebar_description.parameters import FiveBar
from fivebar_description.urdf import urdf_text


def five_bar_chain(robot: FiveBar, distal: tuple[LinkInertia, LinkInertia] | None = None) -> ClosedChain:
    """Return the chain with q_a = (q11, q21), q_d = (q12, q22) and the platform point (x, y).

    Args:
        robot: its parameters.
        distal: inertia of each distal link, besides the platform mass. None: the reduced model of 1.30, whose distal
            links carry nothing, so that tau_td = 0 and lambda_2 = 0.

    The passive joint q13 of figure 1.11 is the pin between the tips. An end effector that turns with a distal link is
    part of that link's inertia.
    """
    tree: Any = pin.buildModelFromXML(urdf_text(robot._replace(mass=0.0), "five_bar"))
    tree.gravity.setZero()
    for name, link in zip(("q12", "q22"), distal or (), strict=distal is not None):
        tree.inertias[tree.getJointId(name)] = link.spatial()
    platform = ChainPlatform(robot.mass, 0.0, rotates=False)
    return ClosedChain(tree, ("q11", "q21"), (Tip("tip_1"), Tip("tip_2")), platform)
