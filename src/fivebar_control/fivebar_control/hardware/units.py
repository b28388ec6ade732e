# SPDX-License-Identifier: Apache-2.0
"""Conversion between a drive's raw values and the joint: counts and rad, units of torque and Nm, speeds."""

from __future__ import annotations

import math
from typing import NamedTuple

from fivebar_control.hardware.configuration import Drive


class Scale(NamedTuple):
    """Factors between a drive's raw values and the joint, all with the joint's sign.

    Attributes:
        counts_per_rad: counts of 0x6064 per rad of the joint.
        home_offset: joint angle (rad) at 0 counts.
        velocity_per_rad_s: units of 0x606C per rad/s of the joint.
        torque_per_nm: units of 0x6071 and 0x6077 per Nm at the joint.
        torque_limit: largest raw torque that may be asked for, in units of 0x6071; not negative.
    """

    counts_per_rad: float
    home_offset: float
    velocity_per_rad_s: float
    torque_per_nm: float
    torque_limit: int


def scale_of(drive: Drive) -> Scale:
    """Return the factors that follow from a drive's configuration."""
    turns = drive.sign * drive.gear_ratio / math.tau
    torque = drive.sign * drive.torque_units_per_rated / (drive.rated_torque_nm * drive.gear_ratio)
    return Scale(
        counts_per_rad=drive.counts_per_revolution * turns,
        home_offset=drive.home_offset_rad,
        velocity_per_rad_s=drive.velocity_units_per_rev_s * turns,
        torque_per_nm=torque,
        torque_limit=math.floor(drive.torque_limit_nm * abs(torque) + 1e-9),
    )


def position_rad(scale: Scale, counts: int) -> float:
    """Return the joint angle (rad) of an encoder reading."""
    return counts / scale.counts_per_rad + scale.home_offset


def velocity_rad_s(scale: Scale, raw: int) -> float:
    """Return the joint velocity (rad/s) of a reading of 0x606C."""
    return raw / scale.velocity_per_rad_s


def torque_nm(scale: Scale, raw: int) -> float:
    """Return the joint torque (Nm) of a reading of 0x6077."""
    return raw / scale.torque_per_nm


def torque_raw(scale: Scale, torque: float) -> int:
    """Return the value of 0x6071 nearest to a joint torque (Nm), within the limit.

    Raises:
        ValueError: the torque is not finite; limiting it would turn it into the limit.
    """
    if not math.isfinite(torque):
        raise ValueError(f"torque {torque} Nm: expected a finite number")
    limit = scale.torque_limit
    return round(max(-limit, min(limit, torque * scale.torque_per_nm)))
