# SPDX-License-Identifier: Apache-2.0
"""Two joints under a controller manager of ros2_control, as far as no ROS is needed: settings, faults and names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from fivebar_control.hardware.inner_loop import InnerLoopSettings, MotorSetPoint
from fivebar_control.hardware.motors_file import DrivenMotor, MotorsFile, load_motors
from fivebar_description.strict_yaml import InputError, StrictModel, validate

WATCHDOG = "command_watchdog"
"""Name of the node that commands zero torque where the bridge no longer does."""

HEARS, SEPARATOR = "hears", ", "
"""Key in the watchdog's report of the publishers whose commands it hears, by their DDS identities, and what is between
two of them."""

EFFORT, GAINS = "effort", "gains"
VALUES = {EFFORT: 1, GAINS: 5}
"""Values of a command for each joint, by what the controller takes."""

FullName = Annotated[str, Field(pattern=r"^(/[A-Za-z_]\w*)+$")]

FAULTS: Mapping[str, tuple[str, str]] = {
    "controller_missing": (
        "Nobody listens to the commands.",
        "Load and activate the controller, check its name in the drives file, then configure again.",
    ),
    "controller_lost": (
        "The controller has gone, or is no longer active.",
        "Activate it again, then reset and enable.",
    ),
    "controller_differs": (
        "The controller has other joints, another order, or commands no effort.",
        "Make its parameters and the drives file agree.",
    ),
    "states_missing": ("No states of the joints arrive.", "Check topic and names in the drives file, then configure."),
    "states_slow": (
        "The broadcaster publishes less often than the run samples.",
        "Raise the update rate of the controller manager, or lower rate_hz.",
    ),
    "states_stale": ("States of the joints no longer arrive.", "Look for the broadcaster, then reset and enable."),
    "states_invalid": (
        "States arrive that lack a joint or have no finite angle.",
        "Look into the hardware component, then reset and enable.",
    ),
    "states_shared": (
        "The graph publishes joints of the same names on the topic of the broadcaster.",
        "Start the graph in a namespace, have the broadcaster use local topics, or rename its joints.",
    ),
    "second_publisher": ("Another program publishes commands of the controller.", "End it, then reset and enable."),
    "command_lost": (
        "The watchdog has commanded zero torque, since the bridge did not.",
        "Look why the bridge hung or died, then reset and enable.",
    ),
    "watchdog_missing": (
        "The node that commands zero torque in the bridge's place is not heard.",
        "Start it with the bridge's drives file, then configure again, or reset and enable.",
    ),
}
"""Meaning and recovery of the faults."""


class DescribedLoop(StrictModel):
    """Section `description`: where the robot is described, and how the parts of its closed loop are named there.

    Attributes:
        topic: on which the URDF is published.
        passive: passive joints of legs 1 and 2.
        tips: the frames of legs 1 and 2 that the loop joins.
    """

    topic: FullName = "/robot_description"
    passive: Annotated[tuple[str, str], Field(strict=False)]
    tips: Annotated[tuple[str, str], Field(strict=False)]


class JointsLink(StrictModel):
    """Section `link` of the drives file.

    Attributes:
        controller: full name of the controller.
        commands: topic of its commands, by default its own topic `commands`.
        takes: what a command has of each joint: `effort` alone, or with `gains` positions, velocities, efforts, kp and
            kd, each of all joints.
        unit: of efforts and gains, Nm or A at the motor's shaft; the torque constant of each motor is between them.
        inner_loop: the drives' own control of angle and speed, where the controller takes gains.
        joints: its joints, in its order. The `id` of a motor is the place of its joint there.
        states: topic on which a broadcaster publishes the joints, among any others and in any order.
        manager: full name of the controller manager.
        description: with it a run waits for controller manager, controller and description, and is refused where the
            described robot is another than the scenario's.
    """

    controller: FullName = "/effort_controller"
    commands: FullName = ""
    takes: Literal["effort", "gains"] = "effort"
    unit: Literal["Nm", "A"] = "Nm"
    inner_loop: InnerLoopSettings = InnerLoopSettings()
    joints: Annotated[tuple[str, str], Field(strict=False)]
    states: FullName = "/joint_states"
    manager: FullName = "/controller_manager"
    description: DescribedLoop | None = None

    @model_validator(mode="before")
    @classmethod
    def _topic_of_controller(cls, content: Any) -> Any:
        if not isinstance(content, Mapping) or content.get("commands"):
            return content
        controller = content.get("controller", cls.model_fields["controller"].default)
        return {**content, "commands": f"{controller}/commands"}

    @model_validator(mode="after")
    def _joints_differ(self) -> Self:
        if self.joints[0] == self.joints[1]:
            raise ValueError(f"joints: {self.joints[0]!r} twice: expected two different ones")
        if self.inner_loop.on and self.takes != GAINS:
            raise ValueError(f"inner_loop: the controller takes no gains: expected takes: {GAINS}")
        return self

    def effort(self, motor: DrivenMotor, torque: float) -> float:
        """Return the effort that is a torque (Nm) at a motor's shaft."""
        return torque / motor.torque_constant if self.unit == "A" else torque

    def torque(self, motor: DrivenMotor, effort: float) -> float:
        """Return the torque (Nm) at a motor's shaft that is an effort."""
        return effort * motor.torque_constant if self.unit == "A" else effort

    def command(self, file: MotorsFile, efforts: Sequence[float], points: Sequence[MotorSetPoint]) -> list[float]:
        """Return the values of a command in the controller's order, from those of q11 and q21; none is NaN.

        Args:
            file: with the places of both joints there.
            efforts: in the unit of the controller.
            points: gains and targets beside them.
        """
        columns: list[tuple[float, ...]] = [(effort,) for effort in efforts]
        if self.takes == GAINS:
            both = zip(efforts, points, strict=True)
            columns = [(point.angle, point.speed, effort, point.kp, point.kd) for effort, point in both]
        ordered = sorted(zip((motor.id for motor in file.pair), columns, strict=True))
        return [column[field] for field in range(len(columns[0])) for _, column in ordered]

    @property
    def zero(self) -> list[float]:
        """The command without torque."""
        return [0.0] * (VALUES[self.takes] * len(self.joints))

    def acting(self, values: Sequence[float]) -> Sequence[float] | None:
        """Return the part of a command that moves the robot, efforts and gains; None for one that is not taken."""
        if len(values) != len(self.zero):
            return None
        return values[2 * len(self.joints) :] if self.takes == GAINS else values


def load_joints(configuration: str) -> tuple[MotorsFile, JointsLink]:
    """Read a configuration by its shipped name or by the path of a YAML file.

    Raises:
        InputError: the file is missing or not a configuration; the text names file and key.
    """
    file = load_motors(configuration)
    link = validate(dict(file.link), JointsLink, f"{configuration}: link")
    for name, motor in zip(("q11", "q21"), file.pair, strict=True):
        if motor.id > 1:
            raise InputError(f"{configuration}: motors: {name}: id: {motor.id}: expected 0 or 1, its place in joints")
    return file, link
