# SPDX-License-Identifier: Apache-2.0
"""The section `<ros2_control>` of a robot's URDF: which joints a hardware component commands and reads."""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree.ElementTree import Element, SubElement

from fivebar_description.interface import ACTIVE_JOINTS, JOINTS

MOCK = "mock_components/GenericSystem"
"""Hardware component of ros2_control that moves nothing."""


def add_ros2_control(root: Element, plugin: str, home: Sequence[float], torque_limit: float) -> None:
    """Add the section to a URDF: the motors are commanded by effort, all joints are read.

    Args:
        root: of the URDF.
        plugin: hardware component that stands for the robot.
        home: angles of the four joints at the beginning (rad).
        torque_limit: of both motors (Nm).
    """
    section = SubElement(root, "ros2_control", name="fivebar", type="system")
    SubElement(SubElement(section, "hardware"), "plugin").text = plugin
    for name, angle in zip(JOINTS, home, strict=True):
        joint = SubElement(section, "joint", name=name)
        if name in ACTIVE_JOINTS:
            effort = SubElement(joint, "command_interface", name="effort")
            SubElement(effort, "param", name="min").text = repr(-torque_limit)
            SubElement(effort, "param", name="max").text = repr(torque_limit)
        position = SubElement(joint, "state_interface", name="position")
        SubElement(position, "param", name="initial_value").text = repr(angle)
        SubElement(joint, "state_interface", name="velocity")
