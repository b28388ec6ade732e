# SPDX-License-Identifier: Apache-2.0
"""Conversion between the board's values and the joint: readings and rad, currents and Nm."""

from __future__ import annotations

import math

from fivebar_description.whole_turns import nearest_turn
from fivebar_motkin.board_file import BoardDrive


def joint_angle(drive: BoardDrive, reading: float, near: float) -> float:
    """Return the joint angle (rad) of the board's reading (rad), of all turns the one nearest to an angle.

    An encoder of N counts says in which of N intervals the angle lies. The estimator expects the interval's lower edge;
    a board that counts the other way round rounds to the upper one.
    """
    counts = round(reading * drive.counts_per_revolution / math.tau)
    if drive.sign < 0:
        counts += 1
    return nearest_turn(drive.zero_rad + drive.sign * counts * math.tau / drive.counts_per_revolution, near)


def joint_torque(drive: BoardDrive, current: float) -> float:
    """Return the torque (Nm) of a current (A) of the board."""
    return drive.sign * drive.torque_constant * current


def current_limit(drive: BoardDrive) -> float:
    """Return the largest current (A) that may be commanded, of a motor's limits of torque and current."""
    return min(drive.torque_limit_nm / drive.torque_constant, drive.current_limit)


def motor_current(drive: BoardDrive, torque: float) -> float:
    """Return the board's current (A) for a torque (Nm), within the limits of both.

    Raises:
        ValueError: the torque is not finite; limiting it would turn it into the limit.
    """
    if not math.isfinite(torque):
        raise ValueError(f"torque {torque} Nm: expected a finite number")
    limited = max(-drive.torque_limit_nm, min(drive.torque_limit_nm, torque))
    current = drive.sign * limited / drive.torque_constant
    return max(-drive.current_limit, min(drive.current_limit, current))
