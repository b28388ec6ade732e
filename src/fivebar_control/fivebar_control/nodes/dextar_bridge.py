# SPDX-License-Identifier: Apache-2.0
"""Lifecycle node for the two CiA 402 drives of a DexTAR on a CAN bus; see `fivebar_control.ros.drive_bridge`."""

from __future__ import annotations

from fivebar_control.hardware.drive_bus import connect
from fivebar_control.ros.drive_bridge import DriveBridge
from fivebar_description.ros.run import run_node


class DextarBridge(DriveBridge):
    """The bridge to two drives on a CAN bus."""

    def __init__(self) -> None:
        """Make the node, unconfigured."""
        super().__init__("dextar_bridge", connect, "dextar_emulated")


def main() -> None:
    """Run the node."""
    run_node(DextarBridge)


if __name__ == "__main__":
    main()
