# SPDX-License-Identifier: Apache-2.0
"""Publishes the candidate torque of a law without a node of its own: of the registry, or of another package."""

from __future__ import annotations

from fivebar_control.ros.controller_node import ControllerNode
from fivebar_description.ros.run import run_node


class LawController(ControllerNode):
    """Any law of the registry, or one from another package as MODULE:NAME."""

    def __init__(self) -> None:
        """Make the node."""
        super().__init__("law_controller", "mpc_middle")


def main() -> None:
    """Run the node."""
    run_node(LawController)


if __name__ == "__main__":
    main()
