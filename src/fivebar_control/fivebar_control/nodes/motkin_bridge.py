"""Lifecycle node for the motor board of a MOTKIN bench on USB; see `fivebar_control.ros.drive_bridge`."""

from __future__ import annotations

import functools

from fivebar_control.hardware.board_file import load_board
from fivebar_control.hardware.inner_loop import InnerLoop
from fivebar_control.hardware.motor_board import open_board
from fivebar_control.ros.drive_bridge import DriveBridge, DriveConnection
from fivebar_control.ros.node_settings import BridgeSettings
from fivebar_description.ros.run import run_node

TEND_PERIOD = 0.1
"""Period (s) in which the board is tended, which needs nothing."""


def _load(settings: BridgeSettings) -> DriveConnection:
    board = load_board(settings.drives)
    opening = functools.partial(open_board, board)
    inner_loop = InnerLoop(board) if board.inner_loop.on else None
    return DriveConnection(board.period_us, "period_us", TEND_PERIOD, opening, board.paced_by_commands, inner_loop)


class MotkinBridge(DriveBridge):
    """The bridge to the motor board."""

    def __init__(self) -> None:
        """Make the node, unconfigured."""
        super().__init__("motkin_bridge", _load, "motkin")


def main() -> None:
    """Run the node."""
    run_node(MotkinBridge)


if __name__ == "__main__":
    main()
