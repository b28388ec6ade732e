# SPDX-License-Identifier: Apache-2.0
"""Pictures of a calibration board that is held before the camera from different sides."""

from __future__ import annotations

import math

import numpy as np

from fivebar_camera.markers import BLACK, WHITE, sheet
from fivebar_camera.renderer import TABLE, Lens, Picture, finished, paint, resting
from fivebar_description.camera import CameraSettings
from fivebar_optics.camera_model import CameraPose, nominal_optics

TILT = 0.45
"""Largest tilt of the board about either of its axes (rad)."""


def board_views(
    printed: Picture, square: float, pixels: int, settings: CameraSettings, views: int, seed: int
) -> list[Picture]:
    """Return pictures of a board.

    Args:
        printed: the board, at `pixels` per square.
        square: edge of a square (m).
        pixels: per square.
        settings: of the camera.
        views: number of pictures.
        seed: of the board's poses and of the noise.
    """
    paper = np.pad(printed, pixels // 2, constant_values=255).astype(np.float32) / 255.0
    texture = sheet((BLACK + (WHITE - BLACK) * paper).astype(np.float32), square / pixels)
    random = np.random.default_rng([seed, 10])
    pictures = []
    for view in range(views):
        turn, height = math.pi / 4.0 * view, settings.z * random.uniform(0.75, 1.0)
        tilt_x, tilt_y = TILT * math.cos(2.4 * view), TILT * math.sin(2.4 * view)
        aside = [random.uniform(-0.12, 0.12) * height for _ in range(2)]
        # pose of the camera in the board's frame: the board's centre is in front of it, a little off the axis
        rotation = CameraPose.looking_down((0.0, 0.0, height), tilt_x, tilt_y, turn).rotation
        pose = CameraPose(rotation, np.array([*aside, height]))
        light = np.full((settings.height, settings.width), TABLE, np.float32)
        lens = Lens(nominal_optics(settings), pose, settings.width, settings.height)
        paint(light, lens, resting(texture, 0.0, 0.0, 0.0))
        pictures.append(finished(light, settings, random))
    return pictures
