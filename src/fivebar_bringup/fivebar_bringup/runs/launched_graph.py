# SPDX-License-Identifier: Apache-2.0
"""The processes of the node graph for launch files, which start its nodes one by one, among those of others."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from fivebar_bringup.bag import RECORDER
from fivebar_bringup.drives.choice import kind_of, real_drives, write_drive_files, write_real_drives
from fivebar_bringup.drives.hardware import Hardware
from fivebar_bringup.drives.run_files import Rehearsal
from fivebar_bringup.graph.crossing_graph import NO_ROBOT, Bridged, crossing_graph
from fivebar_bringup.graph.node_spec import BRIDGES, EMULATED_ROBOT, PLANT, Mode, NodeSpec, Sharing
from fivebar_bringup.graph.standing import LONGEST, check_takes_goals, standing
from fivebar_bringup.recorded.run_directory import RunDirectory, new_run_directory
from fivebar_bringup.runs.admission import load_admitted
from fivebar_bringup.runs.launching import AS_IN_A_RUN, NO, NO_HARDWARE, YES, ControlRequest, LaunchedProcess
from fivebar_bringup.runs.processes import NODE_GROUP, ProcessSpec, processes
from fivebar_bringup.scenario import Scenario
from fivebar_description.errors import InputError
from fivebar_description.files import is_yaml_path
from fivebar_description.interface import DEFAULT_PRIORITY
from fivebar_description.ros.scheduling import Scheduling
from fivebar_description.scenario_file import scenario_path

PARTS = {"imu": ("imu_listener",), "camera": ("camera", "vision_listener")}
"""The nodes that an argument of a launch leaves out, by its name."""

LONGEST_START = 3600.0
"""Time (s) that plant and emulated robot wait for the others: a launch says nothing about when these are started."""

ARGUMENTS = ("scenario", "mode")
"""Parameters that a launch has arguments for, so that no other value may be set beside them."""


def launched_processes(request: ControlRequest) -> list[LaunchedProcess]:
    """Return the processes of a launch, and write the files that they read.

    Raises:
        InputError: there is no such scenario, its motion is refused, or what is asked for does not go together.
    """
    mode, hardware = _mode(request), request.hardware
    clash = next((name for name in ARGUMENTS if name in request.parameters), None)
    if clash is not None:
        raise InputError(f"parameter {clash}: expected the argument {clash}:= of the launch file instead")
    scenario = load_admitted(request.scenario, request.parameters)
    if request.stay:
        check_takes_goals(scenario)
    run = new_run_directory(Path(request.record), scenario) if request.record else None
    nodes = _graph(request, scenario, mode, run)
    last = LONGEST if request.stay else None
    file = str(scenario_path(request.scenario).absolute()) if is_yaml_path(request.scenario) else request.scenario
    if run is not None:
        file = str(run.scenario.absolute())
    kept = _selected(request, nodes, hardware)
    names = {node.executable for node in kept}
    adapted = [_adapted(node, request, names, file) for node in kept]
    if last is not None:
        adapted = [standing(node, last, scenario) for node in adapted]
    sharing = {YES: Sharing.CHAIN, NO: Sharing.NONE}.get(request.composed)
    specs = processes(adapted, mode, scenario.rate_hz, Scheduling(DEFAULT_PRIORITY), sharing)
    return [_launched(_without(spec, request.parameters)) for spec in specs]


def _mode(request: ControlRequest) -> Mode:
    """Return how time advances, which drives leave no choice of.

    Raises:
        InputError: arguments do not go together.
    """
    on_drives = _on_drives(request)
    if request.port and request.hardware not in (Hardware.USB, Hardware.REAL):
        raise InputError("port: expected together with hardware:=usb or real, and only there")
    for name, value in (("drives", request.drives), ("activate", request.activate)):
        if value and not on_drives:
            raise InputError(
                f"{name}: expected hardware:=emulated, socketcan, usb, external or real, which have drives"
            )
    if request.shutdown and (request.stay or request.hardware != Hardware.SIMULATED):
        raise InputError("shutdown: expected hardware:=simulated without stay:=true, whose plant ends with the motion")
    if request.stay and request.hardware not in (Hardware.SIMULATED, Hardware.EMULATED):
        raise InputError("stay: expected hardware:=simulated or emulated: other robots do not end with their motion")
    return Mode.REALTIME if on_drives else Mode(request.mode)


def _graph(request: ControlRequest, scenario: Scenario, mode: Mode, run: RunDirectory | None) -> Sequence[NodeSpec]:
    """Return the graph of a run of the scenario on the hardware that is asked for."""
    # no recorder is started without a directory, and files of drives are then of this launch only
    folder = Path(tempfile.mkdtemp(prefix="fivebar_launch_")) if run is None and _on_drives(request) else None
    path = run.path if run is not None else folder or Path()
    bag = path / "bag"
    if request.hardware == NO_HARDWARE:
        return crossing_graph(scenario, mode, bag, NO_ROBOT, request.scene)
    if request.hardware == Hardware.SIMULATED:
        return crossing_graph(scenario, mode, bag, scene=request.scene)
    if request.hardware == Hardware.EMULATED:
        rehearsal = Rehearsal(write_drive_files(scenario, path, request.drives or None), ())
        return crossing_graph(scenario, mode, bag, rehearsal, scene=request.scene)
    drives = path / "drives.yaml"
    configuration = request.drives or None
    kind, hardware = kind_of(scenario, configuration), Hardware(request.hardware)
    real = real_drives(scenario, kind, hardware, configuration, request.port or None)
    write_real_drives(scenario, real._replace(activate=request.activate), drives)
    return crossing_graph(scenario, mode, bag, Bridged(str(drives.absolute())), request.scene)


def _on_drives(request: ControlRequest) -> bool:
    return request.hardware not in (NO_HARDWARE, Hardware.SIMULATED)


def _selected(request: ControlRequest, nodes: Sequence[NodeSpec], hardware: str) -> list[NodeSpec]:
    """Return the nodes of a graph that a launch has.

    Raises:
        InputError: it is to have one that the graph lacks.
    """
    names = {node.executable for node in nodes}
    left_out = set() if request.record else {RECORDER}
    for argument, part in PARTS.items():
        wanted = getattr(request, argument)
        if wanted == YES and not names & set(part):
            raise InputError(f"{argument}: a run of {request.scenario} on hardware:={hardware} has none")
        if wanted == NO or (wanted == AS_IN_A_RUN and argument == "imu" and hardware == NO_HARDWARE):
            left_out |= set(part)
    return [node for node in nodes if node.executable not in left_out]


def _adapted(node: NodeSpec, request: ControlRequest, names: set[str], file: str) -> NodeSpec:
    """Return a node that reads a file, and waits for none that the launch does not have, and long for the others."""
    parameters = {**node.parameters}
    if "scenario" in parameters:
        parameters["scenario"] = file
    if "wait_for_nodes" in parameters:
        parameters["wait_for_nodes"] = [name for name in parameters["wait_for_nodes"] if name in names] or [""]
    if node.executable in (PLANT, EMULATED_ROBOT):
        parameters["ready_timeout_s"] = LONGEST_START
    if node.executable == PLANT and request.cell:
        parameters["follows_clock"] = True
    if node.executable in BRIDGES:
        parameters["autostart"] = request.activate
    return node._replace(parameters=parameters)


def _without(spec: ProcessSpec, overridden: Any) -> ProcessSpec:
    """Return a process without the parameters that the launch gives all nodes."""
    nodes = [
        node._replace(parameters={name: value for name, value in node.parameters.items() if name not in overridden})
        for node in spec.nodes
    ]
    return spec._replace(nodes=tuple(nodes))


def _launched(spec: ProcessSpec) -> LaunchedProcess:
    first = spec.nodes[0]
    group = spec.module == NODE_GROUP
    return LaunchedProcess(
        spec.name,
        "fivebar_bringup" if group else first.package,
        NODE_GROUP.rpartition(".")[2] if group else first.executable,
        spec.arguments,
        spec.parameter_file(),
        first.executable in BRIDGES,
        first.executable == PLANT,
    )
