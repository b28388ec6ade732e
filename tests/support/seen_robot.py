# SPDX-License-Identifier: Apache-2.0
"""Pictures of the robot from the camera at known places, for the tests of detection and estimation."""

from __future__ import annotations

import functools
import math

import numpy as np

from fivebar_camera.renderer import RenderedPosture, Renderer, posture_of
from fivebar_camera_runs import accuracy
from fivebar_control.model.geometry import inverse_geometry
from fivebar_description.camera import CameraSettings
from fivebar_description.robot_file import load_robot
from fivebar_optics.camera_model import nominal_optics
from fivebar_vision.localisation import PlatformSight, PlatformTracker

CAMERA = CameraSettings(on=True)


@functools.cache
def renderer(settings: CameraSettings = CAMERA) -> Renderer:
    return Renderer(load_robot("dextar"), settings, seed=0)


def posture_at(x: float, y: float) -> RenderedPosture:
    robot = load_robot("dextar")
    joints = inverse_geometry(robot, (1, -1), x, y)
    return posture_of(robot, joints.q11, joints.q21, joints.q22)


def places(number: int, seed: int) -> list[tuple[float, float]]:
    """Places (m) that the robot reaches with something to spare, so that it can move through them."""
    return accuracy.places(load_robot("dextar"), number, seed)


def sights(
    number: int, speed: float, settings: CameraSettings = CAMERA, seed: int = 1
) -> list[tuple[tuple[float, float], PlatformSight | None]]:
    """Pairs of a place (m) and what the camera saw of a robot that moved through it at a speed (m/s)."""
    random, tracker, pairs = np.random.default_rng(seed), PlatformTracker(settings, nominal_optics(settings)), []
    for k, (x, y) in enumerate(places(number, seed)):
        heading = random.uniform(0.0, 2.0 * math.pi)
        vx, vy = speed * math.cos(heading), speed * math.sin(heading)
        picture = renderer(settings).picture(k, lambda t, x=x, y=y, vx=vx, vy=vy: posture_at(x + t * vx, y + t * vy))
        pairs.append(((x, y), tracker.seen(picture)))
    return pairs
