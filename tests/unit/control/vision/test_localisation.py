# SPDX-License-Identifier: Apache-2.0
"""The platform's position from rendered pictures, against where the platform was."""

from __future__ import annotations

import math

import numpy as np
import pytest
from seen_robot import CAMERA, places, posture_at, renderer, sights

from fivebar_description.camera import BASE_TAGS, PLATFORM_TAG
from fivebar_optics.camera_model import CameraPose, Optics, nominal_optics, nominal_pose, placed, square_corners
from fivebar_vision.detector import TagDetector
from fivebar_vision.localisation import PlatformTracker

STATIC_LIMIT, MOVING_LIMIT = 0.05e-3, 0.2e-3


def test_the_lens_has_an_inverse() -> None:
    optics = nominal_optics(CAMERA)
    pixels = np.array([[0.0, 0.0], [1279.0, 0.0], [639.5, 479.5], [100.0, 900.0]])
    assert optics.pixels(optics.rays(pixels)) == pytest.approx(pixels, abs=1e-6)


def test_a_point_of_a_plane_is_found_again() -> None:
    pose, points = nominal_pose(CAMERA), np.array([[0.1, 0.02], [-0.15, 0.2]])
    rays = pose.rays(np.column_stack((points, [0.02, 0.02])))
    assert pose.on_plane(rays, 0.02) == pytest.approx(points, abs=1e-12)


def test_the_camera_sees_the_robot_from_above() -> None:
    pose, optics = CameraPose.looking_down((0.0, 0.0, 0.5)), Optics(1000.0, 1000.0, 0.0, 0.0)
    right_and_up = optics.pixels(pose.rays(np.array([[0.1, 0.0, 0.0], [0.0, 0.1, 0.0]])))
    assert right_and_up == pytest.approx(np.array([[200.0, 0.0], [0.0, -200.0]]))


def test_corners_have_no_constant_offset() -> None:
    """Against the projection of the true corners: half a pixel would be a picture counted from its edge."""
    lens, detector, errors = renderer().lens, TagDetector(nominal_optics(CAMERA)), []
    for k, (x, y) in enumerate(places(4, seed=5)):
        posture = posture_at(x, y)
        tag = detector.find(renderer().picture(k, lambda t, posture=posture: posture))[PLATFORM_TAG]
        true = lens.pixels(placed(square_corners(CAMERA.platform_tag), x, y, posture.angle), CAMERA.tag_height)
        errors.append(tag.corners - true)
    assert np.concatenate(errors).mean(axis=0) == pytest.approx([0.0, 0.0], abs=0.02)
    assert float(np.abs(errors).max()) < 0.15


@pytest.mark.parametrize(("speed", "limit"), [(0.0, STATIC_LIMIT), (0.3, MOVING_LIMIT)])
def test_position_against_truth(speed: float, limit: float) -> None:
    errors, normalised = [], []
    for (x, y), sight in sights(6, speed):
        assert sight is not None
        error = np.array([sight.x - x, sight.y - y])
        covariance = np.array([[sight.variance_x, sight.covariance], [sight.covariance, sight.variance_y]])
        errors.append(math.hypot(*error))
        normalised.append(float(error @ np.linalg.solve(covariance, error)))
    assert max(errors) < limit
    assert max(normalised) < 18.0  # 1e-4 of a chi-squared with two degrees of freedom


def test_a_rolling_shutter_is_seen_by_row() -> None:
    """The position is that of the time at which the tag's row was exposed, not the picture's middle one."""
    settings = CAMERA._replace(readout=0.02)
    speed = 0.2
    tracker = PlatformTracker(settings, nominal_optics(settings))
    sight = tracker.seen(renderer(settings).picture(0, lambda t: posture_at(0.02 + speed * t, 0.1)))
    assert sight is not None
    late = settings.readout * ((sight.row + 0.5) / settings.height - 0.5)
    assert abs(late) > 1e-3
    assert sight.x == pytest.approx(0.02 + speed * late, abs=MOVING_LIMIT)


def test_hidden_base_tags_leave_the_last_pose() -> None:
    tracker = PlatformTracker(CAMERA, nominal_optics(CAMERA))
    picture = renderer().picture(0, lambda t: posture_at(0.0, 0.1))
    blank = picture.copy()
    for number in BASE_TAGS:
        x, y = np.array(CAMERA.base_tags).reshape(-1, 2)[number - 1]
        ((u, v),) = renderer().lens.pixels(np.array([[x, y]]), 0.0)
        blank[int(v) - 40 : int(v) + 40, int(u) - 40 : int(u) + 40] = 60
    assert tracker.seen(blank) is None
    known = tracker.seen(picture)
    assert known is not None
    again = tracker.seen(blank)
    assert again is not None
    assert (again.x, again.y) == pytest.approx((known.x, known.y), abs=1e-5)


def test_a_covered_tag_is_not_seen() -> None:
    tracker = PlatformTracker(CAMERA, nominal_optics(CAMERA))
    picture = renderer().picture(0, lambda t: posture_at(0.0, 0.1)).copy()
    assert tracker.seen(picture) is not None
    ((u, v),) = renderer().lens.pixels(np.array([[0.0, 0.1]]), CAMERA.tag_height)
    picture[int(v) - 20 : int(v) + 90, int(u) - 90 : int(u) + 90] = 128
    assert tracker.seen(picture) is None
