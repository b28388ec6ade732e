# SPDX-License-Identifier: Apache-2.0
"""Renders what the camera sees: sheets at their heights, the links below them, blur of motion and lens, and noise.

A sheet is sampled at `MOMENTS` instants of the exposure, each with its own offset within the pixel, so that one sum
integrates over both exposure time and pixel area. The offsets are symmetrical about the middle of the exposure, so that
the blur of a uniform motion is centred there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from fivebar_camera.markers import Texture, tag_texture
from fivebar_description.camera import BASE_TAGS, PLATFORM_TAG, CameraSettings
from fivebar_description.parameters import FiveBar
from fivebar_optics.camera_model import CameraPose, Optics, Points, nominal_optics, nominal_pose

Picture = NDArray[np.uint8]
Light = NDArray[np.float32]

MOMENTS = 16
LINK_MOMENTS = 3

OFFSETS = tuple(((3 * k % 8 + 0.5) / 8.0 - 0.5, (k + 0.5) / 8.0 - 0.5) for k in (2, 5, 0, 7, 3, 4, 1, 6))
"""Offsets (px) of the first half of the moments; the second half has them in the opposite order."""

TABLE, LINK = 0.5, 0.25
"""Reflectance of the table and of the links."""

PROXIMAL_HEIGHT, DISTAL_HEIGHT, LINK_WIDTH = 0.006, 0.012, 0.02
"""Heights (m) of the links above the base, and their width (m): they hide base tags, but not the platform's."""

SATURATION, WHITE_LEVEL, READ_NOISE = 255.0, 230.0, 0.4
"""Grey levels: the largest, that of a reflectance of 1, and the noise without light."""

GRID = 4
"""Pixels between the points at which the lens is computed."""

ROUND_CAP = 9
"""Points of a link's round end."""


class RenderedPosture(NamedTuple):
    """Places of both elbows and of the platform (m), and the tag's angle (rad), at one instant."""

    elbow1: tuple[float, float]
    elbow2: tuple[float, float]
    platform: tuple[float, float]
    angle: float


def posture_of(robot: FiveBar, q11: float, q21: float, q22: float) -> RenderedPosture:
    """Return the posture of the robot at its joint angles (rad); the platform is at the tip of leg 2."""
    leg1, leg2 = robot.leg1, robot.leg2
    elbow1 = leg1.base_x + leg1.proximal * math.cos(q11), leg1.proximal * math.sin(q11)
    elbow2 = leg2.base_x + leg2.proximal * math.cos(q21), leg2.proximal * math.sin(q21)
    angle = q21 + q22
    platform = elbow2[0] + leg2.distal * math.cos(angle), elbow2[1] + leg2.distal * math.sin(angle)
    return RenderedPosture(elbow1, elbow2, platform, angle)


class PlacedSheet(NamedTuple):
    """A sheet of paper in a picture.

    Attributes:
        texture: what is printed on it.
        height: above the base (m).
        x, y, angle: its centre (m) and angle (rad) at each moment, [MOMENTS, rows or 1]: rows of the picture may be
            exposed one after the other.
    """

    texture: Texture
    height: float
    x: Points
    y: Points
    angle: Points


class Lens:
    """The fixed camera: from pixels to points of a plane, and from points to pixels."""

    def __init__(self, optics: Optics, pose: CameraPose, width: int, height: int) -> None:
        """Make the lens of a picture of a size (px)."""
        self.optics, self.pose = optics, pose
        self.shape = height, width

    def plane(self, height: float, rows: slice, columns: slice) -> Points:
        """Return where the pixels of a window meet a plane z = height, [rows, columns, 2] (m).

        It is interpolated between the points of a grid, with an error of a thousandth of a pixel.
        """
        down, across = _grid(rows), _grid(columns)
        u, v = np.meshgrid(across, down)
        knots = self.pose.on_plane(self.optics.rays(np.column_stack((u.ravel(), v.ravel()))), height)
        at = _between_knots(knots.reshape(len(down), len(across), 2), rows, 0)
        return _between_knots(at, columns, 1)

    def pixels(self, points: Points, height: float) -> Points:
        """Return the pixel coordinates of points x, y, [n, 2] (m), of a plane z = height."""
        world = np.column_stack((points, np.full(len(points), height)))
        return self.optics.pixels(self.pose.rays(world))


def _grid(pixels: slice) -> Points:
    """Return the places of a grid that encloses some pixels."""
    return np.arange(pixels.start, pixels.stop + GRID, GRID, dtype=np.float64)


def _between_knots(values: Points, pixels: slice, axis: int) -> Points:
    """Return values that are given at the places of a grid, along an axis, at some pixels."""
    whole, part = np.divmod(np.arange(pixels.stop - pixels.start), GRID)
    weight = (part / GRID).reshape([-1 if dimension == axis else 1 for dimension in range(values.ndim)])
    before, after = values.take(whole, axis), values.take(whole + 1, axis)
    return before + weight * (after - before)


def paint(light: Light, lens: Lens, placed: PlacedSheet) -> None:
    """Paint a sheet onto the light of a picture, [h, w], in place."""
    rows, columns = _window(lens, placed)
    if rows.stop - rows.start < 2 or columns.stop - columns.start < 2:
        return
    at = lens.plane(placed.height, rows, columns)
    middle = at.reshape(-1, 2).mean(axis=0)
    points = (at - middle).astype(np.float32)
    by_column, by_row = np.gradient(at, axis=1).mean(axis=(0, 1)), np.gradient(at, axis=0).mean(axis=(0, 1))
    total = np.zeros((*points.shape[:2], 2), np.float32)
    texture, per_row = placed.texture, placed.x.shape[1] > 1
    for moment in range(MOMENTS):
        du, dv = OFFSETS[moment if moment < len(OFFSETS) else MOMENTS - 1 - moment]
        offset = middle + du * by_column + dv * by_row
        x, y, angle = (
            table[moment, rows if per_row else slice(None), np.newaxis] for table in (placed.x, placed.y, placed.angle)
        )
        c, s, dx, dy = np.cos(angle), np.sin(angle), offset[0] - x, offset[1] - y
        column = _turned_by(points, c, s, texture.column_of(c * dx + s * dy), 1.0 / texture.texel)
        row = _turned_by(points, s, -c, texture.row_of(c * dy - s * dx), 1.0 / texture.texel)
        total += cv2.remap(
            texture.values, column, row, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=(0.0, 0.0)
        )
    total /= MOMENTS
    light[rows, columns] = light[rows, columns] * (1.0 - total[..., 1]) + total[..., 0]


def _turned_by(points: Light, c: Points, s: Points, constant: Points, scale: float) -> Light:
    """Return scale (c x + s y) + constant of points [h, w, 2], each factor [h or 1, 1]."""
    by_x, by_y, rest = (factor.astype(np.float32) for factor in (scale * c, scale * s, constant))
    turned: Light = by_x * points[..., 0] + by_y * points[..., 1] + rest
    return turned


def _window(lens: Lens, placed: PlacedSheet) -> tuple[slice, slice]:
    """Return the rows and columns that a sheet may cover."""
    reach = 0.5 * math.hypot(placed.texture.width, placed.texture.height)
    low_x, high_x = float(placed.x.min()) - reach, float(placed.x.max()) + reach
    low_y, high_y = float(placed.y.min()) - reach, float(placed.y.max()) + reach
    box = np.array([[low_x, low_y], [low_x, high_y], [high_x, low_y], [high_x, high_y]])
    pixels = lens.pixels(box, placed.height)
    (left, top), (right, bottom) = np.floor(pixels.min(axis=0)) - 3, np.ceil(pixels.max(axis=0)) + 4
    height, width = lens.shape
    rows = slice(max(0, int(top)), min(height, int(bottom)))
    return rows, slice(max(0, int(left)), min(width, int(right)))


def resting(texture: Texture, height: float, x: float, y: float, angle: float = 0.0) -> PlacedSheet:
    """Return a sheet that does not move."""
    x_s, y_s, angles = (np.full((MOMENTS, 1), value) for value in (x, y, angle))
    return PlacedSheet(texture, height, x_s, y_s, angles)


def finished(light: Light, settings: CameraSettings, random: np.random.Generator) -> Picture:
    """Return the picture of a light, [h, w]: blurred by the lens, with noise, in grey levels."""
    if settings.defocus > 0.0:
        light = cv2.GaussianBlur(light, (0, 0), settings.defocus).astype(np.float32)
    grey = light * np.float32(WHITE_LEVEL)
    if settings.noise > 0.0:
        shot = settings.noise**2 * (1e-3 / settings.exposure) / WHITE_LEVEL
        spread = np.sqrt(grey * np.float32(shot) + np.float32(READ_NOISE**2))
        grey += spread * random.standard_normal(grey.shape, dtype=np.float32)
    picture: Picture = np.clip(np.rint(grey), 0.0, SATURATION).astype(np.uint8)
    return picture


class Renderer:
    """Pictures of a robot from the camera."""

    def __init__(self, robot: FiveBar, settings: CameraSettings, seed: int) -> None:
        """Prepare the pictures of a robot; the seed is that of the noise."""
        # results do not depend on the number of threads, and in real time the other processors are the controllers'
        cv2.setNumThreads(1)
        self._robot, self._settings, self._seed = robot, settings, seed
        self.lens = Lens(nominal_optics(settings), nominal_pose(settings), settings.width, settings.height)
        self._tag = tag_texture(PLATFORM_TAG, settings.platform_tag)
        self._table = np.full(self.lens.shape, TABLE, np.float32)
        places = np.array(settings.base_tags).reshape(-1, 2)
        for number, (x, y) in zip(BASE_TAGS, places, strict=True):
            texture = tag_texture(number, settings.base_tag)
            paint(self._table, self.lens, resting(texture, 0.0, float(x), float(y)))

    def picture(self, number: int, posture_at: Callable[[float], RenderedPosture]) -> Picture:
        """Return a picture.

        Args:
            number: of the picture, which seeds its noise.
            posture_at: the posture at a time (s) from the middle of the exposure of the picture's middle row.
        """
        light = self._table.copy()
        self._paint_links(light, posture_at)
        self._paint_tag(light, posture_at)
        return finished(light, self._settings, np.random.default_rng([self._seed, 9, number + 1]))

    def _paint_links(self, light: Light, posture_at: Callable[[float], RenderedPosture]) -> None:
        exposure = self._settings.exposure
        cover = np.zeros(self.lens.shape, np.uint8)
        for moment in range(LINK_MOMENTS):
            posture = posture_at(exposure * ((moment + 0.5) / LINK_MOMENTS - 0.5))
            drawn = np.zeros(self.lens.shape, np.uint8)
            base1, base2 = self._robot.leg1.base_x, self._robot.leg2.base_x
            for base, elbow in (((base1, 0.0), posture.elbow1), ((base2, 0.0), posture.elbow2)):
                self._draw(drawn, base, elbow, PROXIMAL_HEIGHT)
                self._draw(drawn, elbow, posture.platform, DISTAL_HEIGHT)
            cover += drawn // LINK_MOMENTS
        share = cover.astype(np.float32) / (255 // LINK_MOMENTS * LINK_MOMENTS)
        light += share * (LINK - light)

    def _draw(self, drawn: Picture, start: tuple[float, float], end: tuple[float, float], height: float) -> None:
        """Draw a link with round ends into a picture, in place; the lens bends its long edges."""
        along = math.atan2(end[1] - start[1], end[0] - start[0])
        caps = np.linspace(-0.5 * math.pi, 0.5 * math.pi, ROUND_CAP)
        half = 0.5 * LINK_WIDTH
        turned = [along + math.pi + caps, along + caps]
        outline = [
            np.column_stack((place[0] + half * np.cos(angles), place[1] + half * np.sin(angles)))
            for place, angles in zip((start, end), turned, strict=True)
        ]
        pixels = self.lens.pixels(np.concatenate(outline), height)
        if np.abs(pixels).max() < 3e4:
            cv2.fillPoly(drawn, [np.rint(pixels * 16.0).astype(np.int32)], (255,), cv2.LINE_AA, 4)

    def _paint_tag(self, light: Light, posture_at: Callable[[float], RenderedPosture]) -> None:
        exposure, readout = self._settings.exposure, self._settings.readout
        rows = self.lens.shape[0]
        moments = exposure * ((np.arange(MOMENTS) + 0.5) / MOMENTS - 0.5)
        late = np.zeros(1) if readout == 0.0 else readout * ((np.arange(rows) + 0.5) / rows - 0.5)
        places = [_tag_at(posture_at, moments + shift) for shift in _knots(late)]
        x, y, angle = (_between(_knots(late), np.array([place[k] for place in places]), late) for k in range(3))
        paint(light, self.lens, PlacedSheet(self._tag, self._settings.tag_height, x, y, angle))


def _knots(late: Points) -> Points:
    """Return the delays (s) at which postures are computed for rows that are exposed with delays (s)."""
    return late if len(late) == 1 else np.linspace(late[0], late[-1], 17)


def _between(knots: Points, values: Points, late: Points) -> Points:
    """Return values, [MOMENTS, rows], between those at some delays, [knots, MOMENTS]."""
    if len(knots) == 1:
        return values.T.copy()
    return np.stack([np.interp(late, knots, values[:, moment]) for moment in range(values.shape[1])])


def _tag_at(
    posture_at: Callable[[float], RenderedPosture], times: Points
) -> tuple[list[float], list[float], list[float]]:
    postures: Sequence[RenderedPosture] = [posture_at(float(time)) for time in times]
    x_s, y_s = [posture.platform[0] for posture in postures], [posture.platform[1] for posture in postures]
    return x_s, y_s, [posture.angle for posture in postures]
