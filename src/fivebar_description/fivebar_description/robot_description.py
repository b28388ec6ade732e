# SPDX-License-Identifier: Apache-2.0
"""The URDF of a robot for tools of ROS, made from its file: shapes, masses, and the frames of its sensors.

It is the tree of both legs. The loop closes where `left_tip` and `platform` meet, which no URDF can say; joint states
of all four joints, as in `joint_states`, place every link. Links are in layers, stacked in the order of the loop, so
that no link ever meets another and every pin joins neighbours:

    right proximal, on the shaft of motor 2
    right distal, with the platform and the IMU
    left distal
    left proximal, on motor 1
    base plate

The plant has a URDF of its own, :mod:`fivebar_description.urdf`, whose masses are the grouped parameters themselves.
This one moves alike, but its sums round differently, and runs are compared bit for bit.
"""

from __future__ import annotations

import math
from typing import NamedTuple
from xml.etree import ElementTree

from fivebar_description.imu import ImuSettings
from fivebar_description.interface import BASE_FRAME, CAMERA_FRAME, IMU_FRAME, PICTURE_FRAME
from fivebar_description.mass_split import Body, MassSplit, split_masses
from fivebar_description.parameters import FiveBar, LegParameters
from fivebar_description.robot_file import DistalLinks, Links
from fivebar_description.urdf import JOINT_RANGE

Element = ElementTree.Element
Point = tuple[float, float, float]

SIDES = ("left", "right")
"""Names of leg 1 and leg 2, in the names of links."""

PLATFORM_FRAME, LOOP_FRAME = "platform", "left_tip"
"""Frames that the closed loop brings together: the end of the distal link of leg 2, and that of leg 1."""

PITCH, THICKNESS = 0.010, 0.008
"""Height from one layer to the next, and of a link (m)."""

FIRST_LAYER = 0.008
"""Height of the middle of the lowest layer above the base plate (m)."""

LARGEST_WIDTH, WIDTH_SHARE = 0.016, 0.2
"""Width of the links (m): at most this, and at most this share of the shortest length."""

MOTOR_RADIUS, MOTOR_SHARE, MOTOR_HEIGHT = 0.025, 0.4, 0.05
"""Sizes of the motor housings under the base plate (m), and the largest share of their distance."""

PLATE = 0.010
"""Thickness of the base plate (m); its upper side is z = 0."""

CAMERA_HEIGHT = 0.6
"""Nominal height of the camera over the workspace, looking down, the picture's right side towards x (m)."""

COLOURS = {
    "aluminium": (0.75, 0.77, 0.80, 1.0),
    "steel": (0.45, 0.47, 0.50, 1.0),
    "anodised_black": (0.15, 0.16, 0.18, 1.0),
    "left_link": (0.00, 0.45, 0.70, 1.0),
    "right_link": (0.84, 0.37, 0.00, 1.0),
    "sensor": (0.00, 0.62, 0.45, 1.0),
}

UNLIMITED = 1e16
"""Limit of a joint that has none, where URDF wants a number; that of SDFormat by default."""

NO_RANGE = (-JOINT_RANGE, JOINT_RANGE)
"""Range (rad) of a joint of which none is known."""

REMARK = (
    " Limits of q11 and q21 are those of the motors. The passive joints q12 and q22 have no motor, so no effort, and no"
    f" limit of speed, for which {UNLIMITED:g} stands. A range of -{JOINT_RANGE:g} to {JOINT_RANGE:g} rad means that"
    " none is known. "
)


class MotorLimits(NamedTuple):
    """Limits of the motors: torque (Nm) and speed (rad/s) of both, range (rad) of each where it is known."""

    torque: float = UNLIMITED
    speed: float = UNLIMITED
    range1: tuple[float, float] | None = None
    range2: tuple[float, float] | None = None


NO_LIMITS = MotorLimits()


class JointLimits(NamedTuple):
    """The element `limit` of a joint: Nm, rad/s and rad."""

    effort: float
    velocity: float
    range: tuple[float, float]


PASSIVE = JointLimits(0.0, UNLIMITED, NO_RANGE)


class Layers(NamedTuple):
    """Heights of the middles of the links above the base plate (m), each (leg 1, leg 2); the platform is at `tool`."""

    proximal: tuple[float, float]
    distal: tuple[float, float]

    @property
    def tool(self) -> float:
        """Height of the platform, IMU and loop closure: that of the distal link of leg 2."""
        return self.distal[1]


LAYERS = Layers(
    proximal=(FIRST_LAYER, FIRST_LAYER + 3.0 * PITCH), distal=(FIRST_LAYER + PITCH, FIRST_LAYER + 2.0 * PITCH)
)


def link_width(robot: FiveBar) -> float:
    """Return the width of the links (m)."""
    shortest = min(length for leg in (robot.leg1, robot.leg2) for length in (leg.proximal, leg.distal))
    return min(LARGEST_WIDTH, WIDTH_SHARE * shortest)


def robot_description(
    robot: FiveBar,
    name: str,
    imu: ImuSettings | None = None,
    weighed: Links | DistalLinks | None = None,
    limits: MotorLimits = NO_LIMITS,
) -> str:
    """Return the URDF of a robot; the arguments are those of `robot_tree`."""
    return xml_text(robot_tree(robot, name, imu, weighed, limits))


def xml_text(root: Element) -> str:
    """Return an XML document, one element a line."""
    ElementTree.indent(root)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"


def robot_tree(
    robot: FiveBar,
    name: str,
    imu: ImuSettings | None = None,
    weighed: Links | DistalLinks | None = None,
    limits: MotorLimits = NO_LIMITS,
) -> Element:
    """Return the root element of a robot's URDF.

    Args:
        robot: its parameters.
        name: its name.
        imu: how the IMU is mounted, by default at the platform point.
        weighed: its distal links, or all its bodies, where they are known.
        limits: of its motors.

    Raises:
        InputError: the weighed links do not fit the parameters.
    """
    root = Element("robot", name=name)
    root.append(ElementTree.Comment(REMARK))
    for material, colour in COLOURS.items():
        _material(root, material, colour)
    width = link_width(robot)
    split = split_masses(robot, width, weighed)
    _base(root, robot)
    for index, (leg, angles) in enumerate(zip((robot.leg1, robot.leg2), (limits.range1, limits.range2), strict=True)):
        _leg(root, index, leg, split, width, JointLimits(limits.torque, limits.speed, angles or NO_RANGE))
    _platform(root, robot.leg2, split.platform, width)
    _frame(root, IMU_FRAME, PLATFORM_FRAME, *_mounting(imu or ImuSettings()))
    _camera(root, robot)
    return root


def link_shapes(tree: Element) -> dict[str, list[Element]]:
    """Return the elements `visual` of a URDF by the names of their links."""
    return {link.get("name", ""): link.findall("visual") for link in tree.findall("link")}


def _material(root: Element, name: str, colour: tuple[float, ...]) -> None:
    material = ElementTree.SubElement(root, "material", name=name)
    ElementTree.SubElement(material, "color", rgba=_words(colour))


def _base(root: Element, robot: FiveBar) -> None:
    """Add plate and motors; the root has no inertia, which KDL does not allow it."""
    left, right = robot.leg1.base_x, robot.leg2.base_x
    radius = min(MOTOR_RADIUS, MOTOR_SHARE * (right - left))
    base = ElementTree.SubElement(root, "link", name=BASE_FRAME)
    size = (right - left + 2.4 * radius, 2.4 * radius, PLATE)
    _shape(base, "aluminium", _box(size), (0.5 * (left + right), 0.0, -0.5 * PLATE))
    for side, at_x, top in zip(SIDES, (left, right), LAYERS.proximal, strict=True):
        motor = ElementTree.SubElement(root, "link", name=f"{side}_motor")
        housing = _cylinder(radius, MOTOR_HEIGHT)
        _shape(motor, "anodised_black", housing, (0.0, 0.0, -PLATE - 0.5 * MOTOR_HEIGHT))
        # the shaft passes through the layers below its link: seen, but no obstacle
        _shape(motor, "steel", _cylinder(0.3 * radius, top), (0.0, 0.0, 0.5 * top), collides=False)
        _joint(root, f"{side}_motor_mount", "fixed", BASE_FRAME, f"{side}_motor", (at_x, 0.0, 0.0))


def _leg(root: Element, index: int, leg: LegParameters, split: MassSplit, width: float, motor: JointLimits) -> None:
    side, number = SIDES[index], index + 1
    proximal, distal = f"{side}_proximal", f"{side}_distal"
    rise = LAYERS.distal[index] - LAYERS.proximal[index]
    lower = _bar(root, proximal, leg.proximal, width, f"{side}_link", split.proximal[index])
    upper = _bar(root, distal, leg.distal, width, f"{side}_link", split.distal[index])
    _pin(lower, width, (leg.proximal, 0.0, 0.5 * rise))
    at_base = (0.0, 0.0, LAYERS.proximal[index])
    _revolute(root, f"q{number}1", f"{side}_motor", proximal, at_base, leg.coulomb, motor)
    _revolute(root, f"q{number}2", proximal, distal, (leg.proximal, 0.0, rise), 0.0, PASSIVE)
    if index == 0:
        climb = LAYERS.tool - LAYERS.distal[0]
        _pin(upper, width, (leg.distal, 0.0, 0.5 * climb))
        _frame(root, LOOP_FRAME, distal, (leg.distal, 0.0, climb))


def _platform(root: Element, leg: LegParameters, body: Body, width: float) -> None:
    link = ElementTree.SubElement(root, "link", name=PLATFORM_FRAME)
    if body.mass > 0.0:
        _inertial(link, body, width)
    _shape(link, "anodised_black", _cylinder(0.75 * width, THICKNESS), (0.0, 0.0, 0.0))
    _joint(root, "platform_mount", "fixed", "right_distal", PLATFORM_FRAME, (leg.distal, 0.0, 0.0))


def _mounting(imu: ImuSettings) -> tuple[Point, Point]:
    return (imu.mount_x, imu.mount_y, 0.0), (imu.roll, imu.pitch, imu.yaw)


def _camera(root: Element, robot: FiveBar) -> None:
    reach = min(leg.proximal + leg.distal for leg in (robot.leg1, robot.leg2))
    place = (0.5 * (robot.leg1.base_x + robot.leg2.base_x), 0.5 * reach, CAMERA_HEIGHT)
    camera = _frame(root, CAMERA_FRAME, BASE_FRAME, place, (0.0, 0.5 * math.pi, 0.5 * math.pi))
    _shape(camera, "sensor", _box((0.02, 0.04, 0.03)), (-0.01, 0.0, 0.0), collides=False)
    # by the convention of ROS for pictures: z into the picture, x to its right
    _frame(root, PICTURE_FRAME, CAMERA_FRAME, (0.0, 0.0, 0.0), (-0.5 * math.pi, 0.0, -0.5 * math.pi))


def _bar(root: Element, name: str, length: float, width: float, colour: str, body: Body) -> Element:
    """Add a link with round ends and return it."""
    link = ElementTree.SubElement(root, "link", name=name)
    _inertial(link, body, width)
    _shape(link, colour, _box((length, width, THICKNESS)), (0.5 * length, 0.0, 0.0))
    for end in (0.0, length):
        _shape(link, colour, _cylinder(0.5 * width, THICKNESS), (end, 0.0, 0.0))
    return link


def _pin(link: Element, width: float, place: Point) -> None:
    """Add the pin to the next layer, which turns in a bore of the other link: seen, but no obstacle."""
    _shape(link, "steel", _cylinder(0.25 * width, PITCH + THICKNESS + 0.001), place, collides=False)


def _inertial(link: Element, body: Body, width: float) -> None:
    element = ElementTree.SubElement(link, "inertial")
    ElementTree.SubElement(element, "origin", xyz=_words((body.centre, 0.0, 0.0)), rpy="0 0 0")
    ElementTree.SubElement(element, "mass", value=repr(body.mass))
    # only izz takes part in the motion; with these two the three are those of a body that can exist
    across = min(body.mass * (width**2 + THICKNESS**2) / 12.0, body.inertia)
    values = {"ixx": across, "iyy": body.inertia, "izz": body.inertia}
    ElementTree.SubElement(
        element, "inertia", {"ixy": "0", "ixz": "0", "iyz": "0", **{key: repr(value) for key, value in values.items()}}
    )


def _shape(link: Element, colour: str, geometry: Element, place: Point, collides: bool = True) -> None:
    for kind in ("visual", "collision") if collides else ("visual",):
        element = ElementTree.SubElement(link, kind)
        ElementTree.SubElement(element, "origin", xyz=_words(place), rpy="0 0 0")
        ElementTree.SubElement(element, "geometry").append(geometry)
        if kind == "visual":
            ElementTree.SubElement(element, "material", name=colour)


def _box(size: Point) -> Element:
    return Element("box", size=_words(size))


def _cylinder(radius: float, length: float) -> Element:
    return Element("cylinder", radius=repr(radius), length=repr(length))


def _frame(root: Element, name: str, parent: str, place: Point, turn: Point = (0.0, 0.0, 0.0)) -> Element:
    link = ElementTree.SubElement(root, "link", name=name)
    _joint(root, f"{name}_mount", "fixed", parent, name, place, turn)
    return link


def _joint(
    root: Element, name: str, kind: str, parent: str, child: str, place: Point, turn: Point = (0.0, 0.0, 0.0)
) -> Element:
    joint = ElementTree.SubElement(root, "joint", name=name, type=kind)
    ElementTree.SubElement(joint, "parent", link=parent)
    ElementTree.SubElement(joint, "child", link=child)
    ElementTree.SubElement(joint, "origin", xyz=_words(place), rpy=_words(turn))
    return joint


def _revolute(
    root: Element, name: str, parent: str, child: str, place: Point, friction: float, joint_limits: JointLimits
) -> None:
    joint = _joint(root, name, "revolute", parent, child, place)
    ElementTree.SubElement(joint, "axis", xyz="0 0 1")
    effort, velocity, (lower, upper) = joint_limits
    limits = {"lower": lower, "upper": upper, "effort": effort, "velocity": velocity}
    ElementTree.SubElement(joint, "limit", {key: repr(value) for key, value in limits.items()})
    ElementTree.SubElement(joint, "dynamics", damping="0.0", friction=repr(friction))


def _words(values: tuple[float, ...]) -> str:
    return " ".join(map(repr, values))
