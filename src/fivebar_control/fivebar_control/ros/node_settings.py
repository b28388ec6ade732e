# SPDX-License-Identifier: Apache-2.0
"""Settings of the nodes of the control chain beside the run's file: how they are run, not what the robot does.

This module does not import ROS, so that the graph can be described without it.
"""

from __future__ import annotations

import re
from typing import Annotated, NamedTuple

from fivebar_description.settings import Setting
from fivebar_description.shared_settings import LOCKSTEP, REALTIME, AwaitedNodes, LastSample, RunMode

HOLD, CONTINUE = "hold", "continue"

PLANNER = re.compile(r"([A-Za-z_][\w.]*:[A-Za-z_]\w*)?")


def _module_and_name(text: str) -> str | None:
    return None if PLANNER.fullmatch(text) else "expected my_package.my_module:function, or none"


class TrajectorySettings(NamedTuple):
    """The trajectory generator."""

    mode: RunMode = LOCKSTEP
    after_fault: Annotated[
        str,
        Setting(
            "While safety/state reports a fault and after its reset: hold the robot's current position, or continue"
            " with the plan (for lockstep, where runs must be repeatable).",
            choices=(HOLD, CONTINUE),
        ),
    ] = HOLD
    planner: Annotated[
        str,
        Setting(
            "What plans requests, as my_package.my_module:function, in place of the planner of this package: a graph"
            " that `fivebar` starts names the one that finds out how likely they are to succeed.",
            check=_module_and_name,
        ),
    ] = ""


class ProgramSettings(NamedTuple):
    """The program runner."""

    program: Annotated[
        str, Setting("Path of the program that is carried out after the plan; none where it is empty.")
    ] = ""
    begin: Annotated[
        int,
        Setting(
            "Number of instructions of that program that the plan of the run carries out.", at_least=0, at_most=10_000
        ),
    ] = 0
    begin_sample: Annotated[
        int, Setting("Sample from which on the plan of the run is over.", "samples", at_least=0)
    ] = 0


COMPILED_FROM_HZ = 200
"""In real time from this rate on, the control cycle is compiled; below, it takes a small part of a period as it is."""

AUTO, YES, NO = "auto", "yes", "no"

Compiled = Annotated[
    str,
    Setting(
        "Whether the node's part of the control cycle runs as machine code, which is loaded, or compiled, before the"
        f" first sample: by default in real time from {COMPILED_FROM_HZ} Hz on.",
        choices=(AUTO, YES, NO),
    ),
]


class ChainSettings(NamedTuple):
    """The state estimator, the supervisor and the controllers."""

    mode: RunMode = LOCKSTEP
    compiled: Compiled = AUTO


def runs_compiled(mode: str, rate_hz: int, compiled: str = AUTO) -> bool:
    """Return whether a node's part of the control cycle runs as machine code."""
    return mode == REALTIME and rate_hz >= COMPILED_FROM_HZ if compiled == AUTO else compiled == YES


SHORTEST_DEADLINE_MS = 1.0
"""The least that the blender takes for the deadline of the candidates (ms)."""


class BlenderSettings(NamedTuple):
    """The blender."""

    mode: RunMode = LOCKSTEP
    endless: Annotated[
        bool, Setting("Whether samples go on after the motion, as those of drives do; those of a plant end with it.")
    ] = False
    candidate_deadline_ms: Annotated[
        float | None,
        Setting(
            "Timeout for the candidates of a sample, on the steady clock; then zero torque and a fault. By default"
            " follows from the mode and, in real time, from safety.stop_cycles.",
            "ms",
            at_least=SHORTEST_DEADLINE_MS,
            at_most=60_000.0,
        ),
    ] = None
    state_deadline_ms: Annotated[
        float | None,
        Setting(
            "Timeout from one sample to the next, on the steady clock; then zero torque and a fault. By default there"
            " is one in real time only, that of the drives.",
            "ms",
            at_least=SHORTEST_DEADLINE_MS,
            at_most=60_000.0,
        ),
    ] = None
    last_sample: Annotated[
        int | None,
        Setting("Last sample of a run that ends, by default that of the plan of the run.", "samples", at_least=1),
    ] = None
    compiled: Compiled = AUTO


class ImuListenerSettings(NamedTuple):
    """The IMU listener."""

    wait_for_nodes: AwaitedNodes = ()


class WatchdogSettings(NamedTuple):
    """The watchdog of a controller's commands."""

    drives: Annotated[
        str, Setting("Configuration of the joints, that of the bridge: name of a shipped one, or path to a YAML file.")
    ] = "ros2_control"


class BridgeSettings(NamedTuple):
    """The bridge to the drives."""

    drives: Annotated[
        str, Setting("Configuration of bus and drives: name of a shipped one, or path to a YAML file.")
    ] = "dextar_emulated"
    command_timeout_ms: Annotated[
        float | None,
        Setting(
            "Timeout from one torque command to the next, on the steady clock; then zero torque and a fault. By default"
            " follows from safety.stop_cycles.",
            "ms",
            at_least=1.0,
            at_most=10_000.0,
        ),
    ] = None
    enable_timeout_s: Annotated[
        float,
        Setting("Timeout for enabling, disabling or resetting the drives.", "s", at_least=0.1, at_most=60.0),
    ] = 2.0
    autostart: Annotated[bool, Setting("Configure and activate automatically, once the awaited nodes are ready.")] = (
        False
    )
    wait_for_nodes: AwaitedNodes = ()
    samples: LastSample = 0
