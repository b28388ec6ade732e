# SPDX-License-Identifier: Apache-2.0
"""The pinhole camera with Brown-Conrady distortion: where a point of the world is in a picture, and back.

Frame of the camera: x to the right and y down in the picture, z along the optical axis. Pixel coordinates are those of
OpenCV and ROS: (0, 0) is the *centre* of the upper left pixel.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_description.camera import CameraSettings

Points = NDArray[np.float64]
Vector3 = tuple[float, float, float]

UNDISTORT_STEPS = 20

LENS_MODEL = "plumb_bob"
"""Name of the model in a CameraInfo."""


class Optics(NamedTuple):
    """Focal lengths and principal point (px), and the coefficients of the lens."""

    fx: float
    fy: float
    cx: float
    cy: float
    k1: float = 0.0
    k2: float = 0.0
    p1: float = 0.0
    p2: float = 0.0
    k3: float = 0.0

    def matrix(self) -> Points:
        """Return the camera matrix K, [3, 3]."""
        return np.array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])

    def projection(self) -> Points:
        """Return the projection matrix [K | 0], [3, 4]."""
        return np.column_stack((self.matrix(), np.zeros(3)))

    def distortion(self) -> Points:
        """Return k1, k2, p1, p2, k3: the coefficients of a CameraInfo with `LENS_MODEL`."""
        return np.array([self.k1, self.k2, self.p1, self.p2, self.k3])

    def distorted(self, rays: Points) -> Points:
        """Return the rays (x / z, y / z) as the lens bends them, both [n, 2]."""
        x, y = rays[:, 0], rays[:, 1]
        r2 = x * x + y * y
        radial = 1.0 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3))
        bent_x = x * radial + 2.0 * self.p1 * x * y + self.p2 * (r2 + 2.0 * x * x)
        bent_y = y * radial + self.p1 * (r2 + 2.0 * y * y) + 2.0 * self.p2 * x * y
        return np.column_stack((bent_x, bent_y))

    def pixels(self, rays: Points) -> Points:
        """Return the pixel coordinates of rays (x / z, y / z), both [n, 2]."""
        return self.distorted(rays) * (self.fx, self.fy) + (self.cx, self.cy)

    def rays(self, pixels: Points) -> Points:
        """Return the rays (x / z, y / z) of pixel coordinates, both [n, 2].

        The lens has no closed inverse: what it adds is taken off again and again until it stays the same.
        """
        bent = (pixels - (self.cx, self.cy)) / (self.fx, self.fy)
        rays = bent.copy()
        for _ in range(UNDISTORT_STEPS):
            change = bent - self.distorted(rays)
            rays += change
            if float(np.abs(change).max(initial=0.0)) < 1e-13:
                break
        return rays


class CameraPose(NamedTuple):
    """Where the camera is: a point p of the world has the coordinates R p + t in its frame.

    Attributes:
        rotation: R, [3, 3].
        translation: t, [3] (m).
    """

    rotation: Points
    translation: Points

    @staticmethod
    def looking_down(place: Vector3, roll: float = 0.0, pitch: float = 0.0, yaw: float = 0.0) -> CameraPose:
        """Return the pose at a place (m) that looks down, then turned about its own x, y and z axes (rad)."""
        down = np.diag([1.0, -1.0, -1.0])
        cx, sx, cy, sy = math.cos(roll), math.sin(roll), math.cos(pitch), math.sin(pitch)
        cz, sz = math.cos(yaw), math.sin(yaw)
        about_x = np.array([[1.0, 0.0, 0.0], [0.0, cx, -sx], [0.0, sx, cx]])
        about_y = np.array([[cy, 0.0, sy], [0.0, 1.0, 0.0], [-sy, 0.0, cy]])
        about_z = np.array([[cz, -sz, 0.0], [sz, cz, 0.0], [0.0, 0.0, 1.0]])
        rotation = (about_z @ about_y @ about_x).T @ down
        return CameraPose(rotation, -rotation @ np.array(place))

    def centre(self) -> Points:
        """Return the camera's place in the world, [3] (m)."""
        return -self.rotation.T @ self.translation

    def rays(self, points: Points) -> Points:
        """Return the rays (x / z, y / z), [n, 2], of points of the world, [n, 3] (m)."""
        seen = points @ self.rotation.T + self.translation
        rays: Points = seen[:, :2] / seen[:, 2:]
        return rays

    def on_plane(self, rays: Points, height: float) -> Points:
        """Return where rays (x / z, y / z) meet the plane z = height (m): x, y, both [n, 2]."""
        towards = np.column_stack((rays, np.ones(len(rays)))) @ self.rotation
        centre = self.centre()
        reach = (height - centre[2]) / towards[:, 2]
        points: Points = centre[:2] + reach[:, np.newaxis] * towards[:, :2]
        return points


def nominal_optics(settings: CameraSettings) -> Optics:
    """Return the projection onto a camera's picture; pixel (0, 0) is centred on the upper left pixel."""
    s = settings
    centre = (s.width - 1) / 2.0, (s.height - 1) / 2.0
    return Optics(s.focal, s.focal, *centre, s.k1, s.k2, s.p1, s.p2, s.k3)


def nominal_pose(settings: CameraSettings) -> CameraPose:
    """Return where a camera is and where it looks."""
    s = settings
    return CameraPose.looking_down((s.x, s.y, s.z), s.roll, s.pitch, s.yaw)


def square_corners(edge: float) -> Points:
    """Return the corners of a tag of an edge (m) about its centre, [4, 2], in the order of OpenCV.

    That is clockwise as one looks at the tag, from its upper left corner, y of the robot upwards.
    """
    half = 0.5 * edge
    return np.array([[-half, half], [half, half], [half, -half], [-half, -half]])


def placed(corners: Points, x: float, y: float, angle: float) -> Points:
    """Return points [n, 2] that are turned by an angle (rad) and moved to (x, y) (m)."""
    c, s = math.cos(angle), math.sin(angle)
    moved: Points = corners @ np.array([[c, s], [-s, c]]) + np.array([x, y])
    return moved
