# SPDX-License-Identifier: Apache-2.0
"""The motion that the nodes' default parameters describe, as messages of any of its samples."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from sensor_msgs.msg import Imu

from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_control.laws.reference import Reference, reference_from_platform
from fivebar_control.model.geometry import inverse_geometry
from fivebar_control.model.kinematics import state_from_joints
from fivebar_control.model.state import State
from fivebar_description.interface import (
    ACTIVE_JOINTS,
    JOINTS,
    REFERENCE_NAMES,
    SUPERVISOR_NAMES,
    sample_stamp_ns,
)
from fivebar_description.ros.messages import joint_state, to_stamp

RATE_HZ = 500

Pair = tuple[float, float]


class MiddleMotion:
    """The middle crossing, with a robot that is a little off its reference and never at rest."""

    def __init__(self) -> None:
        scenario = load_scenario("middle")
        self.robot = scenario.five_bar()
        self.plan = scenario.plan()
        self.crossing = round(self.plan.crossings[0].time * RATE_HZ)
        """The sample nearest to the first crossing of the locus."""

    def joints(self, sample: int) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return measured positions and velocities."""
        x, y, *_ = self.plan.path.at(sample / RATE_HZ)
        offset = 1e-3 * math.sin(sample)
        position = inverse_geometry(self.robot, self.plan.mode, x + offset, y - 0.5 * offset)
        return tuple(position), (0.1 + offset, -0.2, 0.3, -0.4 - offset)

    def state(self, sample: int) -> State:
        position, velocity = self.joints(sample)
        return state_from_joints(self.robot, *position, *velocity)

    def reference(self, sample: int) -> Reference:
        platform = self.plan.path.at(sample / RATE_HZ)
        return reference_from_platform(self.robot, self.plan.mode, platform)

    def joint_states_message(self, sample: int) -> Any:
        position, velocity = self.joints(sample)
        return joint_state(sample_stamp_ns(sample, RATE_HZ), JOINTS, position, velocity, (0.0,) * 4)

    def reference_message(self, sample: int, dx: float = 0.0) -> Any:
        """Return the reference, moved by dx."""
        x, y, vx, vy, ax, ay = self.plan.path.at(sample / RATE_HZ)
        stamp = sample_stamp_ns(sample, RATE_HZ)
        return joint_state(stamp, REFERENCE_NAMES, (x + dx, y, vx, vy), (vx, vy, ax, ay))

    def torque_message(self, sample: int, torque: Sequence[float]) -> Any:
        return joint_state(sample_stamp_ns(sample, RATE_HZ), ACTIVE_JOINTS, effort=torque)

    def supervisor_message(self, sample: int, sigma: float) -> Any:
        return joint_state(sample_stamp_ns(sample, RATE_HZ), SUPERVISOR_NAMES, position=(sigma, 0.1))

    def imu_message(self, sample: int, acceleration: Pair) -> Any:
        message = Imu()
        message.header.stamp = to_stamp(sample_stamp_ns(sample, RATE_HZ))
        message.linear_acceleration.x, message.linear_acceleration.y = acceleration
        message.linear_acceleration.z = 9.80665
        return message
