# SPDX-License-Identifier: Apache-2.0
"""Subcommand: view."""

from __future__ import annotations

import os
import sys
from typing import Annotated

import typer

from fivebar_bringup.cli.app import Group, NamespaceOption, command, input_errors
from fivebar_bringup.cli.status import DomainOption, graph_domain
from fivebar_bringup.executables import viewer
from fivebar_bringup.runs.namespace import read_namespace, remapping
from fivebar_description.ros_environment import check_ros_environment


@command(Group.RUN)
def view(
    domain: DomainOption = None,
    namespace: NamespaceOption = "",
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port on 127.0.0.1, 0 for a free one.")] = 0,
) -> None:
    """Show a running robot on a live page in the browser.

    It prints the address of the page, and serves it until Ctrl-C.

    Example: `fivebar view --domain 7`
    """
    with input_errors():
        check_ros_environment()
        remapped = remapping(read_namespace(namespace))
        os.environ["ROS_DOMAIN_ID"] = str(graph_domain(domain))
    sys.argv = ["viewer", "--ros-args", *remapped, "-p", f"port:={port}"]
    viewer()
