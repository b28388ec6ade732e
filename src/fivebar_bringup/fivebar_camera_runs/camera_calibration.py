# SPDX-License-Identifier: Apache-2.0
"""Calibration of a camera from files of pictures, or of the simulated one."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_camera.board import board_views
from fivebar_description.files import read_bytes, write_file
from fivebar_description.modules import modules_unopened
from fivebar_description.strict_yaml import InputError
from fivebar_vision.calibration import Board, calibrated
from fivebar_vision.camera_file import CameraCalibration
from fivebar_vision.detector import Picture
from fivebar_vision.native_output import native_output_dropped

LARGEST_PICTURE = 100_000_000
"""Bytes of a file with a picture."""

PRINTED_PIXELS = 80
"""Pixels of a square of the board as it is printed or rendered."""

__all__ = ["Board", "calibrate_files", "calibrate_simulated", "write_board"]


def write_board(board: Board, path: Path) -> None:
    """Write a board as a picture to be printed.

    Raises:
        InputError: it cannot be written, or the name is not that of a picture.
    """
    written, content = cv2.imencode(".png", board.picture(PRINTED_PIXELS))
    if path.suffix != ".png" or not written:
        raise InputError(f"{path}: expected the name of a .png file")
    write_file(path, content.tobytes())


def calibrate_files(board: Board, paths: list[Path]) -> CameraCalibration:
    """Return the camera that took the pictures of a board in files, or in directories of PNG files.

    Raises:
        InputError: there are none, one is not a picture, or they show no camera.
    """
    files = [file for path in paths for file in (sorted(path.glob("*.png")) if path.is_dir() else [path])]
    if not files:
        raise InputError("no pictures: expected PNG files, or directories of them")
    return calibrated(board, [_read(path) for path in files])


def calibrate_simulated(board: Board, scenario: str, views: int) -> CameraCalibration:
    """Return the calibration of a scenario's camera by so many rendered pictures of a board.

    Raises:
        InputError: the scenario is wrong, or its camera does not see the board.
    """
    with modules_unopened():
        settings = load_scenario(scenario).camera
    printed = board.picture(PRINTED_PIXELS)
    return calibrated(board, board_views(printed, board.square, PRINTED_PIXELS, settings, views, seed=0))


def _read(path: Path) -> Picture:
    content = np.frombuffer(read_bytes(path, LARGEST_PICTURE), np.uint8)
    with native_output_dropped():
        try:
            picture = cv2.imdecode(content, cv2.IMREAD_GRAYSCALE) if content.size else None
        except cv2.error:
            # too many pixels
            picture = None
    if picture is None:
        raise InputError(f"{path}: expected a picture")
    return np.asarray(picture, np.uint8)
