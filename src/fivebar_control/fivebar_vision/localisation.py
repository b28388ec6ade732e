# SPDX-License-Identifier: Apache-2.0
"""The platform's position from the tags of a picture.

The base's tags determine the camera's pose. The rays of the platform tag's corners are then intersected with the plane
of that tag, whose height is known. A 3-D pose from the tag's four corners alone would be ten times less accurate, since
the distance of a tag that is small in the picture is poorly determined.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import cv2
import numpy as np

from fivebar_description.camera import BASE_TAGS, PLATFORM_TAG, CameraSettings
from fivebar_optics.camera_model import CameraPose, Optics, Points, placed, square_corners
from fivebar_vision.detector import Picture, Tag, TagDetector, Window

BASE_INTERVAL = 30
"""Pictures from one search for the base's tags to the next, since the camera stands still."""

LEAST_BASE_TAGS = 2

WINDOW = 1.5
"""Half width of the window in which the platform's tag is searched for first, in edges of the tag."""

LARGEST_MISFIT = 0.03
"""Largest deviation of a tag's corners from a square of its size, in edges; more means a wrong plane or calibration."""

SYSTEMATIC = 0.03
"""Standard deviation (px) of systematic errors, of the lens and the base's tags, which more profiles do not reduce."""


class PlatformSight(NamedTuple):
    """The platform as seen in a picture.

    Attributes:
        x, y: its position (m).
        angle: of the tag (rad).
        variance_x, variance_y, covariance: of the position (m^2).
        row: the picture's row in which it is (px), since rows may be exposed one after the other.
    """

    x: float
    y: float
    angle: float
    variance_x: float
    variance_y: float
    covariance: float
    row: float


def camera_pose(tags: dict[int, Tag], centres: Points, edge: float) -> CameraPose | None:
    """Return the camera's pose from the base's tags; None for fewer than two.

    Args:
        tags: of a picture.
        centres: of the base's tags, [4, 2] (m).
        edge: of their black squares (m).
    """
    seen = [(tags[number], centre) for number, centre in zip(BASE_TAGS, centres, strict=True) if number in tags]
    if len(seen) < LEAST_BASE_TAGS:
        return None
    flat = np.concatenate([square_corners(edge) + centre for _, centre in seen])
    rays = np.concatenate([tag.rays for tag, _ in seen])
    points = np.column_stack((flat, np.zeros(len(flat))))
    solved, turn, move = cv2.solvePnP(points, rays, np.eye(3), None, flags=cv2.SOLVEPNP_ITERATIVE)
    if not solved:
        return None
    rotation, _ = cv2.Rodrigues(turn)
    return CameraPose(np.asarray(rotation, np.float64), np.asarray(move, np.float64).ravel())


def platform_of(tag: Tag, pose: CameraPose, height: float, edge: float, focal: float) -> PlatformSight | None:
    """Return the platform from its tag; None where the corners are not those of a square of its size.

    Args:
        tag: the platform's.
        pose: of the camera.
        height, edge: of the tag (m).
        focal: length (px), which turns deviations in pixels into those in rays.
    """
    corners = pose.on_plane(tag.rays, height)
    centre = corners.mean(axis=0)
    square, seen = square_corners(edge), corners - centre
    # the rotation that fits the square to the corners best
    angle = math.atan2(
        float(np.sum(square[:, 0] * seen[:, 1] - square[:, 1] * seen[:, 0])), float(np.sum(square * seen))
    )
    misfit = float(np.abs(corners - placed(square, float(centre[0]), float(centre[1]), angle)).max())
    if not misfit < LARGEST_MISFIT * edge:
        return None
    # two opposite edges give a coordinate
    pixels = math.sqrt(0.5 * tag.deviation**2 + SYSTEMATIC**2)
    middle = tag.rays.mean(axis=0)
    around = pose.on_plane(middle + np.array([[0.0, 0.0], [1e-4, 0.0], [0.0, 1e-4]]), height)
    by_ray = np.column_stack((around[1] - around[0], around[2] - around[0])) / 1e-4 * (pixels / focal)
    covariance = by_ray @ by_ray.T
    return PlatformSight(
        float(centre[0]),
        float(centre[1]),
        angle,
        float(covariance[0, 0]),
        float(covariance[1, 1]),
        float(covariance[0, 1]),
        float(tag.corners[:, 1].mean()),
    )


class PlatformTracker:
    """Follows the platform from picture to picture."""

    def __init__(self, settings: CameraSettings, optics: Optics) -> None:
        """Prepare for the pictures of a camera, whose optics are those of its calibration."""
        self._settings, self._optics = settings, optics
        self._detector = TagDetector(optics)
        self._centres = np.array(settings.base_tags, np.float64).reshape(-1, 2)
        self._pose: CameraPose | None = None
        self._pictures_since_base = 0
        self._window: Window | None = None

    @property
    def pose(self) -> CameraPose | None:
        """Where the camera is, None before the base has been seen."""
        return self._pose

    def seen(self, picture: Picture) -> PlatformSight | None:
        """Return the platform in the next picture, [h, w]; None where it cannot be seen."""
        tag = None
        if self._pose is not None and self._pictures_since_base < BASE_INTERVAL and self._window is not None:
            self._pictures_since_base += 1
            tag = self._detector.find(picture, self._window).get(PLATFORM_TAG)
        if tag is None:
            tags = self._detector.find(picture)
            self._look_at_base(tags)
            tag = tags.get(PLATFORM_TAG)
        self._window = None if tag is None else _window_about(tag)
        if tag is None or self._pose is None:
            return None
        settings = self._settings
        return platform_of(tag, self._pose, settings.tag_height, settings.platform_tag, self._optics.fx)

    def _look_at_base(self, tags: dict[int, Tag]) -> None:
        pose = camera_pose(tags, self._centres, self._settings.base_tag)
        if pose is not None:
            self._pose = pose
            self._pictures_since_base = 0


def _window_about(tag: Tag) -> Window:
    (left, top), (right, bottom) = tag.corners.min(axis=0), tag.corners.max(axis=0)
    x, y = 0.5 * (left + right), 0.5 * (top + bottom)
    half = WINDOW * max(right - left, bottom - top)
    return Window(int(x - half), int(y - half), int(x + half) + 1, int(y + half) + 1)
