"""Lifecycle node for the two CiA 402 drives of a DexTAR on a CAN bus; see `fivebar_control.ros.drive_bridge`."""

from __future__ import annotations

import functools

from fivebar_control.hardware.configuration import load_drives
from fivebar_control.hardware.drive_bus import open_drives
from fivebar_control.ros.drive_bridge import DriveBridge, DriveConnection
from fivebar_control.ros.node_settings import BridgeSettings
from fivebar_description.ros.run import run_node


def _load(settings: BridgeSettings) -> DriveConnection:
    drives = load_drives(settings.drives)
    # twice as often as heartbeats are due
    tended = drives.master.heartbeat_ms / 2e3
    return DriveConnection(drives.sync_period_us, "sync_period_us", tended, functools.partial(open_drives, drives))


class DextarBridge(DriveBridge):
    """The bridge to two drives on a CAN bus."""

    def __init__(self) -> None:
        """Make the node, unconfigured."""
        super().__init__("dextar_bridge", _load, "dextar_emulated")


def main() -> None:
    """Run the node."""
    run_node(DextarBridge)


if __name__ == "__main__":
    main()
