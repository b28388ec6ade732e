# SPDX-License-Identifier: Apache-2.0
"""A camera's calibration and its file, which is that of camera_info_manager."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field

from fivebar_description.camera import CameraSettings
from fivebar_description.files import write_file
from fivebar_description.strict_yaml import InputError, StrictModel, read_yaml, yaml_text
from fivebar_optics.camera_model import LENS_MODEL, Optics, Points, nominal_optics

LEAST_FOCAL, LARGEST_FOCAL = 1.0, 1e6
"""Focal lengths (px) of any camera."""

LARGEST_COEFFICIENT = 1e6
"""Largest coefficient of a lens."""

LARGEST_SIDE = 100_000
"""Largest side of a picture (px)."""

PictureSide = Annotated[int, Field(ge=1, le=LARGEST_SIDE)]


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

    def optics_for(self, width: int, height: int, source: str) -> Optics:
        """Return the projection onto pictures of another size (px) by the same lens and sensor.

        Pictures of the same shape are the whole sensor with larger or smaller pixels. Of another shape they are a part
        of it, and nobody knows which.

        Raises:
            InputError: the shape differs; `source` stands in front.
        """
        if self.width * height != self.height * width:
            raise InputError(
                f"{source}: calibration of pictures of {self.width} x {self.height} px: expected one of the camera's"
                f" {width} x {height} px, or of the same shape"
            )
        scale = width / self.width
        o = self.optics
        # pixel (0, 0) is the centre of the upper left one, half a pixel inside of the picture
        centre = (o.cx + 0.5) * scale - 0.5, (o.cy + 0.5) * scale - 0.5
        return o if scale == 1.0 else o._replace(fx=o.fx * scale, fy=o.fy * scale, cx=centre[0], cy=centre[1])

    def write(self, path: Path) -> None:
        """Write the calibration as a file of camera_info."""
        write_file(path, calibration_text(self))


class _Matrix(StrictModel):
    rows: int
    cols: int
    data: Annotated[tuple[float, ...], Field(strict=False)]


class _CameraFile(StrictModel):
    image_width: PictureSide
    image_height: PictureSide
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
        InputError: there is no such file, or it has the numbers of no camera or another distortion model.
    """
    read = read_yaml(path, _CameraFile)
    try:
        return checked_calibration(
            read.image_width,
            read.image_height,
            read.distortion_model,
            read.camera_matrix.data,
            read.distortion_coefficients.data,
        )
    except ValueError as error:
        raise InputError(f"{path}: {error}") from error


def checked_calibration(
    width: int, height: int, model: str, matrix: Sequence[float], distortion: Sequence[float]
) -> CameraCalibration:
    """Return a calibration of given numbers, of a file or a CameraInfo.

    Raises:
        ValueError: they are those of no camera, or of another model of the lens.
    """
    if not (0 < width <= LARGEST_SIDE and 0 < height <= LARGEST_SIDE):
        raise ValueError(f"pictures of {width} x {height} px: expected 1 to {LARGEST_SIDE} px")
    if model != LENS_MODEL:
        raise ValueError(f"distortion_model: {model[:20]!r}: expected {LENS_MODEL}")
    if len(distortion) != 5:
        raise ValueError(f"distortion_coefficients: {len(distortion)} values: expected the 5 of {LENS_MODEL}")
    if len(matrix) != 9:
        raise ValueError(f"camera_matrix: {len(matrix)} values: expected 9")
    fx, _, cx, _, fy, cy, *_ = map(float, matrix)
    if not (LEAST_FOCAL <= fx <= LARGEST_FOCAL and LEAST_FOCAL <= fy <= LARGEST_FOCAL):
        raise ValueError(
            f"camera_matrix: focal lengths {fx:g}, {fy:g} px: expected {LEAST_FOCAL:g} to {LARGEST_FOCAL:g} px"
        )
    if not all(abs(coordinate) <= LARGEST_FOCAL for coordinate in (cx, cy)):
        raise ValueError(f"camera_matrix: principal point {cx:g}, {cy:g} px: expected at most {LARGEST_FOCAL:g} px")
    bent = [float(coefficient) for coefficient in distortion]
    if not all(abs(coefficient) <= LARGEST_COEFFICIENT for coefficient in bent):
        shown = ", ".join(f"{coefficient:g}" for coefficient in bent)
        raise ValueError(f"distortion_coefficients: {shown}: expected numbers of at most {LARGEST_COEFFICIENT:g}")
    return CameraCalibration(width, height, Optics(fx, fy, cx, cy, *bent), math.nan, 0)


def optics_of(settings: CameraSettings) -> Optics:
    """Return the projection by which the pictures of a camera with these settings are read.

    Raises:
        InputError: its calibration cannot be read, or is of pictures of another shape.
    """
    if not settings.calibration:
        return nominal_optics(settings)
    path = Path(settings.calibration)
    return read_calibration(path).optics_for(settings.width, settings.height, str(path))
