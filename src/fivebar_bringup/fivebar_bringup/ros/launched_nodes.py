# SPDX-License-Identifier: Apache-2.0
"""The nodes of the graph as actions of ROS' own launch, among those of others."""

from __future__ import annotations

from collections.abc import Sequence
from tempfile import NamedTemporaryFile
from typing import Any

from launch.actions import EmitEvent, RegisterEventHandler
from launch.event_handlers import OnProcessExit
from launch.events import Shutdown
from launch.events.process import ProcessExited
from launch.launch_context import LaunchContext
from launch.launch_description_entity import LaunchDescriptionEntity
from launch_ros.actions import LifecycleNode, Node

from fivebar_bringup.runs.launching import LaunchedProcess

STOP_TIMEOUT = "60"
"""Time (s) for a node to stop in order after an interrupt; a recorder first writes what it has received."""


def launched_nodes(
    processes: Sequence[LaunchedProcess], namespace: str, parameters: dict[str, Any], ends: bool
) -> list[LaunchDescriptionEntity]:
    """Return the actions that start processes of the graph.

    Args:
        processes: what is started.
        namespace: of their nodes, within what is pushed around them.
        parameters: that they get besides.
        ends: whether the launch shuts down with the run.
    """
    actions: list[LaunchDescriptionEntity] = []
    for process in processes:
        node = _node(process, namespace, parameters)
        actions.append(node)
        if ends and process.ends_run:
            actions.append(RegisterEventHandler(OnProcessExit(target_action=node, on_exit=_shut_down)))
    return actions


def _shut_down(event: ProcessExited, context: LaunchContext) -> list[LaunchDescriptionEntity]:
    """Shut the launch down, once: launch_ros takes a second shutdown for an error."""
    return [] if context.is_shutdown else [EmitEvent(event=Shutdown(reason=f"{event.process_name} has ended"))]


def _node(process: LaunchedProcess, namespace: str, parameters: dict[str, Any]) -> Node:
    options: dict[str, Any] = {
        "package": process.package,
        "executable": process.executable,
        "namespace": namespace,
        "arguments": list(process.arguments),
        "parameters": [_file(process), *([parameters] if parameters else [])],
        "output": "screen",
        "sigterm_timeout": STOP_TIMEOUT,
        "exec_name": process.name,
    }
    if process.lifecycle:
        return LifecycleNode(name=process.name, **options)
    return Node(**options)


def _file(process: LaunchedProcess) -> str:
    """Write the parameter file of a process, as launch_ros does with parameters; return its path."""
    with NamedTemporaryFile(
        "w", prefix=f"fivebar_{process.name}_", suffix=".yaml", encoding="utf-8", delete=False
    ) as file:
        file.write(process.parameter_file)
    return file.name
