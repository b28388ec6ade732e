# SPDX-License-Identifier: Apache-2.0
"""The URDF for tools of ROS: the frames of the interface, links that never meet, and the motion of the model.

Pinocchio and MuJoCo read it, each with its own parser.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from itertools import combinations
from xml.etree import ElementTree

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import NDArray

from fivebar_bringup.runs.description import described_robot
from fivebar_control.model.dynamics import inverse_dynamics
from fivebar_control.model.geometry import inverse_geometry
from fivebar_control.model.state import State
from fivebar_description.closed_loop import ClosedLoop
from fivebar_description.files import share_file
from fivebar_description.imu import ImuSettings
from fivebar_description.interface import BASE_FRAME, CAMERA_FRAME, IMU_FRAME, JOINTS, PICTURE_FRAME
from fivebar_description.mass_split import split_masses
from fivebar_description.parameters import FiveBar
from fivebar_description.robot_description import LOOP_FRAME, PLATFORM_FRAME, link_width, robot_description
from fivebar_description.robot_file import DistalLink, DistalLinks, read_robot
from fivebar_description.strict_yaml import InputError
from fivebar_description.urdf import urdf_text

Vector = NDArray[np.float64]
Vectors = Callable[[State], tuple[Vector, Vector]]
States = Callable[[int, int], list[State]]
Element = ElementTree.Element

MOUNTED = ImuSettings(mount_x=0.01, mount_y=-0.02, roll=0.3, pitch=-0.2, yaw=1.1)
PLANAR = slice(0, 2)


@pytest.fixture(scope="module")
def text(robot: FiveBar) -> str:
    return robot_description(robot, "some robot", MOUNTED)


@pytest.fixture(scope="module")
def tree(text: str) -> Element:
    return ElementTree.fromstring(text)


class OpenTree:
    """Pinocchio's model of the tree, and the motions of it that keep the loop closed."""

    def __init__(self, text: str) -> None:
        self.model = pin.buildModelFromXML(text)
        self.model.gravity.setZero()
        self.data = self.model.createData()
        self.ends = tuple(self.model.getFrameId(name) for name in (LOOP_FRAME, PLATFORM_FRAME))

    def gap_jacobian(self, q: Vector) -> Vector:
        pin.computeJointJacobians(self.model, self.data, q)
        pin.updateFramePlacements(self.model, self.data)
        frame = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        one, two = (pin.getFrameJacobian(self.model, self.data, end, frame)[PLANAR] for end in self.ends)
        return np.asarray(one - two)

    def motion(self, q: Vector) -> Vector:
        """Return [4, 2]: the rates of all joints for those of the motors."""
        jacobian = self.gap_jacobian(q)
        rates = np.zeros((4, 2))
        rates[[0, 2]] = np.eye(2)
        rates[[1, 3]] = -np.linalg.solve(jacobian[:, [1, 3]], jacobian[:, [0, 2]])
        return rates


def test_it_is_a_tree_of_the_named_frames_with_the_joints_of_joint_states(tree: Element) -> None:
    links = [str(link.get("name")) for link in tree.findall("link")]
    joints = tree.findall("joint")
    parents = {joint.find("child").get("link"): joint.find("parent").get("link") for joint in joints}
    assert len(set(links)) == len(links)
    assert len(parents) == len(joints) == len(links) - 1
    assert set(links) - set(parents) == {BASE_FRAME}
    assert {IMU_FRAME, PLATFORM_FRAME, LOOP_FRAME, "left_motor", "right_motor", CAMERA_FRAME, PICTURE_FRAME} <= set(
        links
    )
    assert parents[IMU_FRAME] == PLATFORM_FRAME
    assert tuple(joint.get("name") for joint in joints if joint.get("type") == "revolute") == JOINTS
    declared = {material.get("name") for material in tree.findall("material")}
    assert {material.get("name") for material in tree.findall(".//visual/material")} == declared


def test_moving_links_have_masses_and_inertias_of_real_bodies(tree: Element, robot: FiveBar) -> None:
    masses = []
    for element in tree.findall("link/inertial"):
        values = {key: float(value) for key, value in element.find("inertia").items()}
        moments = sorted(values[key] for key in ("ixx", "iyy", "izz"))
        assert moments[0] > 0.0
        assert moments[2] <= moments[0] + moments[1]
        masses.append(float(element.find("mass").get("value")))
    assert len(masses) == 5
    assert min(masses) > 0.0


def test_the_closed_tree_moves_like_the_model(
    text: str, robot: FiveBar, loop: ClosedLoop, regular_states: States, joint_vectors: Vectors
) -> None:
    opened, random = OpenTree(text), np.random.default_rng(5)
    for state in regular_states(80, 5):
        q, v = joint_vectors(state)
        pin.framesForwardKinematics(opened.model, opened.data, q)
        one, two = (opened.data.oMf[end].translation for end in opened.ends)
        np.testing.assert_allclose(one, two, atol=1e-14)
        np.testing.assert_allclose(two[PLANAR], [state.x, state.y], atol=1e-14)

        rates = opened.motion(q)
        mass = rates.T @ pin.crba(opened.model, opened.data, q) @ rates
        reduced = rates.T @ pin.crba(loop.model, loop.data, q) @ rates
        np.testing.assert_allclose(mass, reduced, rtol=1e-12, atol=1e-15)

        motors = random.uniform(-50.0, 50.0, 2)
        acceleration = loop.acceleration(q, v, np.array([0.1, 0.0, -0.2, 0.0])) + rates @ motors
        torques = rates.T @ pin.rnea(opened.model, opened.data, q, v, acceleration)
        wanted = inverse_dynamics(robot, state, acceleration[0], acceleration[2], 0.0, 0.0)
        np.testing.assert_allclose(torques, wanted, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("kept", [True, False])
def test_links_with_residual_inertia_move_like_their_grouped_parameters(kept: bool) -> None:
    """As they were weighed, and as they are made up where only the sums are known."""
    file = read_robot("motkin")
    robot = file.five_bar()
    posture = inverse_geometry(robot, (1, -1), 0.013, 0.09)
    q = np.array(posture)
    text = robot_description(robot, "motkin", weighed=file.weighed() if kept else None)
    opened, reduced = OpenTree(text), pin.buildModelFromXML(urdf_text(robot, "motkin"))
    reduced.gravity.setZero()
    moments = [float(one.get("izz")) for one in ElementTree.fromstring(text).findall("link/inertial/inertia")]
    assert min(moments) > 0.0
    # the motion that keeps the loop closed, at a posture where it is: the tips' shares of the mass do not matter then
    rates = opened.motion(q)
    mass = rates.T @ pin.crba(opened.model, opened.data, q) @ rates
    wanted = rates.T @ pin.crba(reduced, reduced.createData(), q) @ rates
    np.testing.assert_allclose(mass, wanted, rtol=1e-12)


def weighed_links(robot: FiveBar) -> DistalLinks:
    mass = 0.1 * robot.mass
    one, two = (
        DistalLink(mass_kg=mass, centre_m=0.4 * leg.distal, inertia_kg_m2=mass * leg.distal**2 / 12.0)
        for leg in (robot.leg1, robot.leg2)
    )
    return DistalLinks(leg_1=one, leg_2=two)


def test_weighed_links_keep_the_grouped_parameters(
    robot: FiveBar, loop: ClosedLoop, regular_states: States, joint_vectors: Vectors
) -> None:
    """What is left of the mass matrix is the inertia beyond that of two points, which the model neglects."""
    weighed = weighed_links(robot)
    split = split_masses(robot, 0.01, weighed)
    assert [(body.mass, body.inertia) for body in split.distal] == [
        (link.mass_kg, link.inertia_kg_m2) for link in (weighed.leg_1, weighed.leg_2)
    ]
    opened = OpenTree(robot_description(robot, "weighed", weighed=weighed))
    spin = split_masses(robot, link_width(robot), weighed).platform.inertia
    beyond = [
        link.inertia_kg_m2 - link.mass_kg * link.centre_m * (leg.distal - link.centre_m)
        for leg, link in ((robot.leg1, weighed.leg_1), (robot.leg2, weighed.leg_2))
    ]
    for state in regular_states(20, 7):
        q, _ = joint_vectors(state)
        rates = opened.motion(q)
        turning = rates[[0, 2]] + rates[[1, 3]]
        neglected = turning.T @ np.diag([beyond[0], beyond[1] + spin]) @ turning
        mass = rates.T @ pin.crba(opened.model, opened.data, q) @ rates
        reduced = rates.T @ pin.crba(loop.model, loop.data, q) @ rates
        np.testing.assert_allclose(mass - neglected, reduced, rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"centre_m": 0.2}, "distal_links.leg_2.centre_m: 0.2: expected at most the length of the link, 0.09 m"),
        ({"mass_kg": 9.0}, "distal_links.leg_2: at the elbow it weighs more than all of zz_21R"),
        ({"mass_kg": 0.6, "centre_m": 0.09}, "distal_links: at the platform they weigh more than all of m, 0.537 kg"),
    ],
)
def test_links_heavier_than_the_robot_are_refused(dextar: FiveBar, change: dict[str, float], words: str) -> None:
    links = weighed_links(dextar)
    heavy = links.model_copy(update={"leg_2": links.leg_2.model_copy(update=change)})
    with pytest.raises(InputError, match=re.escape(words)):
        robot_description(dextar, "heavy", weighed=heavy)


def test_the_imu_is_where_its_settings_mount_it(text: str) -> None:
    opened = OpenTree(text)
    pin.framesForwardKinematics(opened.model, opened.data, np.array([0.4, 0.9, 2.0, -1.3]))
    link, sensor = (opened.data.oMf[opened.model.getFrameId(name)] for name in (PLATFORM_FRAME, IMU_FRAME))
    mounted = link.actInv(sensor)
    np.testing.assert_allclose(mounted.translation, [MOUNTED.mount_x, MOUNTED.mount_y, 0.0], atol=1e-15)
    np.testing.assert_allclose(mounted.rotation, np.array(MOUNTED.rotation()), atol=1e-15)
    # x along the distal link, away from the elbow
    np.testing.assert_allclose(link.rotation[:, 0], [math.cos(0.7), math.sin(0.7), 0.0], atol=1e-12)


def heights(link: Element, base: float) -> tuple[float, float]:
    """The lowest and the highest point of a link's obstacles."""
    spans = []
    for element in link.findall("collision"):
        middle = base + float(str(element.find("origin").get("xyz")).split()[2])
        shape = element.find("geometry")[0]
        height = float(shape.get("length") or str(shape.get("size")).split()[2])
        spans.append((middle - 0.5 * height, middle + 0.5 * height))
    return min(low for low, _ in spans), max(high for _, high in spans)


def test_no_two_links_can_ever_meet(text: str, tree: Element) -> None:
    """Every joint turns about z, so what is apart in height stays apart."""
    opened = OpenTree(text)
    pin.framesForwardKinematics(opened.model, opened.data, np.zeros(4))
    spans = {}
    for link in tree.findall("link"):
        name = str(link.get("name"))
        if link.find("collision") is not None:
            height = opened.data.oMf[opened.model.getFrameId(name)].translation[2]
            spans[name] = heights(link, height)
    still, one_body = {BASE_FRAME, "left_motor", "right_motor"}, {"right_distal", PLATFORM_FRAME}
    for one, two in combinations(spans, 2):
        if {one, two} <= still or {one, two} == one_body:
            continue
        assert spans[one][1] < spans[two][0] or spans[two][1] < spans[one][0], (one, two)


def test_mujoco_loads_it_and_finds_the_same_masses(text: str, robot: FiveBar) -> None:
    model = mujoco.MjModel.from_xml_string(text)
    assert tuple(model.joint(number).name for number in range(model.njnt)) == JOINTS
    opened = OpenTree(text)
    data, q = mujoco.MjData(model), np.array([0.4, 0.9, 2.0, -1.3])
    data.qpos[:] = q
    mujoco.mj_forward(model, data)
    assert data.ncon == 0
    mass = np.zeros((4, 4))
    mujoco.mj_fullM(model, data, mass)
    upper = np.triu(pin.crba(opened.model, opened.data, q))
    np.testing.assert_allclose(np.triu(mass), upper, rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize("name", ["dextar", "unequal", "motkin"])
def test_the_shipped_file_is_what_the_parameter_file_gives(name: str) -> None:
    """`fivebar urdf NAME > src/fivebar_description/urdf/NAME.urdf` makes it anew."""
    shipped = share_file("fivebar_description", "urdf", f"{name}.urdf").read_text(encoding="utf-8")
    assert shipped == described_robot(name)
