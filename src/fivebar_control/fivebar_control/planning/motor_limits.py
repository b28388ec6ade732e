# SPDX-License-Identifier: Apache-2.0
"""The limits of a robot's motors, as far as its file has them."""

from __future__ import annotations

import math

from fivebar_control.model.geometry import inverse_geometry
from fivebar_control.planning.limits import MotionLimits
from fivebar_description.forbidden import motor_range
from fivebar_description.interface import ACTIVE_JOINTS
from fivebar_description.robot_description import MotorLimits
from fivebar_description.robot_file import HOME_MODE, RobotFile


def motor_limits(file: RobotFile) -> MotorLimits:
    """Return the limits of a robot's motors, of torque and speed the usual ones where they are not known.

    Angles are limited where postures of one angle alone are forbidden.
    """
    drives, usual = file.drives, MotionLimits()
    limits = MotorLimits(drives.torque_limit or usual.torque, drives.joint_speed_limit or usual.motor_speed)
    home = inverse_geometry(file.five_bar(), HOME_MODE, *file.home_m)
    if not all(map(math.isfinite, home)):
        return limits
    range1, range2 = (motor_range(file.forbidden, joint, getattr(home, joint)) for joint in ACTIVE_JOINTS)
    return limits._replace(range1=range1, range2=range2)
