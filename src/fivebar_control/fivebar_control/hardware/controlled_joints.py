# SPDX-License-Identifier: Apache-2.0
"""Two joints under a controller manager of ros2_control, as far as no ROS is needed: settings, faults and names."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Self

from pydantic import Field, model_validator

from fivebar_control.hardware.motors_file import MotorsFile, load_motors
from fivebar_description.strict_yaml import InputError, StrictModel, validate

WATCHDOG = "command_watchdog"

HEARS, SEPARATOR = "hears", ", "
"""Key in the watchdog's report of the publishers whose commands it hears, by their DDS identities, and what is between
two of them."""
"""Name of the node that commands zero torque where the bridge no longer does."""

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


class JointsLink(StrictModel):
    """Section `link` of the drives file.

    Attributes:
        controller: full name of the controller, which takes torques (Nm) on its topic `commands`.
        joints: its joints, in its order. The `id` of a motor is the place of its joint there.
        states: topic on which a broadcaster publishes the joints, among any others and in any order.
        manager: full name of the controller manager.
    """

    controller: FullName = "/effort_controller"
    joints: Annotated[tuple[str, str], Field(strict=False)]
    states: FullName = "/joint_states"
    manager: FullName = "/controller_manager"

    @property
    def commands(self) -> str:
        """The topic of the controller's commands."""
        return f"{self.controller}/commands"

    @model_validator(mode="after")
    def _joints_differ(self) -> Self:
        if self.joints[0] == self.joints[1]:
            raise ValueError(f"joints: {self.joints[0]!r} twice: expected two different ones")
        return self


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
