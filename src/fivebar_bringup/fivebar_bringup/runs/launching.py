# SPDX-License-Identifier: Apache-2.0
"""The processes that launch files start: the same run as `fivebar run`, its nodes one by one, and the robot in RViz.

With the system's interpreter, so nothing is imported here that only an environment of `packaging/jazzy.sh` has.
"""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from fivebar_bringup.drives.hardware import Hardware
from fivebar_bringup.graph.node_spec import Mode
from fivebar_description.files import share_file
from fivebar_description.interface import BASE_FRAME, frame_prefix
from fivebar_description.modules import module_command
from fivebar_description.ros_environment import domain_of_environment

AS_IN_A_RUN, YES, NO = "auto", "true", "false"
"""Whether a launch has a part of the graph: as a run of the scenario has it, certainly, or not."""

NO_HARDWARE = "none"
"""The hardware of a launch of the control chain alone: plant or bridge are somebody else's."""


class ControlRequest(NamedTuple):
    """A request for what `control.launch.py` starts, in words that go through JSON.

    Attributes:
        scenario: by name or path.
        mode: how time advances.
        hardware: plant or bridge, or `NO_HARDWARE`.
        drives, port: of a bridge, "" for the default and for none.
        activate: whether the bridge enables the drives as soon as all nodes are ready.
        stay: whether the simulated robot rests after its motion and takes requests.
        shutdown: whether the launch ends with the run.
        record: directory of a run for the bag, "" for none.
        imu, camera: whether there are the IMU listener, and the camera with its listener.
        scene: whether there are pictures.
        composed: whether the control chain shares a process.
        cell: whether it is a robot of a cell, which has one clock for all in lockstep.
        parameters: that all nodes get, by name.
    """

    scenario: str
    mode: str = Mode.LOCKSTEP.value
    hardware: str = NO_HARDWARE
    drives: str = ""
    port: str = ""
    activate: bool = False
    stay: bool = False
    shutdown: bool = False
    record: str = ""
    imu: str = AS_IN_A_RUN
    camera: str = AS_IN_A_RUN
    scene: bool = False
    composed: str = AS_IN_A_RUN
    cell: bool = False
    parameters: Mapping[str, Any] = {}


class LaunchedProcess(NamedTuple):
    """A process of the graph as a launch file starts it.

    Attributes:
        name: that of its node, or of its group of nodes.
        package, executable: that run it.
        arguments: of the executable.
        parameter_file: the text of its parameter file.
        lifecycle: whether its node has a lifecycle.
        ends_run: whether the run ends with it, as with a plant that stops after the motion.
    """

    name: str
    package: str
    executable: str
    arguments: tuple[str, ...]
    parameter_file: str
    lifecycle: bool
    ends_run: bool


def installed_command(environment: Mapping[str, str] = os.environ) -> tuple[str, ...]:
    """Return the words that start `fivebar`: its executable where colcon has installed it, else its module.

    `ros2 launch` runs on the system's interpreter; the executable has that of the environment which colcon built with.
    """
    for prefix in environment.get("AMENT_PREFIX_PATH", "").split(os.pathsep):
        executable = Path(prefix, "lib", "fivebar_bringup", "fivebar")
        if prefix and os.access(executable, os.X_OK):
            return (str(executable),)
    return tuple(module_command("fivebar_bringup.cli.entry"))


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
    activate: bool = False,
) -> tuple[str, ...]:
    """Return the command of a run in the DDS domain of the shell, so that ROS tools in that shell see the nodes.

    It starts, watches and stops the nodes, records the bag and writes the report; its exit status is 0 if the run
    succeeded. It is interrupted when the process that calls this ends. What cannot go together it refuses, such as a
    motor board without a port.

    Raises:
        InputError: ROS_DOMAIN_ID is no domain.
    """
    words = [*installed_command(environment), "run", scenario, "--domain", str(domain_of_environment(environment))]
    # a launch that is terminated or killed leaves its processes behind
    words += ["--parent", str(os.getpid())]
    if mode is Mode.REALTIME and hardware is Hardware.SIMULATED:
        words.append("--realtime")
    if hardware is not Hardware.SIMULATED:
        words += ["--hardware", hardware.value]
    for option, value in (("--drives", drives), ("--port", port)):
        if value:
            words += [option, value]
    for flag, wanted in (("--activate", activate), ("--scene", scene)):
        if wanted:
            words.append(flag)
    if namespace:
        words += ["--namespace", namespace]
    if out:
        words += ["--out", out]
    return tuple(words)


def described_by_command(robot: str, scenario: str) -> str:
    """Return the URDF that `fivebar urdf` prints.

    Raises:
        RuntimeError: there is no such robot or scenario, or its file is wrong; with the command's own words.
    """
    return _printed("urdf", *([robot] if robot else []), *(["--scenario", scenario] if scenario else []))


def described_processes(request: ControlRequest) -> list[LaunchedProcess]:
    """Return the processes that `fivebar nodes` says a launch of the control chain has.

    Raises:
        RuntimeError: there is no such scenario, or what is asked for does not go together, as the command says.
    """
    listed = json.loads(_printed("nodes", request.scenario, "--json", "--launch", json.dumps(request._asdict())))
    return [LaunchedProcess(**{**process, "arguments": tuple(process["arguments"])}) for process in listed]


def _printed(*words: str) -> str:
    done = subprocess.run([*installed_command(), *words], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(done.stderr.strip())
    return done.stdout


def cell_clock(robots: Sequence[str], in_lockstep: bool) -> LaunchedProcess:
    """Return the process of the clock that the robots of a cell share."""
    text = _parameter_file({"robots": list(robots) if in_lockstep else [""]})
    return LaunchedProcess("cell_clock", "fivebar_sim", "cell_clock", (), text, lifecycle=False, ends_run=False)


def recorder_of_cell(recorders: Mapping[str, LaunchedProcess], directory: Path) -> LaunchedProcess:
    """Return one recorder, in a directory for its bag, for those that the robots of a cell would have by themselves."""
    topics: list[str] = []
    nodes: list[str] = []
    simulated = False
    for robot, recorder in recorders.items():
        parameters = yaml.safe_load(recorder.parameter_file)["/**"]["ros__parameters"]
        topics += [name if name.startswith("/") else f"{robot}/{name}" for name in parameters["topics"]]
        nodes += [f"{robot}/{name}" for name in parameters["wait_for_nodes"]]
        simulated = parameters["simulated_time"]
    # /diagnostics is that of all robots
    own = {
        "directory": str(directory.absolute()),
        "topics": list(dict.fromkeys(topics)),
        "wait_for_nodes": nodes,
        "simulated_time": simulated,
    }
    return next(iter(recorders.values()))._replace(parameter_file=_parameter_file(own))


def _parameter_file(parameters: Mapping[str, Any]) -> str:
    """Return the text of a parameter file, in JSON, which is YAML."""
    return json.dumps({"/**": {"ros__parameters": parameters}})


def cell_rviz_configuration(robots: Sequence[str], frame: str) -> str:
    """Return the configuration of RViz for the robots of a cell, in a frame that they are placed in."""
    content = yaml.safe_load(share_file("fivebar_bringup", "rviz", "fivebar.rviz").read_text(encoding="utf-8"))
    manager = content["Visualization Manager"]
    displays = manager["Displays"]
    shown = [_of_robot(display, robot) for robot in robots for display in displays if _topics_in(display)]
    manager["Displays"] = [display for display in displays if not _topics_in(display)] + shown
    manager["Global Options"]["Fixed Frame"] = frame
    return str(yaml.safe_dump(content, sort_keys=False))


def _topics_in(display: Mapping[str, Any]) -> list[str]:
    """Return the keys of a display that name topics."""
    return [key for key in ("Topic", "Description Topic") if key in display]


def _of_robot(display: Mapping[str, Any], robot: str) -> dict[str, Any]:
    """Return a display of the robot in a namespace."""
    own = {key: {**display[key], "Value": f"/{robot}/{display[key]['Value']}"} for key in _topics_in(display)}
    prefix = {"TF Prefix": robot} if "TF Prefix" in display else {}
    return {**display, **own, **prefix, "Name": f"{display['Name']} {robot}"}


def rviz_configuration(namespace: str) -> str:
    """Return the configuration of RViz for a robot in a namespace, "" for none."""
    text = share_file("fivebar_bringup", "rviz", "fivebar.rviz").read_text(encoding="utf-8")
    prefix = frame_prefix(namespace)
    # RViz puts the slash itself
    with_prefix = text.replace('TF Prefix: ""', f'TF Prefix: "{prefix.rstrip("/")}"')
    return with_prefix.replace(f"Fixed Frame: {BASE_FRAME}", f"Fixed Frame: {prefix}{BASE_FRAME}")
