"""What the launch files start: the same run as `fivebar run`, or for real drives the same processes."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from fivebar_bringup.runs.admission import load_admitted
from fivebar_bringup.runs.graph.crossing_graph import crossing_graph
from fivebar_bringup.runs.graph.node_spec import Hardware, Mode
from fivebar_bringup.runs.machine_code import compile_for
from fivebar_bringup.runs.namespace import read_namespace
from fivebar_bringup.runs.processes import DEFAULT_PRIORITY, processes
from fivebar_bringup.runs.rehearsal import check_drivable
from fivebar_bringup.runs.run_directory import new_run_directory
from fivebar_description.ros.scheduling import Scheduling

COMMAND = (sys.executable, "-m", "fivebar_bringup.cli.main")


class LaunchedProcess(NamedTuple):
    """A process that a launch file starts: its name and command line."""

    name: str
    command: tuple[str, ...]


def run_command(
    scenario: str,
    mode: Mode,
    out: str,
    hardware: Hardware,
    environment: Mapping[str, str] = os.environ,
    scene: bool = False,
    namespace: str = "",
    drives: str = "",
    port: str = "",
) -> tuple[str, ...]:
    """Return the command of a run in the DDS domain of the shell, so that ROS tools in that shell see the nodes.

    It starts, watches and stops the nodes, records the bag and writes the report; its exit status is 0 if the run
    completed. What cannot go together it refuses, such as a motor board without a port.
    """
    words = [*COMMAND, "run", scenario, "--domain", environment.get("ROS_DOMAIN_ID") or "0"]
    if mode is Mode.REALTIME and hardware is Hardware.SIMULATED:
        words.append("--realtime")
    if hardware is not Hardware.SIMULATED:
        words += ["--hardware", hardware.value]
    for option, value in (("--drives", drives), ("--port", port)):
        if value:
            words += [option, value]
    if scene:
        words.append("--scene")
    if namespace:
        words += ["--namespace", namespace]
    if out:
        words += ["--out", out]
    return tuple(words)


def drive_processes(
    scenario: str, drives: str, out: str, scene: bool = False, namespace: str = ""
) -> tuple[Path, tuple[LaunchedProcess, ...]]:
    """Make the directory of a run on real drives; return it and the processes to start.

    Processes are composed and prioritised as by `fivebar run`: the control chain shares one process with real-time
    priority. The bridge waits to be activated.

    Raises:
        InputError: the scenario cannot be run on drives, or the directory or the namespace cannot be used.
    """
    within = read_namespace(namespace)
    loaded = load_admitted(scenario)
    check_drivable(loaded)
    run = new_run_directory(Path(out) if out else None, loaded)
    run.parameters.mkdir()
    compile_for(loaded, Mode.REALTIME)
    nodes = crossing_graph(loaded, Mode.REALTIME, run.bag, drives=drives, scene=scene)
    started = []
    for process in processes(nodes, Mode.REALTIME, loaded.rate_hz, Scheduling(scheduling_priority=DEFAULT_PRIORITY)):
        arguments = process.prepare(run.parameters, within)
        started.append(LaunchedProcess(process.name, (sys.executable, "-m", process.module, *arguments)))
    return run.path, tuple(started)
