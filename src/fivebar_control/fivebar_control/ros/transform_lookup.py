# SPDX-License-Identifier: Apache-2.0
"""Places in frames outside the graph, looked up by tf2 where it is installed."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from rclpy.node import Node
from rclpy.time import Time

from fivebar_description.static_frames import Vector


class TransformLookup:
    """Listens to transforms while a place is looked up, and not otherwise: they may come by the thousand."""

    def __init__(self, node: Node) -> None:
        """Look up on behalf of a node, once there is something to look up."""
        self._node = node
        self._tf2: Any = None
        self._buffer: Any = None
        self._listener: Any = None

    def begin(self) -> bool:
        """Listen to transforms; return whether tf2 is installed."""
        if self._listener is None:
            try:
                self._tf2 = import_module("tf2_ros")
            except ImportError:
                return False
            self._buffer = self._tf2.Buffer()
            self._listener = self._tf2.TransformListener(self._buffer, self._node)
        return True

    def found(self, base: str, frame: str, point: Vector) -> Vector | None:
        """Return a point (m) of a frame in another one by the newest transform; None while there is none."""
        try:
            transform = self._buffer.lookup_transform(base, frame, Time()).transform
        except self._tf2.TransformException:
            return None
        shift, turn = transform.translation, transform.rotation
        x, y, z = rotated((turn.x, turn.y, turn.z, turn.w), point)
        return x + shift.x, y + shift.y, z + shift.z

    def end(self) -> None:
        """Listen no more."""
        if self._listener is not None:
            self._listener.unregister()
        self._listener = self._buffer = None


def rotated(quaternion: tuple[float, float, float, float], point: Vector) -> Vector:
    """Return a point that is turned by a unit quaternion x, y, z, w."""
    qx, qy, qz, qw = quaternion
    x, y, z = point
    # t = 2 q x p, p + w t + q x t
    tx, ty, tz = 2.0 * (qy * z - qz * y), 2.0 * (qz * x - qx * z), 2.0 * (qx * y - qy * x)
    return (
        x + qw * tx + qy * tz - qz * ty,
        y + qw * ty + qz * tx - qx * tz,
        z + qw * tz + qx * ty - qy * tx,
    )
