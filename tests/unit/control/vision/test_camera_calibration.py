# SPDX-License-Identifier: Apache-2.0
"""Calibration with a ChArUco board, against the camera that rendered the pictures."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fivebar_camera.board import board_views
from fivebar_description.camera import CameraSettings
from fivebar_description.strict_yaml import InputError
from fivebar_optics.camera_model import nominal_optics
from fivebar_vision.calibration import Board, board_corners, calibrated
from fivebar_vision.camera_file import CameraCalibration, calibration_text, optics_of, read_calibration

SMALL = CameraSettings(on=True, width=640, height=480, focal=960.0, defocus=0.4)
BOARD = Board()


@pytest.fixture(scope="module")
def found() -> CameraCalibration:
    return calibrated(BOARD, board_views(BOARD.picture(48), BOARD.square, 48, SMALL, 12, seed=0))


@pytest.mark.extra
def test_the_calibrated_camera_is_the_true_one(found: CameraCalibration) -> None:
    """Over the whole picture, and with pixels counted from the centre of the first one."""
    true, columns, rows = nominal_optics(SMALL), np.linspace(40, 600, 9), np.linspace(30, 450, 9)
    grid = np.array([(u, v) for u in columns for v in rows])
    assert found.deviation < 0.1
    # turned and moved a little, another camera sees nearly the same; what remains shows in the middle of the picture
    off = np.abs(found.optics.pixels(true.rays(grid)) - grid)
    assert float(off.max()) < 1.0
    assert (found.optics.cx, found.optics.cy) == pytest.approx((true.cx, true.cy), abs=0.4)
    assert found.optics.fx == pytest.approx(true.fx, rel=1e-3)


def test_the_file_is_read_again(found: CameraCalibration, tmp_path: Path) -> None:
    path = tmp_path / "camera.yaml"
    path.write_text(calibration_text(found), encoding="utf-8")
    again = read_calibration(path)
    assert (again.width, again.height, again.optics) == (found.width, found.height, found.optics)


@pytest.mark.parametrize("scale", [0.5, 1.0, 2.0, 1.5])
def test_a_calibration_at_another_resolution_is_scaled(scale: float, tmp_path: Path) -> None:
    """The camera that it is scaled to sees a ray at the same share of the picture, to rounding."""
    camera = CameraSettings(on=True, width=1280, height=960, focal=1920.0)
    other = camera._replace(width=round(1280 * scale), height=round(960 * scale), focal=1920.0 * scale)
    path = tmp_path / "camera.yaml"
    calibration = CameraCalibration(other.width, other.height, nominal_optics(other), 0.1, 9)
    path.write_text(calibration_text(calibration), "utf-8")
    found = optics_of(camera._replace(calibration=str(path)))
    assert found == pytest.approx(nominal_optics(camera), rel=1e-12)


def test_a_calibration_of_another_shape_is_refused_with_both_sizes(tmp_path: Path) -> None:
    path = tmp_path / "camera.yaml"
    full_hd = CameraSettings(on=True, width=1920, height=1080, focal=2880.0)
    path.write_text(calibration_text(CameraCalibration(1920, 1080, nominal_optics(full_hd), 0.1, 9)), encoding="utf-8")
    camera = CameraSettings(on=True, width=1280, height=960, calibration=str(path))
    with pytest.raises(InputError, match=r"camera\.yaml: calibration of pictures of 1920 x 1080 px: .* 1280 x 960 px"):
        optics_of(camera)
    path.write_text(path.read_text(encoding="utf-8").replace("image_width: 1920", "image_width: 0"), encoding="utf-8")
    with pytest.raises(InputError, match=r"image_width: 0: expected at least 1"):
        optics_of(camera)


def test_too_few_pictures_are_refused() -> None:
    blank = np.full((480, 640), 128, np.uint8)
    assert board_corners(BOARD, blank) is None
    with pytest.raises(InputError, match="the board is in 0 of 8 pictures"):
        calibrated(BOARD, [blank] * 8)


def test_pictures_of_different_sizes_are_refused() -> None:
    with pytest.raises(InputError, match="different sizes"):
        calibrated(BOARD, [np.zeros((480, 640), np.uint8), np.zeros((960, 1280), np.uint8)])
