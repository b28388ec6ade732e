# SPDX-License-Identifier: Apache-2.0
"""The scope in which a launch file is included: a pushed namespace, and parameters and remappings for all nodes."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml
from launch.launch_context import LaunchContext

from fivebar_description.errors import unwrapped

ALL_NODES = "/**"
"""The name of all nodes in a parameter file."""


def namespace_within(context: LaunchContext, own: str) -> str:
    """Return the namespace of a launch file's nodes: its own one, in those that are pushed around it."""
    pushed = context.launch_configurations.get("ros_namespace", "")
    if own.startswith("/") or not pushed:
        return own
    return f"{pushed.rstrip('/')}/{own}".rstrip("/")


def parameters_for_all(context: LaunchContext) -> dict[str, Any]:
    """Return the parameters by name that SetParameter and SetParametersFromFile have set for all nodes.

    Raises:
        RuntimeError: a parameter file cannot be read.
    """
    parameters: dict[str, Any] = {}
    for parameter in context.launch_configurations.get("global_params", ()):
        if isinstance(parameter, tuple):
            name, value = parameter
            parameters[name] = value if isinstance(value, str | int | float) else list(value)
        else:
            parameters |= _in_file(Path(parameter))
    return parameters


def refuse_what_is_set(context: LaunchContext, file: str) -> None:
    """Refuse what is set around a launch file for the nodes that it starts, where it does not start them itself.

    Raises:
        RuntimeError: something is.
    """
    configurations = context.launch_configurations
    for action, found, instead in (
        ("PushRosNamespace", configurations.get("ros_namespace", "").strip("/"), "its argument namespace:="),
        ("SetParameter", ", ".join(parameters_for_all(context)), "a scenario with these keys"),
        ("SetRemap", ", ".join(f"{old}:={new}" for old, new in configurations.get("ros_remaps", ())), "none"),
    ):
        if found:
            raise RuntimeError(
                f"{file}: {action} {found}: is not honoured here, since `fivebar run` starts the nodes: expected"
                f" {instead}, or control.launch.py"
            )


def _in_file(path: Path) -> dict[str, Any]:
    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, yaml.YAMLError) as error:
        raise RuntimeError(f"{path}: cannot be read: {unwrapped(error)}") from error
    of_all = content.get(ALL_NODES, {}) if isinstance(content, Mapping) else {}
    values = of_all.get("ros__parameters", {}) if isinstance(of_all, Mapping) else {}
    return _flat(values) if isinstance(values, Mapping) else {}


def _flat(values: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Return nested parameters by their names with dots."""
    parameters: dict[str, Any] = {}
    for name, value in values.items():
        parameters |= _flat(value, f"{prefix}{name}.") if isinstance(value, Mapping) else {f"{prefix}{name}": value}
    return parameters
