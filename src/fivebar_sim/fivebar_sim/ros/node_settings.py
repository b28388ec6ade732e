# SPDX-License-Identifier: Apache-2.0
"""The settings of the nodes that simulate; those of the simulation itself stand beside its code.

Nothing here needs ROS, so that the description of the graph can be made without it.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

from fivebar_description.settings import Setting
from fivebar_description.shared_settings import (
    LOCKSTEP,
    AwaitedNodes,
    BrakeLimit,
    LastSample,
    ReadyTimeout,
    RunMode,
)

LAST_SAMPLE = 1000

START_JOINTS = (1.6573402912344397, -0.9225800732005386, 1.4842523623553534, 0.9225800732005386)
"""At rest at (0, 0.15) m with the elbows outwards, where the middle crossing starts."""


class PlantNodeSettings(NamedTuple):
    """The plant's node."""

    mode: RunMode = LOCKSTEP
    samples: Annotated[
        int | None,
        Setting(
            f"Number of the last sample. By default that of the plan; {LAST_SAMPLE} where nobody publishes one.",
            "samples",
            at_least=1,
            at_most=100_000_000,
        ),
    ] = None
    initial_joints: Annotated[
        tuple[float, float, float, float] | None,
        Setting(
            "Posture at the start: q11, q12, q21, q22 of a closed loop. By default that of the plan, or at rest at (0,"
            " 0.15) m where nobody publishes one.",
            "rad",
        ),
    ] = None
    wait_for_nodes: AwaitedNodes = ()
    ready_timeout_s: ReadyTimeout = 30.0
    command_timeout_s: Annotated[
        float,
        Setting("Lockstep: longest wait for a torque, on the steady clock.", "s", at_least=0.1, at_most=3600.0),
    ] = 5.0
    freshness_samples: Annotated[
        int,
        Setting(
            "Real time: age of the latest torque beyond which it is a fault.", "samples", at_least=1, at_most=10_000
        ),
    ] = 10
    brake_limit_s: BrakeLimit = 1.1
    follows_clock: Annotated[
        bool,
        Setting("Lockstep: measure a sample only once /clock has come to it, so that robots of a cell share one time."),
    ] = False


class CellClockSettings(NamedTuple):
    """The clock of a cell with several robots."""

    robots: Annotated[
        tuple[str, ...],
        Setting("Namespaces of the robots in lockstep, such as left; none in real time: the time is the system's."),
    ] = ()


class EmulatedRobotSettings(NamedTuple):
    """The emulated drives with the robot that they move, in addition to its gyroscope."""

    emulation: Annotated[
        str, Setting("Bus, drives and robot: a shipped emulation's name or a path to a YAML file.")
    ] = "dextar_emulated"
    samples: LastSample = 0
    inject: Annotated[
        tuple[str, ...], Setting("Faults: seconds since sample 0 and an order, such as '1.2 fault 1'.")
    ] = ()
    wait_for_nodes: AwaitedNodes = ()
    ready_timeout_s: ReadyTimeout = 30.0
