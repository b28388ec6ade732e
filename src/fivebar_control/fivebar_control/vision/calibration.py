"""Calibration of a camera from pictures of a ChArUco board, and its file, which is that of camera_info_manager."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, NamedTuple

import cv2
import numpy as np
from pydantic import Field

from fivebar_control.vision.detector import Picture, tag_dictionary
from fivebar_description.camera_model import LENS_MODEL, Optics, Points
from fivebar_description.strict_yaml import InputError, StrictModel, read_yaml, yaml_text
from fivebar_description.text_file import write_file

LEAST_PICTURES = 6
LEAST_CORNERS = 12
"""Fewest corners of the board for a picture to be used."""

TOO_WRONG = 1.0
"""Root mean square reprojection error (px) beyond which a calibration is refused."""

MARKER_SHARE = 0.75
"""Edge of a marker, as a share of that of a square."""


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


class CameraCalibration(NamedTuple):
    """A calibrated camera.

    Attributes:
        width, height: of its pictures (px).
        optics: the projection.
        deviation: root mean square reprojection error of the corners (px), NaN where it is not known.
        pictures: number of pictures that were used.
    """

    width: int
    height: int
    optics: Optics
    deviation: float
    pictures: int

    def as_json(self) -> dict[str, float | None]:
        """Return the calibration's values by name."""
        deviation = self.deviation if math.isfinite(self.deviation) else None
        return {
            "width": self.width,
            "height": self.height,
            **self.optics._asdict(),
            "deviation_px": deviation,
            "pictures": self.pictures,
        }

    def write(self, path: Path) -> None:
        """Write the calibration as a file of camera_info."""
        write_file(path, calibration_text(self))


def board_corners(board: Board, picture: Picture) -> tuple[Points, Points] | None:
    """Return the corners of a board in a picture, [n, 3] on the board (m) and [n, 2] (px); None for too few."""
    made = board.made()
    corners, numbers, _, _ = cv2.aruco.CharucoDetector(made).detectBoard(picture)
    if numbers is None or len(numbers) < LEAST_CORNERS:
        return None
    on_board = np.asarray(made.getChessboardCorners(), np.float64)[np.ravel(numbers)]
    return on_board, np.asarray(corners, np.float64).reshape(-1, 2)


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
    rest = [float(one) for one in np.ravel(distortion)[:5]]
    optics = Optics(float(k[0, 0]), float(k[1, 1]), float(k[0, 2]), float(k[1, 2]), *rest)
    return CameraCalibration(width, height, optics, float(deviation), len(seen))


class _Matrix(StrictModel):
    rows: int
    cols: int
    data: Annotated[tuple[float, ...], Field(strict=False)]


class _CameraFile(StrictModel):
    image_width: int
    image_height: int
    camera_name: str = "camera"
    camera_matrix: _Matrix
    distortion_model: str = LENS_MODEL
    distortion_coefficients: _Matrix
    rectification_matrix: _Matrix | None = None
    projection_matrix: _Matrix | None = None


def calibration_text(calibration: CameraCalibration) -> str:
    """Return a calibration as YAML in the format of ROS' camera_info_manager."""
    optics = calibration.optics

    def matrix(values: Points) -> dict[str, object]:
        rows, columns = values.shape
        return {"rows": rows, "cols": columns, "data": values.ravel().tolist()}

    content = {
        "image_width": calibration.width,
        "image_height": calibration.height,
        "camera_name": "camera",
        "camera_matrix": matrix(optics.matrix()),
        "distortion_model": LENS_MODEL,
        "distortion_coefficients": matrix(optics.distortion()[np.newaxis]),
        "rectification_matrix": matrix(np.eye(3)),
        "projection_matrix": matrix(optics.projection()),
    }
    return yaml_text(content)


def read_calibration(path: Path) -> CameraCalibration:
    """Read a calibration.

    Raises:
        InputError: there is no such file, or its distortion model is not `LENS_MODEL`.
    """
    read = read_yaml(path, _CameraFile)
    k, distortion = read.camera_matrix.data, read.distortion_coefficients.data
    if read.distortion_model != LENS_MODEL or len(k) != 9 or len(distortion) != 5:
        raise InputError(f"{path}: expected distortion_model {LENS_MODEL}, 9 values of the matrix and 5 coefficients")
    return CameraCalibration(
        read.image_width, read.image_height, Optics(k[0], k[4], k[2], k[5], *distortion), float("nan"), 0
    )
