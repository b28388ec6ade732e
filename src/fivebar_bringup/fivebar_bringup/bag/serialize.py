# SPDX-License-Identifier: Apache-2.0
"""Serializes the graph's messages to CDR from plain values, so that a simulation without ROS writes the same bags.

Floats are stored bit for bit. Stamps are integer nanoseconds, split into the message's seconds and nanoseconds.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from rosbags.typesys.stores import ros2_jazzy as ros

from fivebar_bringup.bag.definitions import TYPESTORE
from fivebar_description.interface import NANOSECONDS
from fivebar_description.joint_sample import JointSample


def joint_state(
    stamp_ns: int,
    names: Sequence[str],
    position: Sequence[float] = (),
    velocity: Sequence[float] = (),
    effort: Sequence[float] = (),
) -> bytes:
    """Return a sensor_msgs/JointState, as nodes publish it; each field has one value per name, or none."""
    return JointSample(stamp_ns, names, position, velocity, effort).cdr()


def imu(
    stamp_ns: int,
    frame: str,
    angular_velocity: Sequence[float],
    linear_acceleration: Sequence[float],
    orientation: Sequence[float] | None = None,
    angular_velocity_covariance: Sequence[float] | None = None,
    linear_acceleration_covariance: Sequence[float] | None = None,
    orientation_covariance: Sequence[float] | None = None,
) -> bytes:
    """Return a sensor_msgs/Imu.

    Angular velocity [3] in rad/s and linear acceleration [3] in m/s^2, both in `frame`; orientation is a quaternion
    (x, y, z, w), None for a sensor without (first element of its covariance -1, as the message definition specifies).
    Covariances are 9 values in row-major order, None for unknown (all zero).
    """
    if orientation is None:
        orientation = (0.0, 0.0, 0.0, 1.0)
        orientation_covariance = (-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    message = ros.sensor_msgs__msg__Imu(
        header=_header(stamp_ns, frame),
        orientation=ros.geometry_msgs__msg__Quaternion(*orientation),
        orientation_covariance=_covariance(orientation_covariance),
        angular_velocity=ros.geometry_msgs__msg__Vector3(*angular_velocity),
        angular_velocity_covariance=_covariance(angular_velocity_covariance),
        linear_acceleration=ros.geometry_msgs__msg__Vector3(*linear_acceleration),
        linear_acceleration_covariance=_covariance(linear_acceleration_covariance),
    )
    return _cdr(message, ros.sensor_msgs__msg__Imu.__msgtype__)


def float64(value: float) -> bytes:
    """Return a std_msgs/Float64."""
    return _cdr(ros.std_msgs__msg__Float64(value), ros.std_msgs__msg__Float64.__msgtype__)


def string(text: str) -> bytes:
    """Return a std_msgs/String."""
    return _cdr(ros.std_msgs__msg__String(text), ros.std_msgs__msg__String.__msgtype__)


def _header(stamp_ns: int, frame: str) -> ros.std_msgs__msg__Header:
    seconds, nanoseconds = divmod(stamp_ns, NANOSECONDS)
    return ros.std_msgs__msg__Header(stamp=ros.builtin_interfaces__msg__Time(seconds, nanoseconds), frame_id=frame)


def _covariance(values: Sequence[float] | None) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    covariance = np.zeros(9) if values is None else np.array(values, dtype=np.float64)
    if covariance.shape != (9,):
        raise ValueError(f"a covariance has 9 values, not {covariance.size}")
    return covariance


def _cdr(message: object, message_type: str) -> bytes:
    return bytes(TYPESTORE.serialize_cdr(message, message_type))
