# SPDX-License-Identifier: Apache-2.0
"""A node of the graph: what runs it, its parameters and its topics."""

from __future__ import annotations

from enum import StrEnum
from importlib import import_module
from typing import Any, NamedTuple

from fivebar_control import executables
from fivebar_description.executable import Executable
from fivebar_description.interface import Topic


class Mode(StrEnum):
    """How time advances: with each torque command (lockstep), or with the clock (real time)."""

    LOCKSTEP = "lockstep"
    REALTIME = "realtime"


class Sharing(StrEnum):
    """Groups of nodes that share a process."""

    NONE = "none"
    CHAIN = "chain"
    """The control chain."""
    ROBOT = "robot"
    """The control chain and the bridge to the robot: a torque is written to the drives before its sample is
    published to other processes."""


PLANT = "plant"
EMULATED_ROBOT = "emulated_robot"
BRIDGES = tuple(name for name in vars(executables) if name.endswith("_bridge"))
"""The nodes of `fivebar_control` that connect drives to the graph."""

WATCHDOGS = ("command_watchdog",)
SCENE_NODE = "scene"


class NodeSpec(NamedTuple):
    """One node of the graph; its name is that of its executable.

    Attributes:
        package, executable: ROS package and executable that run it.
        parameters: values of its parameters.
        subscribes, publishes: its topics.
        in_chain: whether it belongs to the control chain, between a measurement and its torque.
    """

    package: str
    executable: str
    parameters: dict[str, Any]
    subscribes: tuple[Topic, ...]
    publishes: tuple[Topic, ...]
    in_chain: bool = False

    @property
    def module(self) -> str:
        """The Python module that runs the node, as the executables of its package have it."""
        program: Executable = getattr(import_module(f"{self.package}.executables"), self.executable)
        return program.module

    def parameter_file(self) -> str:
        """Return the node's parameters in the format of `--params-file`, for any namespace."""
        # here, because commands need the enumerations only
        import yaml

        return yaml.safe_dump({"/**": {"ros__parameters": self.parameters}}, sort_keys=False)
