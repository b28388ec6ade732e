# SPDX-License-Identifier: Apache-2.0
"""A robot as SDFormat, made from its URDF: the same links and joints, and a joint more that closes the loop.

SDFormat has no joint angles: where the links are when the model is loaded is where all joints are at 0. The links are
placed in a posture with the loop closed, so angles count from that posture, which a comment in the file tells.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from xml.etree.ElementTree import Comment, Element, SubElement

from fivebar_description.interface import ACTIVE_JOINTS, BASE_FRAME, JOINTS
from fivebar_description.robot_description import COLOURS, LOOP_FRAME, NO_RANGE, PLATFORM_FRAME, xml_text

VERSION = "1.8"

LOOP_JOINT = "loop"
"""Joint between the tip of leg 1 and the platform."""

BASE_MASS = "1.0"
"""Mass of the base (kg), which is fixed to the world; SDFormat wants one."""


def sdf_text(tree: Element, home: Sequence[float]) -> str:
    """Return the SDF of a robot.

    Args:
        tree: its URDF.
        home: angles of the four joints in which it is loaded (rad).
    """
    root = Element("sdf", version=VERSION)
    model = SubElement(root, "model", name=tree.get("name", ""))
    angles = dict(zip(JOINTS, home, strict=True))
    model.append(Comment(_remark(angles)))
    joints = {_end(joint, "child"): joint for joint in tree.findall("joint")}
    links: dict[str, Element] = {}
    for link in tree.findall("link"):
        name = link.get("name", "")
        joint = joints.get(name)
        if joint is not None and joint.get("type") == "fixed" and link.find("inertial") is None:
            # a link without mass is a frame, and its shapes are those of the link that carries it
            parent = _end(joint, "parent")
            frame = SubElement(model, "frame", name=name, attached_to=parent)
            _pose(frame, joint, parent)
            links[name] = links[parent]
            _shapes(links[name], link, name)
            continue
        links[name] = SubElement(model, "link", name=name)
        if joint is None:
            SubElement(SubElement(links[name], "inertial"), "mass").text = BASE_MASS
            mount = SubElement(model, "joint", name="base_mount", type="fixed")
            SubElement(mount, "parent").text, SubElement(mount, "child").text = "world", BASE_FRAME
        else:
            _inertial(links[name], link)
            SubElement(links[name], "pose", relative_to=joint.get("name", ""))
            _joint(model, joint, angles)
        _shapes(links[name], link, name)
    _closing_joint(model, PLATFORM_FRAME, links[PLATFORM_FRAME].get("name", ""))
    return xml_text(root)


def _joint(model: Element, joint: Element, angles: Mapping[str, float]) -> None:
    """Add a joint whose link is turned by its angle where the model is loaded."""
    name, kind, parent = joint.get("name", ""), joint.get("type", ""), _end(joint, "parent")
    element = SubElement(model, "joint", name=name, type=kind)
    _pose(element, joint, parent, angles.get(name, 0.0))
    SubElement(element, "parent").text, SubElement(element, "child").text = parent, _end(joint, "child")
    if kind != "revolute":
        return
    axis = _axis(element)
    limits, of_joint = SubElement(axis, "limit"), joint.find("limit")
    assert of_joint is not None
    values = {key: float(of_joint.get(key, "")) for key in ("lower", "upper", "effort", "velocity")}
    if (values["lower"], values["upper"]) != NO_RANGE:
        for key in ("lower", "upper"):
            SubElement(limits, key).text = repr(values[key] - angles[name])
    # what is left out is unlimited
    if name in ACTIVE_JOINTS:
        for key in ("effort", "velocity"):
            SubElement(limits, key).text = repr(values[key])
    dynamics = SubElement(axis, "dynamics")
    for urdf_dynamics in joint.findall("dynamics"):
        for key in ("damping", "friction"):
            SubElement(dynamics, key).text = urdf_dynamics.get(key)


def _remark(angles: Mapping[str, float]) -> str:
    sums = ", ".join(f"{name} + {angle!r}" for name, angle in angles.items())
    return (
        " Joint angles count from the posture in which this model is loaded. Those of the URDF and of joint_states are"
        f" {sums} (rad). "
    )


def _closing_joint(model: Element, frame: str, link: str) -> None:
    element = SubElement(model, "joint", name=LOOP_JOINT, type="revolute")
    SubElement(element, "pose", relative_to=frame)
    SubElement(element, "parent").text, SubElement(element, "child").text = LOOP_FRAME, link
    _axis(element)


def _axis(joint: Element) -> Element:
    axis = SubElement(joint, "axis")
    SubElement(axis, "xyz").text = "0 0 1"
    return axis


def _end(joint: Element, end: str) -> str:
    return joint.findall(end)[0].get("link", "")


def _pose(element: Element, of: Element, relative_to: str, turn: float = 0.0) -> None:
    """Add the pose of a URDF's element, turned about z; a joint of an angle has no other rotation."""
    origin = of.find("origin")
    place, angles = ("0 0 0", "0 0 0") if origin is None else (origin.get("xyz"), origin.get("rpy"))
    pose = SubElement(element, "pose", {"relative_to": relative_to} if relative_to else {})
    pose.text = f"{place} {f'0 0 {turn!r}' if turn else angles}"


def _inertial(element: Element, link: Element) -> None:
    for inertial in link.findall("inertial"):
        sdf_inertial = SubElement(element, "inertial")
        _pose(sdf_inertial, inertial, "")
        SubElement(sdf_inertial, "mass").text = inertial.findall("mass")[0].get("value")
        inertia = SubElement(sdf_inertial, "inertia")
        for key, value in inertial.findall("inertia")[0].items():
            SubElement(inertia, key).text = value


def _shapes(element: Element, link: Element, name: str) -> None:
    """Add the shapes of a URDF's link, in the frame of its name."""
    own = element.get("name") == name
    for kind in ("visual", "collision"):
        for number, shape in enumerate(link.findall(kind)):
            sdf_shape = SubElement(element, kind, name=f"{name}_{kind}_{number}")
            _pose(sdf_shape, shape, "" if own else name)
            geometry = SubElement(sdf_shape, "geometry")
            for urdf_solid in shape.findall("geometry/*"):
                solid = SubElement(geometry, urdf_solid.tag)
                for key, value in urdf_solid.items():
                    SubElement(solid, key).text = value
            for material in shape.findall("material"):
                colours = SubElement(sdf_shape, "material")
                for key in ("ambient", "diffuse"):
                    SubElement(colours, key).text = " ".join(map(repr, COLOURS[material.get("name", "")]))
