"""What the launch files start: the same run as `fivebar run`."""

from __future__ import annotations

import os
from collections.abc import Mapping

from fivebar_bringup.runs.graph.node_spec import Hardware, Mode
from fivebar_description.interpreter import module_command
from fivebar_description.ros_environment import domain_of_environment

COMMAND = tuple(module_command("fivebar_bringup.cli.entry"))


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
    words = [*COMMAND, "run", scenario, "--domain", str(domain_of_environment(environment))]
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
