# SPDX-License-Identifier: Apache-2.0
"""The frames of a robot's URDF that do not move, and places in them as places in the frame of its base."""

from __future__ import annotations

import math
from typing import NamedTuple
from xml.etree import ElementTree

from fivebar_description.interface import BASE_FRAME

Vector = tuple[float, float, float]
Matrix = tuple[Vector, Vector, Vector]

STRAIGHT: Matrix = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


class PlacedFrame(NamedTuple):
    """Where a frame is in that of the base: its origin (m), and the directions of its axes as columns."""

    origin: Vector
    axes: Matrix

    def to_base(self, point: Vector) -> Vector:
        """Return a point (m) of this frame in that of the base."""
        x, y, z = (
            start + sum(factor * part for factor, part in zip(row, point, strict=True))
            for start, row in zip(self.origin, self.axes, strict=True)
        )
        return x, y, z


def static_frames(urdf: str) -> dict[str, PlacedFrame]:
    """Return the frames that are fixed to the base, by their names; the base is one of them."""
    fixed = [joint for joint in ElementTree.fromstring(urdf).iter("joint") if joint.get("type") == "fixed"]
    frames = {BASE_FRAME: PlacedFrame((0.0, 0.0, 0.0), STRAIGHT)}
    while new := [joint for joint in fixed if _name(joint, "child") not in frames and _name(joint, "parent") in frames]:
        for joint in new:
            parent, origin = frames[_name(joint, "parent")], joint.find("origin")
            place, turn = (_vector(origin, key) for key in ("xyz", "rpy"))
            frames[_name(joint, "child")] = PlacedFrame(parent.to_base(place), _product(parent.axes, _turned(*turn)))
    return frames


def _name(joint: ElementTree.Element, end: str) -> str:
    link = joint.find(end)
    return "" if link is None else link.get("link", "")


def _vector(origin: ElementTree.Element | None, key: str) -> Vector:
    x, y, z = map(float, ("0 0 0" if origin is None else origin.get(key, "0 0 0")).split())
    return x, y, z


def _turned(roll: float, pitch: float, yaw: float) -> Matrix:
    """Return the axes of a frame that is turned about the fixed x, y and z, one after the other."""
    (cr, sr), (cp, sp), (cy, sy) = ((math.cos(angle), math.sin(angle)) for angle in (roll, pitch, yaw))
    return (
        (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
        (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
        (-sp, cp * sr, cp * cr),
    )


def _product(left: Matrix, right: Matrix) -> Matrix:
    columns = tuple(zip(*right, strict=True))
    x, y, z = (tuple(sum(a * b for a, b in zip(row, column, strict=True)) for column in columns) for row in left)
    return (x[0], x[1], x[2]), (y[0], y[1], y[2]), (z[0], z[1], z[2])
