# SPDX-License-Identifier: Apache-2.0
"""The robot of somebody else's controller manager: waited for, and compared with the robot that a run plans for."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator
from xml.etree import ElementTree

from fivebar_bringup.robots.from_urdf import LoopInUrdf, loop_in_urdf
from fivebar_bringup.scenario import Scenario
from fivebar_control.hardware.controlled_joints import JointsLink, load_joints
from fivebar_control.hardware.motors_file import MotorsFile
from fivebar_control.ros.controller_watch import has_controller
from fivebar_description.errors import InputError
from fivebar_description.interface import ACTIVE_JOINTS, STATE_QOS, Topic
from fivebar_description.parameters import FiveBar
from fivebar_description.robot_file import load_robot
from fivebar_description.ros.domain_member import DomainMember

LONGEST = 300.0
"""Time (s) for which each part of the robot's graph is waited for."""

AT_ONCE = 1.0
"""Time (s) in which what is there is found."""

LENGTH_TOLERANCE = 1e-3
"""Difference (m) of a length that calibration explains."""

ZERO_TOLERANCE = 0.05
"""The same of a joint's zero (rad)."""

SIMULATED = ("gz_", "gazebo", "ignition", "mujoco")
"""Words in the names of hardware plugins whose efforts are torques."""


def await_robot(scenario: Scenario, configuration: str, domain: int) -> None:
    """Wait for the controller manager that a drives file names, and compare the robot that is described beside it.

    Without a section `description` in the drives file nothing is waited for. What is not there at once is named on the
    standard error.

    Args:
        scenario: of the run.
        configuration: drives file of a `JointsLink`, by name or path.
        domain: DDS domain of the controller manager.

    Raises:
        InputError: something is not there in time, or another robot is described; the text names each difference.
    """
    file, link = load_joints(configuration)
    if link.description is None:
        return
    source = link.description.topic
    text = _awaited_description(link, source, domain)
    motors = link.joints[file.motors.q11.id], link.joints[file.motors.q21.id]
    names = {"motors": motors, "passive": link.description.passive, "tips": link.description.tips}
    loop = loop_in_urdf(text, source, names)
    differences = [*_differences(loop, load_robot(scenario.robot), scenario.robot, file, configuration)]
    differences += _unit_differs(text, link, configuration)
    if differences:
        raise InputError(f"{source}: {'; '.join(differences)}")


def _awaited_description(link: JointsLink, topic: str, domain: int) -> str:
    """Return the URDF that is published on a topic, once controller manager, states and controller are there."""
    texts: list[str] = []
    with DomainMember("fivebar_robot_finder", domain) as member:
        node = member.node
        member.listen(Topic(topic, "std_msgs/msg/String", STATE_QOS), lambda message: texts.append(message.data))

        def has_manager() -> bool:
            names = node.get_node_names_and_namespaces()
            return link.manager in {f"{namespace.rstrip('/')}/{name}" for name, namespace in names}

        for part, is_there in (
            (f"controller manager {link.manager}", has_manager),
            (f"joint states on {link.states}", lambda: node.count_publishers(link.states)),
            (f"controller {link.controller}", lambda: has_controller(node, link)),
            (f"robot description on {topic}", lambda: texts),
        ):
            _await(member, part, is_there)
    return texts[-1]


def _await(member: DomainMember, part: str, is_there: Callable[[], object]) -> None:
    if member.wait_for(is_there, AT_ONCE):
        return
    print(f"fivebar: waits for the {part}", file=sys.stderr, flush=True)
    if not member.wait_for(is_there, LONGEST):
        raise InputError(f"{part}: is not there after {LONGEST:g} s: expected the robot's own launch file to start it")


def _differences(loop: LoopInUrdf, robot: FiveBar, name: str, file: MotorsFile, configuration: str) -> Iterator[str]:
    """Return how a described robot differs from the one of a run, in lengths, and in zeros and signs of its joints."""
    lengths = [("a", loop.base, robot.leg2.base_x - robot.leg1.base_x)]
    for number, (leg, own) in enumerate(zip(loop.legs, (robot.leg1, robot.leg2), strict=True), start=1):
        lengths += [(f"l_{number}1", leg.proximal, own.proximal), (f"l_{number}2", leg.distal, own.distal)]
    for key, described, own_length in lengths:
        if abs(described - own_length) > LENGTH_TOLERANCE:
            yield f"{key} is {1e3 * described:.1f} mm, expected {1e3 * own_length:.1f} mm as robot {name} has"
    for leg, joint, active, motor in zip(loop.legs, loop.names.motors, ACTIVE_JOINTS, file.pair, strict=True):
        turned = math.remainder(leg.zero - motor.zero_rad, math.tau)
        if abs(turned) > ZERO_TOLERANCE or leg.sign != motor.sign:
            yield (
                f"{joint} has zero_rad {leg.zero:.4f} and sign {leg.sign:+d}, expected those of {active} in"
                f" {configuration}, {motor.zero_rad:.4f} and {motor.sign:+d}"
            )


def _unit_differs(text: str, link: JointsLink, configuration: str) -> list[str]:
    """Return what is wrong with the unit of efforts, where the hardware's plugin is that of a simulator."""
    plugins = [plugin.text or "" for plugin in ElementTree.fromstring(text).iterfind("ros2_control/hardware/plugin")]
    simulator = next((plugin for plugin in plugins if any(word in plugin.lower() for word in SIMULATED)), None)
    if simulator is None or link.unit == "Nm":
        return []
    return [f"{simulator} takes torques, expected link.unit: Nm in {configuration}"]
