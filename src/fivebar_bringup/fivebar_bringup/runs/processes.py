# SPDX-License-Identifier: Apache-2.0
"""The processes of a run: which nodes share one, and their scheduling and diagnostic thresholds."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import yaml

from fivebar_bringup.graph.node_spec import BRIDGES, EMULATED_ROBOT, PLANT, WATCHDOGS, Mode, NodeSpec, Sharing
from fivebar_bringup.runs.namespace import remapping
from fivebar_description.files import write_file
from fivebar_description.ros.rate_watch import DiagnosticThresholds
from fivebar_description.ros.scheduling import Scheduling
from fivebar_description.settings import to_parameters

CONTROLLERS = "controllers"
"""Name of the process that nodes share: those of the control chain, all between a measurement and its torque, and with
`Sharing.ROBOT` the bridge."""

PACING = (PLANT, *BRIDGES, EMULATED_ROBOT)
"""Nodes that produce the samples at the sampling rate."""

NODE_GROUP = "fivebar_bringup.nodes.node_group"

LATE_PERIODS = 1.5
"""In real time, an answer is late if it comes more than this number of periods after the previous one."""

SLOW = 0.98
"""In real time, a node is slow below this fraction of the sampling rate."""


class ProcessSpec(NamedTuple):
    """One process of a run, and the nodes in it."""

    name: str
    nodes: tuple[NodeSpec, ...]

    @property
    def module(self) -> str:
        """The module that runs it."""
        return self.nodes[0].module if len(self.nodes) == 1 else NODE_GROUP

    @property
    def arguments(self) -> tuple[str, ...]:
        """The arguments of that module."""
        return () if len(self.nodes) == 1 else tuple(node.module for node in self.nodes)

    def prepare(self, folder: Path, namespace: str) -> tuple[str, ...]:
        """Write its parameter file into a folder; return the arguments of its module, with those of ROS."""
        file = folder / f"{self.name}.yaml"
        write_file(file, self.parameter_file())
        return (*self.arguments, "--ros-args", "--params-file", str(file), *remapping(namespace))

    def parameter_file(self) -> str:
        """Return the parameters of its nodes in the format of `--params-file`, for any namespace."""
        if len(self.nodes) == 1:
            return self.nodes[0].parameter_file()
        by_name = {f"/**/{node.executable}": {"ros__parameters": node.parameters} for node in self.nodes}
        # copied by way of JSON: nodes may share a value object, and ROS does not accept YAML aliases
        return yaml.safe_dump(json.loads(json.dumps(by_name)), sort_keys=False)


def processes(
    nodes: Sequence[NodeSpec],
    mode: Mode,
    rate_hz: int,
    scheduling: Scheduling | None = None,
    sharing: Sharing | None = None,
) -> tuple[ProcessSpec, ...]:
    """Return the processes of a graph: one per node, but for those that share one; by default the chain in real time.

    In one process the chain takes less than half the processor time, because its messages pass between nodes
    without DDS. Real time at 500 Hz on two cores depends on that.
    """
    by_the_clock = mode is Mode.REALTIME
    sharing = (Sharing.CHAIN if by_the_clock else Sharing.NONE) if sharing is None else sharing
    timed = [_timed(node, rate_hz, scheduling or Scheduling()) if by_the_clock else node for node in nodes]
    # the bridge first: when the process ends, it switches the drives off before the others stop answering it
    shared = tuple(sorted((node for node in timed if _shares(node, sharing)), key=lambda node: node.in_chain))
    single = (ProcessSpec(node.executable, (node,)) for node in timed if node not in shared)
    return (*([ProcessSpec(CONTROLLERS, shared)] if shared else []), *single)


def _shares(node: NodeSpec, sharing: Sharing) -> bool:
    if sharing is Sharing.ROBOT and node.executable in BRIDGES:
        return True
    return node.in_chain and sharing is not Sharing.NONE


def _timed(node: NodeSpec, rate_hz: int, scheduling: Scheduling) -> NodeSpec:
    """Return a time-critical node with diagnostic thresholds and scheduling parameters, any other node unchanged.

    A watchdog has no rate of its own.
    """
    if node.executable in WATCHDOGS:
        return node._replace(parameters={**node.parameters, **to_parameters(scheduling)})
    if not node.in_chain and node.executable not in PACING:
        return node
    thresholds = DiagnosticThresholds(warn_below_hz=SLOW * rate_hz, late_after_ms=LATE_PERIODS * 1e3 / rate_hz)
    return node._replace(parameters={**node.parameters, **to_parameters(thresholds), **to_parameters(scheduling)})
