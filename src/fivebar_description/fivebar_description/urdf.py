# SPDX-License-Identifier: Apache-2.0
"""The plant's robot: its two open chains as URDF text, made from the robot file.

For tools of ROS there is a URDF with shapes and sensors, :mod:`fivebar_description.robot_description`.

URDF describes trees only, so the loop is left open at the platform: each chain ends in a tip frame and carries half
of the platform mass there. Joining the two tips (see :mod:`fivebar_description.closed_loop`) gives the model of the
grouped parameters exactly: the proximal links are pure inertias about their motor axes, and the distal links carry
their residual inertia, which may be negative, besides the platform mass. A proximal link with a first mass moment has a
mass at its elbow instead, which weighs as much.
"""

from __future__ import annotations

from typing import NamedTuple
from xml.etree import ElementTree

from fivebar_description.parameters import FiveBar, LegParameters, tip_masses

JOINT_RANGE = 12.0
"""Range of every joint, rad: wide enough for windings, since the closed loop is what limits the motion."""


class _Mass(NamedTuple):
    mass: float
    at_x: float
    inertia_z: float


def urdf_text(robot: FiveBar, name: str) -> str:
    """Return the URDF of both chains of a robot (lengths in m, frames as in figure 1.11 of the thesis)."""
    root = ElementTree.Element("robot", name=name)
    ElementTree.SubElement(root, "link", name="base_link")
    for number, (leg, tip_mass) in enumerate(zip(robot[:2], tip_masses(robot), strict=True), start=1):
        _chain(root, number, leg, tip_mass)
    ElementTree.indent(root)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"


def _chain(root: ElementTree.Element, number: int, leg: LegParameters, tip_mass: float) -> None:
    proximal, distal, tip = f"proximal_{number}", f"distal_{number}", f"tip_{number}"
    _link(root, proximal, _proximal(leg))
    _link(root, distal, _Mass(tip_mass, leg.distal, leg.residual))
    ElementTree.SubElement(root, "link", name=tip)
    _revolute(root, f"q{number}1", "base_link", proximal, leg.base_x)
    _revolute(root, f"q{number}2", proximal, distal, leg.proximal)
    _joint(root, f"{tip}_joint", "fixed", distal, tip, leg.distal)


def _proximal(leg: LegParameters) -> _Mass:
    if leg.moment == 0.0:
        return _Mass(0.0, 0.0, leg.inertia)
    # the inertia about the axis stays what it is
    return _Mass(leg.moment / leg.proximal, leg.proximal, leg.inertia - leg.moment * leg.proximal)


def _link(root: ElementTree.Element, name: str, inertial: _Mass) -> None:
    link = ElementTree.SubElement(root, "link", name=name)
    element = ElementTree.SubElement(link, "inertial")
    ElementTree.SubElement(element, "origin", xyz=f"{inertial.at_x!r} 0 0", rpy="0 0 0")
    ElementTree.SubElement(element, "mass", value=repr(inertial.mass))
    ElementTree.SubElement(
        element, "inertia", ixx="0", ixy="0", ixz="0", iyy="0", iyz="0", izz=repr(inertial.inertia_z)
    )


def _joint(
    root: ElementTree.Element, name: str, kind: str, parent: str, child: str, at_x: float
) -> ElementTree.Element:
    joint = ElementTree.SubElement(root, "joint", name=name, type=kind)
    ElementTree.SubElement(joint, "parent", link=parent)
    ElementTree.SubElement(joint, "child", link=child)
    ElementTree.SubElement(joint, "origin", xyz=f"{at_x!r} 0 0", rpy="0 0 0")
    return joint


def _revolute(root: ElementTree.Element, name: str, parent: str, child: str, at_x: float) -> None:
    joint = _joint(root, name, "revolute", parent, child, at_x)
    ElementTree.SubElement(joint, "axis", xyz="0 0 1")
    ElementTree.SubElement(
        joint, "limit", lower=repr(-JOINT_RANGE), upper=repr(JOINT_RANGE), effort="10", velocity="50"
    )
