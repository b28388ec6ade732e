# SPDX-License-Identifier: Apache-2.0
"""Lifecycle node for the motor board of a MOTKIN bench on USB; see `fivebar_control.ros.drive_bridge`."""

from __future__ import annotations

from fivebar_control.ros.drive_bridge import DriveBridge
from fivebar_description.ros.run import run_node
from fivebar_motkin.motor_board import connect


class MotkinBridge(DriveBridge):
    """The bridge to the motor board."""

    def __init__(self) -> None:
        """Make the node, unconfigured."""
        super().__init__("motkin_bridge", connect, "motkin")


def main() -> None:
    """Run the node."""
    run_node(MotkinBridge)


if __name__ == "__main__":
    main()
