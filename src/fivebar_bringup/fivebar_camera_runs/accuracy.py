# SPDX-License-Identifier: Apache-2.0
"""How exactly the camera finds the platform: rendered pictures of the robot at random places, against where it was."""

from __future__ import annotations

import math

import numpy as np

from fivebar_camera.renderer import RenderedPosture, Renderer, posture_of
from fivebar_control.model.geometry import inverse_geometry
from fivebar_description.camera import CameraSettings
from fivebar_description.parameters import FiveBar
from fivebar_optics.camera_model import nominal_optics
from fivebar_vision.localisation import PlatformTracker

MODE = (1, -1)
"""The working mode of the places."""

REACH_X, REACH_Y = (-0.09, 0.09), (-0.02, 0.16)
"""Where places are drawn (m), in the picture of the camera as it is by default."""

CLEAR = 0.02
"""Distance (m) to each side that the robot reaches too, so that it can move through a place."""


def places(robot: FiveBar, number: int, seed: int) -> list[tuple[float, float]]:
    """Return random places (m) that the robot reaches with something to spare."""
    random = np.random.default_rng(seed)
    errors: list[tuple[float, float]] = []
    while len(errors) < number:
        x, y = random.uniform(*REACH_X), random.uniform(*REACH_Y)
        around = [inverse_geometry(robot, MODE, x + dx, y + dy) for dx in (-CLEAR, CLEAR) for dy in (-CLEAR, CLEAR)]
        if all(math.isfinite(angle) for joints in around for angle in joints):
            errors.append((x, y))
    return errors


def position_errors(
    robot: FiveBar, settings: CameraSettings, speed: float, number: int, seed: int = 1
) -> list[float | None]:
    """Return the distances (m) of what the camera saw from where a robot was that moved there at a speed (m/s).

    None where it saw nothing.
    """
    random = np.random.default_rng(seed)
    renderer, tracker = Renderer(robot, settings, seed), PlatformTracker(settings, nominal_optics(settings))
    errors: list[float | None] = []
    for k, (x, y) in enumerate(places(robot, number, seed)):
        heading = random.uniform(0.0, math.tau)
        vx, vy = speed * math.cos(heading), speed * math.sin(heading)

        def posture_at(t: float, x: float = x, y: float = y, vx: float = vx, vy: float = vy) -> RenderedPosture:
            joints = inverse_geometry(robot, MODE, x + t * vx, y + t * vy)
            return posture_of(robot, joints.q11, joints.q21, joints.q22)

        sight = tracker.seen(renderer.picture(k, posture_at))
        errors.append(None if sight is None else math.hypot(sight.x - x, sight.y - y))
    return errors
