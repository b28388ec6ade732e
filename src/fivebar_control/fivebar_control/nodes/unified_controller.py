# SPDX-License-Identifier: Apache-2.0
"""Publishes the torque of the unified law, which needs no switching."""

from __future__ import annotations

from fivebar_control.ros.controller_node import ControllerNode
from fivebar_description.ros.run import run_node


class UnifiedController(ControllerNode):
    """The unified law: one law on the singular locus and off it."""

    def __init__(self) -> None:
        """Make the node."""
        super().__init__("unified_controller", "unified_middle")


def main() -> None:
    """Run the node."""
    run_node(UnifiedController)


if __name__ == "__main__":
    main()
