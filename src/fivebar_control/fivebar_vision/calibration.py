# SPDX-License-Identifier: Apache-2.0
"""Calibration of a camera from pictures of a ChArUco board."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from fivebar_description.strict_yaml import InputError
from fivebar_optics.camera_model import Optics, Points
from fivebar_vision.camera_file import CameraCalibration
from fivebar_vision.detector import Picture, tag_dictionary

LEAST_PICTURES = 6
LEAST_CORNERS = 12
"""Fewest corners of the board for a picture to be used."""

TOO_WRONG = 1.0
"""Root mean square reprojection error (px) beyond which a calibration is refused."""

MARKER_SHARE = 0.75
"""Edge of a marker, as a share of that of a square."""

REFINED_WITHIN = 0.1
"""Half of the window in which a corner is refined, as a share of a square: no marker reaches into it."""

LEAST_WINDOW = 2
"""Least half of that window (px)."""


class Board(NamedTuple):
    """A ChArUco board of AprilTags 36h11: squares in a row, rows, and the edge of a square (m)."""

    columns: int = 11
    rows: int = 8
    square: float = 0.025

    def made(self) -> cv2.aruco.CharucoBoard:
        """Return the board as OpenCV has it."""
        size = self.columns, self.rows
        return cv2.aruco.CharucoBoard(size, self.square, MARKER_SHARE * self.square, tag_dictionary())

    def picture(self, pixels: int) -> Picture:
        """Return the board to be printed, at a resolution (pixels per square)."""
        size = self.columns * pixels, self.rows * pixels
        return np.asarray(self.made().generateImage(size), np.uint8)


def board_corners(board: Board, picture: Picture) -> tuple[Points, Points] | None:
    """Return the corners of a board in a picture, [n, 3] on the board (m) and [n, 2] (px); None for too few."""
    charuco = board.made()
    corners, numbers, _, _ = cv2.aruco.CharucoDetector(charuco).detectBoard(picture)
    if numbers is None or len(numbers) < LEAST_CORNERS:
        return None
    on_board = np.asarray(charuco.getChessboardCorners(), np.float64)[np.ravel(numbers)]
    return on_board, _refined(picture, np.asarray(corners, np.float64).reshape(-1, 2))


def _refined(picture: Picture, corners: Points) -> Points:
    """Return corners (px) at the saddle points of a picture; those of OpenCV 4 are half a pixel off."""
    apart = np.linalg.norm(corners[:, np.newaxis] - corners, axis=2)
    square = float(apart[apart > 0.0].min())
    half = max(LEAST_WINDOW, int(REFINED_WITHIN * square))
    refined = corners.astype(np.float32).reshape(-1, 1, 2)
    until = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 40, 1e-3)
    return np.asarray(cv2.cornerSubPix(picture, refined, (half, half), (-1, -1), until), np.float64).reshape(-1, 2)


def calibrated(board: Board, pictures: list[Picture]) -> CameraCalibration:
    """Return the calibration of the camera that took pictures of a board from different sides.

    Raises:
        InputError: the board is in too few of them, they differ in size, or the reprojection error is too large.
    """
    shapes = {picture.shape for picture in pictures}
    if len(shapes) > 1:
        raise InputError(f"pictures of different sizes: {sorted(shapes)}: expected those of one camera")
    seen = [corners for corners in (board_corners(board, picture) for picture in pictures) if corners is not None]
    if len(seen) < LEAST_PICTURES:
        raise InputError(
            f"the board is in {len(seen)} of {len(pictures)} pictures: expected {LEAST_PICTURES} at least, with"
            f" {LEAST_CORNERS} corners each, of a board of {board.columns} x {board.rows} squares"
        )
    ((height, width),) = shapes
    deviation, matrix, distortion, _, _ = cv2.calibrateCamera(
        [on_board.astype(np.float32) for on_board, _ in seen],
        [corners.astype(np.float32) for _, corners in seen],
        (width, height),
        np.eye(3),
        np.zeros(5),
        flags=cv2.CALIB_FIX_K3,
    )
    if not deviation < TOO_WRONG:
        raise InputError(f"the corners are {deviation:.2f} px from any camera: expected less than {TOO_WRONG:g}")
    k = np.asarray(matrix, np.float64)
    rest = [float(coefficient) for coefficient in np.ravel(distortion)[:5]]
    optics = Optics(float(k[0, 0]), float(k[1, 1]), float(k[0, 2]), float(k[1, 2]), *rest)
    return CameraCalibration(width, height, optics, float(deviation), len(seen))
