# SPDX-License-Identifier: Apache-2.0
"""A robot file from a URDF, whose closed loop is given by the names of its joints and of the frames that it joins.

A URDF is a tree: it has both legs, and says nowhere that their tips meet. Joint placements, axes and inertias are those
that Pinocchio reads, with all that is fixed to a link as part of it.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from fivebar_bringup.robots.new_robot import home_of
from fivebar_description.errors import InputError, unwrapped
from fivebar_description.interface import ACTIVE_JOINTS
from fivebar_description.robot_description import LOOP_FRAME, PLATFORM_FRAME, UNLIMITED
from fivebar_description.robot_file import RobotFile
from fivebar_description.strict_yaml import parse_versioned, validate, yaml_text
from fivebar_description.urdf import JOINT_RANGE

Vector = NDArray[np.float64]
Pair = tuple[str, str]

PARALLEL = 1e-6
"""Largest deviation of the product of two unit axes from 1."""

BESIDE = 1e-6
"""Distance (m) of a centre of mass from its link's line up to which it counts as on it."""

WIDTH = 0.1
"""rad/s, of the smoothing of Coulomb friction."""


class LoopNames(NamedTuple):
    """Names in a URDF, of leg 1 (left) and leg 2: joints of the motors, passive joints, frames that the loop joins."""

    motors: Pair
    passive: Pair
    tips: Pair


OWN = LoopNames(ACTIVE_JOINTS, ("q12", "q22"), (LOOP_FRAME, PLATFORM_FRAME))
MOTKIN = LoopNames(("motor_1", "motor_2"), ("passive_1", "passive_2"), ("closing_tip_2", "closing_tip_1"))
KNOWN = (OWN, MOTKIN)
"""Names that need not be given: those of `fivebar model`, and those of the MOTKIN bench's stack."""


class FoundRobot(NamedTuple):
    """The text of a robot file, and what the URDF does not tell, a line each."""

    text: str
    untold: tuple[str, ...]


class LegInUrdf(NamedTuple):
    """A leg in the plane.

    Attributes:
        proximal, distal: lengths (m).
        zero: angle (rad) of the crank where its joint is at 0, from the line between the motors.
        sign: +1 where the joint's angle grows as that angle does, else -1.
        near, far: what motor and passive joint move.
    """

    proximal: float
    distal: float
    zero: float
    sign: int
    near: MovedBody
    far: MovedBody


class LoopInUrdf(NamedTuple):
    """The closed loop that a URDF describes: names, both legs, and the distance between the motors' axes (m)."""

    names: LoopNames
    legs: tuple[LegInUrdf, LegInUrdf]
    base: float


class MovedBody(NamedTuple):
    """Mass (kg), centre along the link and beside it (m), inertia about the centre (kg m^2)."""

    mass: float
    centre: float
    beside: float
    inertia: float


def robot_from_urdf(text: str, source: str, name: str, named: dict[str, Pair]) -> FoundRobot:
    """Return a robot file of a URDF.

    Args:
        text: of the URDF.
        source: of it, by which errors begin.
        name: of the robot.
        named: fields of `LoopNames` that are given; the others have names that are known.

    Raises:
        InputError: it is no URDF, a name is not in it, or it describes no planar five-bar.
    """
    joints = _joints_of(text, source)
    text, untold = _text_of(loop_in_urdf(text, source, named), joints, name)
    try:
        file = validate(parse_versioned(text, source), RobotFile, source)
        x, y = home_of(file.five_bar())
    except InputError as error:
        raise InputError(f"{error}: the URDF describes no five-bar that can be moved") from error
    return FoundRobot(f"{text}home_m: [{x}, {y}]\n", untold)


def loop_in_urdf(text: str, source: str, named: dict[str, Pair]) -> LoopInUrdf:
    """Return the closed loop of a URDF, seen so that the z axis of the link that bears the first motor points upwards.

    Args:
        text: of the URDF.
        source: of it, by which errors begin.
        named: fields of `LoopNames` that are given; the others have names that are known.

    Raises:
        InputError: it is no URDF, a name is not in it, or its legs do not move in one plane.
    """
    joints = _joints_of(text, source)
    names = _names(joints, named, source)
    parent = joints[names.motors[0]].find("parent")
    bearing = "" if parent is None else parent.get("link", "")
    return LoopInUrdf(names, *_legs_of(_model_of(text, source), names, bearing, source))


def _joints_of(text: str, source: str) -> dict[str, ElementTree.Element]:
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise InputError(f"{source}: is not XML: {error}") from error
    if root.tag != "robot":
        raise InputError(f"{source}: <{root.tag}>: expected a URDF, whose root is <robot>")
    return {joint.get("name", ""): joint for joint in root.findall("joint")}


def _names(joints: dict[str, ElementTree.Element], named: dict[str, Pair], source: str) -> LoopNames:
    known = next((names for names in KNOWN if set(names.motors) <= set(joints)), None)
    fields = {} if known is None else known._asdict()
    fields |= named
    for field in LoopNames._fields:
        if field not in fields:
            raise InputError(
                f"--{field}: is missing: the joints of {source} have other names than those that are known"
            )
    names = LoopNames(**fields)
    for option, pair in (("--motors", names.motors), ("--passive", names.passive)):
        for joint in pair:
            if joint not in joints:
                shown = ", ".join(sorted(joints)) or "none"
                raise InputError(f"{source}: joint {joint}: is not there: expected {option} with two of {shown}")
    return names


def _model_of(text: str, source: str) -> Any:
    try:
        return pin.buildModelFromXML(text)
    except Exception as error:  # Pinocchio raises what its parser raises
        raise InputError(f"{source}: is no URDF that Pinocchio reads: {unwrapped(error)}") from error


def _legs_of(model: Any, names: LoopNames, bearing: str, source: str) -> tuple[tuple[LegInUrdf, LegInUrdf], float]:
    """Return both legs, and the distance between the motors' axes (m)."""
    data = model.createData()
    pin.computeJointJacobians(model, data, pin.neutral(model))
    pin.framesForwardKinematics(model, data, pin.neutral(model))
    ids = [
        [_joint_id(model, joint, source) for joint in pair] for pair in zip(names.motors, names.passive, strict=True)
    ]
    for (motor, passive), pair in zip(ids, zip(names.motors, names.passive, strict=True), strict=True):
        if model.parents[passive] != motor:
            raise InputError(f"{source}: joint {pair[1]}: expected on the link that {pair[0]} moves")
    axes = [[_axis(model, data, joint) for joint in leg] for leg in ids]
    z = _upwards(model, data, bearing, axes[0][0])
    for number, leg in enumerate(axes):
        for joint, axis in zip((names.motors[number], names.passive[number]), leg, strict=True):
            if abs(float(axis @ z)) < 1.0 - PARALLEL:
                raise InputError(f"{source}: joint {joint}: its axis is not parallel to that of {names.motors[0]}")
    first, second = (_place(data, leg[0]) for leg in ids)
    across = _in_plane(second - first, z)
    base = float(np.linalg.norm(across))
    if base == 0.0:
        raise InputError(f"{source}: the axes of {names.motors[0]} and {names.motors[1]} are one: expected two")
    x = across / base
    y = np.cross(z, x)
    legs = []
    for (motor, passive), (axis, _), tip in zip(ids, axes, names.tips, strict=True):
        frame = model.getFrameId(tip)
        if frame >= model.nframes:
            raise InputError(f"{source}: frame {tip}: is not there: expected as tips the two that the loop joins")
        if model.frames[frame].parentJoint != passive:
            raise InputError(f"{source}: frame {tip}: expected on the link that {model.names[passive]} moves")
        elbow = _place(data, passive)
        crank = _in_plane(elbow - _place(data, motor), z)
        rod = _in_plane(data.oMf[frame].translation - elbow, z)
        lengths = float(np.linalg.norm(crank)), float(np.linalg.norm(rod))
        if 0.0 in lengths:
            raise InputError(f"{source}: a link between {model.names[motor]} and {tip} has no length")
        near, far = _body(model, data, motor, crank, z), _body(model, data, passive, rod, z)
        zero = math.atan2(float(crank @ y), float(crank @ x))
        legs.append(LegInUrdf(*lengths, zero, 1 if float(axis @ z) > 0.0 else -1, near, far))
    return (legs[0], legs[1]), base


def _upwards(model: Any, data: Any, bearing: str, axis: Vector) -> Vector:
    """Return the plane's normal: the axis of a motor, on the side of the z axis of the link that bears it."""
    side = float(data.oMf[model.getFrameId(bearing)].rotation[:, 2] @ axis)
    return -axis if side < 0.0 else axis


def _joint_id(model: Any, joint: str, source: str) -> int:
    number: int = model.getJointId(joint)
    if number >= model.njoints or model.joints[number].nv != 1 or "JointModelR" not in model.joints[number].shortname():
        raise InputError(f"{source}: joint {joint}: expected a revolute or continuous one")
    return number


def _axis(model: Any, data: Any, joint: int) -> Vector:
    jacobian = pin.getJointJacobian(model, data, joint, pin.ReferenceFrame.WORLD)
    axis: Vector = jacobian[3:, model.idx_vs[joint]]
    return axis / float(np.linalg.norm(axis))


def _place(data: Any, joint: int) -> Vector:
    place: Vector = data.oMi[joint].translation
    return place


def _in_plane(vector: Vector, normal: Vector) -> Vector:
    return vector - float(vector @ normal) * normal


def _body(model: Any, data: Any, joint: int, along: Vector, normal: Vector) -> MovedBody:
    """Return all that a joint moves up to the next one, by the line of its link."""
    inertia, placement = model.inertias[joint], data.oMi[joint]
    centre = _in_plane(placement.rotation @ inertia.lever, normal)
    direction = along / float(np.linalg.norm(along))
    turned = placement.rotation @ inertia.inertia @ placement.rotation.T
    beside = float(np.cross(direction, centre) @ normal)
    return MovedBody(float(inertia.mass), float(centre @ direction), beside, float(normal @ turned @ normal))


def _text_of(loop: LoopInUrdf, joints: dict[str, ElementTree.Element], name: str) -> tuple[str, tuple[str, ...]]:
    """Return a robot file with comments, whose rest is still open, and what the URDF does not tell."""
    names, legs, base = loop
    untold = ["inertia of the rotors and their gears, unless a link has it: add it to proximal_links"]
    untold += ["torque constants, encoders and delays: `drives` of this file, and the drives file"]
    elements = [joints[joint] for joint in names.motors]
    frictions = [_number(element, "dynamics", "friction") for element in elements]
    if None in frictions:
        untold.insert(0, "friction: 0 is written; `fivebar identify` measures it")
    for leg, passive, motor in zip(legs, names.passive, names.motors, strict=True):
        for joint, body in ((motor, leg.near), (passive, leg.far)):
            if abs(body.beside) > BESIDE:
                words = f"the centre of mass of what {joint} moves is {1e3 * body.beside:.3g} mm beside its link's line"
                untold.append(f"{words}, which a robot file cannot say")
    lengths = {"a": base, "l_11": legs[0].proximal, "l_12": legs[0].distal}
    lengths |= {"l_21": legs[1].proximal, "l_22": legs[1].distal}
    f_s11, f_s21 = (value or 0.0 for value in frictions)
    lines = [
        "# from a URDF by `fivebar robot new --urdf`. Keys: docs/reference/robot.schema.json",
        *(
            f"# {joint}: zero_rad {leg.zero!r}, sign {leg.sign:+d}"
            for joint, leg in zip(names.motors, legs, strict=True)
        ),
        "# of the drives file: the angle of the crank where the joint is at 0, from the line between the motors",
        "format: 1",
        yaml_text({"name": name}).rstrip(),
        f"lengths_m: {_section(lengths)}",
        "# mass, centre from the joint along the link, inertia about that",
        "proximal_links:",
        *(f"  leg_{number}: {_section(_link(leg.near, turns=True))}" for number, leg in enumerate(legs, start=1)),
        "distal_links:",
        *(f"  leg_{number}: {_section(_link(leg.far))}" for number, leg in enumerate(legs, start=1)),
        f"friction: {{f_s11: {f_s11!r}, f_s21: {f_s21!r}, f_off11: 0.0, f_off21: 0.0, width_rad_s: {WIDTH}}}",
    ]
    drives = {}
    for key, attribute in (("torque_limit", "effort"), ("joint_speed_limit", "velocity")):
        values = [
            value for element in elements if (value := _number(element, "limit", attribute)) and value < UNLIMITED
        ]
        if len(values) == 2:
            drives[key] = min(values)
    lines += [f"drives: {_section(drives)}"] if drives else []
    ranges = [_forbidden(element, leg, own) for element, leg, own in zip(elements, legs, ACTIVE_JOINTS, strict=True)]
    lines += ["forbidden:", *(text for text in ranges if text)] if any(ranges) else []
    return "\n".join(lines) + "\n", tuple(untold)


def _forbidden(joint: ElementTree.Element, leg: LegInUrdf, own: str) -> str:
    """Return the posture that the range of a motor's joint forbids, "" where it has none."""
    lower, upper = (_number(joint, "limit", end) for end in ("lower", "upper"))
    if joint.get("type") == "continuous" or lower is None or upper is None or upper - lower >= math.tau:
        return ""
    if max(abs(lower), abs(upper)) >= JOINT_RANGE:
        return ""
    ends = sorted(leg.zero + leg.sign * end for end in (lower, upper))
    return f"  - {{name: range of {joint.get('name')}, {own}: [{ends[1]!r}, {ends[0] + math.tau!r}]}}"


def _link(body: MovedBody, turns: bool = False) -> dict[str, float]:
    """Return a link as a robot file has it; what turns about a fixed axis has its inertia about that."""
    inertia = body.inertia + (body.mass * body.beside**2 if turns else 0.0)
    return {"mass_kg": body.mass, "centre_m": body.centre, "inertia_kg_m2": inertia}


def _section(values: dict[str, float]) -> str:
    return "{" + ", ".join(f"{key}: {value!r}" for key, value in values.items()) + "}"


def _number(joint: ElementTree.Element, element: str, attribute: str) -> float | None:
    """Return an attribute of an element in a joint; None where it has none, or no number."""
    child = joint.find(element)
    try:
        value = float("nan" if child is None else child.get(attribute, "nan"))
    except ValueError:
        return None
    return value if math.isfinite(value) else None
