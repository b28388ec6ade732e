"""What the launch files start: the same run as `fivebar run`, and the robot in RViz.

With the system's interpreter, so nothing is imported here that only an environment of `packaging/jazzy.sh` has.
"""

from __future__ import annotations

import os
import subprocess
from collections.abc import Mapping
from pathlib import Path

from fivebar_bringup.graph.node_spec import Hardware, Mode
from fivebar_description.interface import BASE_FRAME, frame_prefix
from fivebar_description.interpreter import module_command
from fivebar_description.ros_environment import domain_of_environment
from fivebar_description.share import share_file


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
    for flag, given in (("--activate", activate), ("--scene", scene)):
        if given:
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
    words = [*installed_command(), "urdf", *([robot] if robot else []), *(["--scenario", scenario] if scenario else [])]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(done.stderr.strip())
    return done.stdout


def rviz_configuration(namespace: str) -> str:
    """Return the configuration of RViz for a robot in a namespace, "" for none."""
    text = share_file("fivebar_bringup", "rviz", "fivebar.rviz").read_text(encoding="utf-8")
    prefix = frame_prefix(namespace)
    # RViz puts the slash itself
    with_prefix = text.replace('TF Prefix: ""', f'TF Prefix: "{prefix.rstrip("/")}"')
    return with_prefix.replace(f"Fixed Frame: {BASE_FRAME}", f"Fixed Frame: {prefix}{BASE_FRAME}")
