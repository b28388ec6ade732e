"""The parameters that describe the IMU, the same for the plant and for the listener."""

from __future__ import annotations

import math

from fivebar_description.imu import ImuDescription
from fivebar_description.ros.node import GraphNode
from fivebar_description.ros.parameters import Spec
from fivebar_description.strict_yaml import InputError

DEFAULT = ImuDescription()

IMU_SPECS = (
    Spec("imu_gravity", DEFAULT.gravity, "Gravity at the robot.", "m/s^2", -100.0, 100.0),
    Spec("imu_bias", list(DEFAULT.bias), "Offset of the accelerometer in its own frame: x, y, z.", "m/s^2"),
    Spec("imu_bandwidth_hz", DEFAULT.bandwidth_hz, "Cut-off of the accelerometer, 0 for none.", "Hz", 0.0, 1e5),
    Spec("imu_range", DEFAULT.range, "Largest acceleration that an axis can measure.", "m/s^2", 1.0, 1e5),
    Spec("imu_mount_x", DEFAULT.mount_x, "Mounting point along the distal link, from the platform.", "m", -1.0, 1.0),
    Spec("imu_mount_y", DEFAULT.mount_y, "Mounting point across the distal link.", "m", -1.0, 1.0),
    Spec("imu_roll", DEFAULT.roll, "Orientation of the IMU in the distal link's frame.", "rad", -math.pi, math.pi),
    Spec("imu_pitch", DEFAULT.pitch, "Orientation of the IMU in the distal link's frame.", "rad", -math.pi, math.pi),
    Spec("imu_yaw", DEFAULT.yaw, "Orientation of the IMU in the distal link's frame.", "rad", -math.pi, math.pi),
)


def declare_imu(node: GraphNode) -> ImuDescription:
    """Declare the IMU's parameters on a node and return their values.

    Raises:
        InputError: a value is not allowed.
    """
    values = {name.removeprefix("imu_"): value for name, value in node.parameters(IMU_SPECS).items()}
    if len(values["bias"]) != 3:
        raise InputError(f"{node.get_name()}: parameter imu_bias: {list(values['bias'])}: expected three numbers")
    return ImuDescription(**values)
