# SPDX-License-Identifier: Apache-2.0
"""Lifecycle node for drives of any registered interface; see `fivebar_control.ros.drive_bridge`."""

from __future__ import annotations

from fivebar_control.hardware.connection import connect
from fivebar_control.ros.drive_bridge import DriveBridge
from fivebar_description.ros.run import run_node


class AnyDriveBridge(DriveBridge):
    """The bridge to drives whose configuration names their interface."""

    def __init__(self) -> None:
        """Make the node, unconfigured."""
        super().__init__("drive_bridge", connect, "dextar_emulated")


def main() -> None:
    """Run the node."""
    run_node(AnyDriveBridge)


if __name__ == "__main__":
    main()
