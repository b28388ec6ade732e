# SPDX-License-Identifier: Apache-2.0
"""Publishes the candidate torque u1 of computed torque control (1.24)."""

from __future__ import annotations

from fivebar_control.ros.controller_node import ControllerNode
from fivebar_description.ros.run import run_node


class CtcController(ControllerNode):
    """Computed torque control, the nominal law."""

    def __init__(self) -> None:
        """Make the node."""
        super().__init__("ctc_controller")


def main() -> None:
    """Run the node."""
    run_node(CtcController)


if __name__ == "__main__":
    main()
