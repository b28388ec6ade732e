# SPDX-License-Identifier: Apache-2.0
"""The robot's motors, encoders and drives, as far as they are known: the section `drives` of a robot file."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from fivebar_description.settings import Setting
from fivebar_description.shared_settings import DelaySamples, EncoderCounts

NO_INTERFACE, CANOPEN, ROS2_CONTROL = "none", "canopen", "ros2_control"
"""Interfaces of drives: none that is known, CANopen drives behind `dextar_bridge`, and joints under a controller
manager of ros2_control; further ones are registered by installed packages, see `fivebar_description.drive_kinds`."""

USUAL_TORQUE_LIMIT = 2.0
"""Largest torque (Nm) of motors of which nothing is declared."""


LARGEST_SPEED = 500.0
"""Largest speed of a joint (rad/s); small motors without a gear do 50."""


class KnownDrives(NamedTuple):
    """Motors, encoders and drives of the robot. What is left out has the default of the setting that it stands for."""

    interface: Annotated[
        str, Setting(f"How the drives are reached: {CANOPEN}, {ROS2_CONTROL}, or the name of an installed interface.")
    ] = NO_INTERFACE
    torque_limit: Annotated[float | None, Setting("Largest torque of either motor.", "Nm", above=0.0, at_most=1e4)] = (
        None
    )
    joint_speed_limit: Annotated[
        float | None, Setting("Largest speed of either motor.", "rad/s", above=0.0, at_most=LARGEST_SPEED)
    ] = None
    encoder_counts: EncoderCounts = None
    delay_samples: DelaySamples = 0
    crossing_torque: Annotated[
        float | None,
        Setting(
            "Largest torque, beyond friction, of a nominal crossing: what the torques of this robot compare with;"
            " where it is not given it follows from `torque_limit` and the inertias.",
            "Nm",
            above=0.0,
            at_most=1e4,
        ),
    ] = None


NO_DRIVES = KnownDrives()
"""Nothing is known."""
