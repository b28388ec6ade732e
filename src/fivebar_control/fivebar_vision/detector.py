# SPDX-License-Identifier: Apache-2.0
"""Finds AprilTags in a picture and measures their corners to a few hundredths of a pixel.

OpenCV identifies the tags. Its corners are accurate to about half a pixel, with an offset that differs between
releases, so they are only the initial guess: the step from dark to bright is located in intensity profiles across each
edge of the black square, lens distortion is removed, a line is fitted to each edge, and the intersections of
neighbouring lines are the corners. Symmetrical blur, of the lens or of a motion, does not bias these lines.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from fivebar_description.camera import TAG_CELLS
from fivebar_optics.camera_model import Optics, Points

Picture = NDArray[np.uint8]

PROFILES = 32
"""Intensity profiles across each edge."""

MARGIN = 0.1
"""Share of an edge at either end without profiles, since the neighbouring edge is too near."""

REACH = 5.0
"""Largest half length of a profile (px)."""

STEP = 0.5
"""Distance between the points of a profile (px)."""

PASSES = 2

LEAST_CONTRAST = 25.0
"""Least difference between the black square and the paper (grey levels)."""

OUTLIERS = 4.0
"""Distance from the fitted line, in standard deviations, beyond which a profile is an outlier."""

LEAST_PROFILES = PROFILES // 2

LEAST_DEVIATION = 0.01
"""Least standard deviation of an edge's place in a profile (px), even without noise."""


class Tag(NamedTuple):
    """A tag in a picture.

    Attributes:
        number: its number in the dictionary.
        corners: pixel coordinates, [4, 2], clockwise from the upper left corner of the tag.
        rays: the corners' rays (x / z, y / z), undistorted, [4, 2].
        deviation: standard deviation of an edge's line (px).
    """

    number: int
    corners: Points
    rays: Points
    deviation: float


class Window(NamedTuple):
    """Part of a picture (px): first column and row, and the ones after the last."""

    left: int
    top: int
    right: int
    bottom: int


def tag_dictionary() -> cv2.aruco.Dictionary:
    """Return the dictionary AprilTag 36h11."""
    return cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)


class TagDetector:
    """Finds tags of the dictionary AprilTag 36h11."""

    def __init__(self, optics: Optics) -> None:
        """Prepare for pictures of a camera."""
        # results do not depend on the number of threads, but a fork with running ones would hang
        cv2.setNumThreads(1)
        self._optics = optics
        parameters = cv2.aruco.DetectorParameters()
        parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_NONE
        self._detector = cv2.aruco.ArucoDetector(tag_dictionary(), parameters)

    def find(self, picture: Picture, within: Window | None = None) -> dict[int, Tag]:
        """Return the tags of a picture, [h, w], or of a part of it, by number; one that appears twice is left out."""
        left = top = 0
        part = picture
        if within is not None:
            left, top = max(0, within.left), max(0, within.top)
            part = picture[top : max(0, within.bottom), left : max(0, within.right)]
        if min(part.shape) < 2 * TAG_CELLS:
            return {}
        markers, numbers, _ = self._detector.detectMarkers(np.ascontiguousarray(part))
        if numbers is None:
            return {}
        ids = [int(number) for number in np.ravel(numbers)]
        tags: dict[int, Tag] = {}
        for number, corners in zip(ids, markers, strict=True):
            if ids.count(number) > 1:
                continue
            begun = np.asarray(corners, np.float64).reshape(4, 2) + np.array([left, top])
            tag = self._measured(picture, number, begun)
            if tag is not None:
                tags[number] = tag
        return tags

    def _measured(self, picture: Picture, number: int, corners: Points) -> Tag | None:
        """Return a tag with its corners refined from an initial guess; None where an edge cannot be found."""
        deviation = math.inf
        for _ in range(PASSES):
            lines = []
            for side in range(4):
                line = self._line(picture, corners[side], corners[(side + 1) % 4])
                if line is None:
                    return None
                lines.append(line)
            rays = np.array([_meeting(lines[side - 1], lines[side]) for side in range(4)])
            if not np.isfinite(rays).all():
                return None
            deviation = math.sqrt(sum(line.variance for line in lines) / 4.0) * self._optics.fx
            corners = self._optics.pixels(rays)
        return Tag(number, corners, rays, deviation)

    def _line(self, picture: Picture, start: Points, end: Points) -> _EdgeLine | None:
        """Return the line of an edge between two corners (px); in clockwise order, so that the paper is to its left."""
        along = end - start
        length = float(np.hypot(*along))
        # a profile stays within the outer cell
        reach = min(REACH, 0.4 * length / TAG_CELLS)
        if reach < 2.0 * STEP:
            return None
        along /= length
        outwards = np.array([along[1], -along[0]])
        at = start + np.linspace(MARGIN, 1.0 - MARGIN, PROFILES)[:, np.newaxis] * length * along
        steps = np.arange(-math.floor(reach / STEP), math.floor(reach / STEP) + 1) * STEP
        points = (at[:, np.newaxis] + steps[:, np.newaxis] * outwards).astype(np.float32)
        values = cv2.remap(
            picture, points[..., 0], points[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
        ).astype(np.float64)
        black, white = float(np.median(values[:, :2])), float(np.median(values[:, -2:]))
        if white - black < LEAST_CONTRAST:
            return None
        # where the step of a profile is: its dark part has this length
        dark = ((white - values) / (white - black)).clip(-0.3, 1.3)
        places = steps[0] + STEP * (dark.sum(axis=1) - 0.5)
        edge = at + places[:, np.newaxis] * outwards
        return _fitted(self._optics.rays(edge), LEAST_DEVIATION / self._optics.fx)


class _EdgeLine(NamedTuple):
    """A line n . p = distance among rays, |n| = 1, and the variance of its offset."""

    x: float
    y: float
    distance: float
    variance: float


def _fitted(points: Points, least: float) -> _EdgeLine | None:
    """Return the line fitted to points [n, 2] without outliers, given a least deviation; None for too few points."""
    keep = np.ones(len(points), np.bool_)
    for _ in range(3):
        chosen = points[keep]
        if len(chosen) < LEAST_PROFILES:
            return None
        centre = chosen.mean(axis=0)
        spread = (chosen - centre).T @ (chosen - centre)
        angle = 0.5 * math.atan2(2.0 * spread[0, 1], spread[0, 0] - spread[1, 1])
        n_x, n_y = -math.sin(angle), math.cos(angle)
        off = (points - centre) @ (n_x, n_y)
        deviation = max(least, 1.4826 * float(np.median(np.abs(off[keep]))))
        now = np.abs(off) < OUTLIERS * deviation
        if bool((now == keep).all()):
            break
        keep = now
    rest = max(least, float(np.sqrt(np.mean(off[keep] ** 2))))
    return _EdgeLine(n_x, n_y, n_x * centre[0] + n_y * centre[1], rest * rest / int(keep.sum()))


def _meeting(line1: _EdgeLine, line2: _EdgeLine) -> tuple[float, float]:
    """Return where two lines meet; NaN where they do not."""
    determinant = line1.x * line2.y - line1.y * line2.x
    if abs(determinant) < 1e-6:
        return math.nan, math.nan
    x = (line1.distance * line2.y - line2.distance * line1.y) / determinant
    return x, (line1.x * line2.distance - line2.x * line1.distance) / determinant
