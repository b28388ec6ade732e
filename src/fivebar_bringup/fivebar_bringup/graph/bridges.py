"""The bridges to drives, and which of them a robot needs."""

from __future__ import annotations

from fivebar_bringup.scenario import Scenario
from fivebar_description.known_drives import MOTKIN
from fivebar_description.robot_file import read_robot

BRIDGE, BOARD_BRIDGE = "dextar_bridge", "motkin_bridge"
BRIDGES = (BRIDGE, BOARD_BRIDGE)


def bridge_of(scenario: Scenario) -> str:
    """Return the bridge to the drives of a scenario's robot, those on a CAN bus where its file does not say."""
    return BOARD_BRIDGE if read_robot(scenario.robot).drives.interface == MOTKIN else BRIDGE
