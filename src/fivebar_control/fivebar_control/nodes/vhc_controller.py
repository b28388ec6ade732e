# SPDX-License-Identifier: Apache-2.0
"""Publishes the candidate torque of a constraint law: u3 (3.35), u2 (3.19), or tau_B (1.29) of multi-model control."""

from __future__ import annotations

from fivebar_control.ros.controller_node import ControllerNode
from fivebar_description.ros.run import run_node


class VhcController(ControllerNode):
    """The law near the locus; by default the virtual holonomic constraint in the Cartesian variable."""

    def __init__(self) -> None:
        """Make the node."""
        super().__init__("vhc_controller")


def main() -> None:
    """Run the node."""
    run_node(VhcController)


if __name__ == "__main__":
    main()
