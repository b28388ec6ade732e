# SPDX-License-Identifier: Apache-2.0
"""The plant's URDF says what the robot file says, read as XML and by Pinocchio."""

from __future__ import annotations

import math
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin
import pytest

from fivebar_description.parameters import FiveBar
from fivebar_description.urdf import urdf_text

Element = ElementTree.Element


@pytest.fixture(scope="module")
def tree(robot: FiveBar) -> Element:
    return ElementTree.fromstring(urdf_text(robot, "some robot"))


def child(element: Element, name: str) -> Element:
    found = element.find(name)
    assert found is not None
    return found


def named(tree: Element, kind: str, name: str) -> Element:
    (found,) = [element for element in tree.findall(kind) if element.get("name") == name]
    return found


def numbers(text: str | None) -> list[float]:
    assert text is not None
    return [float(word) for word in text.split()]


def test_every_joint_is_where_the_parameters_put_it(tree: Element, robot: FiveBar) -> None:
    expected = {
        "q11": ("base_link", "proximal_1", robot.leg1.base_x),
        "q12": ("proximal_1", "distal_1", robot.leg1.proximal),
        "tip_1_joint": ("distal_1", "tip_1", robot.leg1.distal),
        "q21": ("base_link", "proximal_2", robot.leg2.base_x),
        "q22": ("proximal_2", "distal_2", robot.leg2.proximal),
        "tip_2_joint": ("distal_2", "tip_2", robot.leg2.distal),
    }
    assert tree.get("name") == "some robot"
    assert {joint.get("name") for joint in tree.findall("joint")} == set(expected)
    for name, (parent, link, at_x) in expected.items():
        joint = named(tree, "joint", name)
        assert child(joint, "parent").get("link") == parent
        assert child(joint, "child").get("link") == link
        assert numbers(child(joint, "origin").get("xyz")) == [at_x, 0.0, 0.0]
        assert child(joint, "origin").get("rpy") == "0 0 0"
        assert joint.get("type") == ("fixed" if name.startswith("tip") else "revolute")
        if joint.get("type") == "revolute":
            assert numbers(child(joint, "axis").get("xyz")) == [0.0, 0.0, 1.0]
            limit = child(joint, "limit")
            lower, upper = (numbers(limit.get(side))[0] for side in ("lower", "upper"))
            assert lower < -2.0 * math.pi < 2.0 * math.pi < upper


def test_motors_carry_pure_inertias_and_tips_half_the_mass(tree: Element, robot: FiveBar) -> None:
    for number, leg in ((1, robot.leg1), (2, robot.leg2)):
        proximal = child(named(tree, "link", f"proximal_{number}"), "inertial")
        assert numbers(child(proximal, "mass").get("value")) == [0.0]
        assert numbers(child(proximal, "inertia").get("izz")) == [leg.inertia]
        distal = child(named(tree, "link", f"distal_{number}"), "inertial")
        assert numbers(child(distal, "mass").get("value")) == [robot.mass / 2.0]
        assert numbers(child(distal, "origin").get("xyz")) == [leg.distal, 0.0, 0.0]
        assert numbers(child(distal, "inertia").get("izz")) == [0.0]


def test_pinocchio_reads_the_same_robot(robot: FiveBar) -> None:
    model = pin.buildModelFromXML(urdf_text(robot, "robot"))
    assert list(model.names) == ["universe", "q11", "q12", "q21", "q22"]
    assert list(model.parents) == [0, 0, 1, 0, 3]
    placements = [placement.translation.tolist() for placement in model.jointPlacements][1:]
    assert placements == [
        [robot.leg1.base_x, 0.0, 0.0],
        [robot.leg1.proximal, 0.0, 0.0],
        [robot.leg2.base_x, 0.0, 0.0],
        [robot.leg2.proximal, 0.0, 0.0],
    ]
    for number, leg in ((1, robot.leg1), (2, robot.leg2)):
        proximal, distal = model.inertias[2 * number - 1], model.inertias[2 * number]
        assert proximal.mass == 0.0
        assert proximal.inertia[2, 2] == leg.inertia
        assert distal.mass == robot.mass / 2.0
        # Pinocchio adds the tip link's empty inertia, which costs the lever its last bit
        assert distal.lever.tolist() == pytest.approx([leg.distal, 0.0, 0.0], rel=1e-15)
        np.testing.assert_array_equal(distal.inertia, np.zeros((3, 3)))
        tip = model.frames[model.getFrameId(f"tip_{number}")]
        assert tip.parentJoint == 2 * number
        assert tip.placement.translation.tolist() == [leg.distal, 0.0, 0.0]


def test_length_and_mass_survive_as_text_to_the_last_bit(dextar: FiveBar) -> None:
    awkward = dextar._replace(leg1=dextar.leg1._replace(proximal=0.1 + 0.2, inertia=1.0 / 3.0), mass=2.0 / 3.0)
    model = pin.buildModelFromXML(urdf_text(awkward, "robot"))
    assert model.jointPlacements[2].translation[0] == 0.1 + 0.2
    assert model.inertias[1].inertia[2, 2] == 1.0 / 3.0
    assert model.inertias[2].mass == 1.0 / 3.0
