# SPDX-License-Identifier: Apache-2.0
"""Runs several nodes of the graph in one process, each under its own name with its own parameters.

Example: ros2 run fivebar_bringup node_group fivebar_control.nodes.ctc_controller fivebar_control.nodes.blender
--ros-args --params-file nodes.yaml
"""

from __future__ import annotations

import sys
from importlib import import_module

from fivebar_description.executable import HELP, words_of
from fivebar_description.ros.node import GraphNode
from fivebar_description.ros.run import run_nodes
from fivebar_description.ros_environment import BAD_INPUT
from fivebar_description.strict_yaml import InputError


def node_class(module: str) -> type[GraphNode]:
    """Return the node class that a module defines.

    Raises:
        InputError: there is no such module, or it does not define exactly one node.
    """
    try:
        members = vars(import_module(module)).values()
    except ImportError as error:
        raise InputError(f"node_group: {module!r}: expected the module of a node: {error}") from error
    nodes = [
        member
        for member in members
        if isinstance(member, type) and issubclass(member, GraphNode) and member.__module__ == module
    ]
    if len(nodes) != 1:
        raise InputError(f"node_group: {module!r}: defines {len(nodes)} nodes, expected one")
    return nodes[0]


def main() -> None:
    """Run the nodes whose modules are listed before `--ros-args`."""
    modules = words_of(sys.argv)
    if HELP.intersection(modules):
        print(__doc__)
        return
    try:
        if not modules:
            raise InputError("node_group: no node given: expected modules such as fivebar_control.nodes.blender")
        classes = [node_class(module) for module in modules]
    except InputError as error:
        print(error, file=sys.stderr)
        sys.exit(BAD_INPUT)
    run_nodes(classes)


if __name__ == "__main__":
    main()
