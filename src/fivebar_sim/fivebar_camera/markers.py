# SPDX-License-Identifier: Apache-2.0
"""Printed squares as textures: tags with their white margin, and chessboards with tags."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from fivebar_description.camera import TAG_CELLS
from fivebar_optics.camera_model import Points

MARGIN_CELLS = 1
"""Width of the white margin around a tag, in cells."""

TEXELS = 24
"""Texels per cell: half a pixel each where a tag of 30 mm is 96 pixels wide."""

BLACK, WHITE = 0.08, 0.85
"""Reflectance of ink and paper."""


class Texture(NamedTuple):
    """A printed sheet.

    Attributes:
        values: reflectance times opacity, and opacity, [rows, columns, 2]; a frame of one texel is transparent.
        texel: edge of a texel (m).
        width, height: of the sheet (m), without that frame.
    """

    values: NDArray[np.float32]
    texel: float
    width: float
    height: float

    def column_of(self, x: Points) -> Points:
        """Return the column in `values`, as OpenCV counts them, of places (m) to the right of the sheet's centre."""
        # texel 0 is the frame, so that the sheet's edge is at 0.5
        return (x + 0.5 * self.width) / self.texel + 0.5

    def row_of(self, y: Points) -> Points:
        """Return the row in `values` of places (m) above the sheet's centre."""
        return (0.5 * self.height - y) / self.texel + 0.5


def sheet(reflectance: NDArray[np.float32], texel: float) -> Texture:
    """Return a sheet of a reflectance, [rows, columns]."""
    rows, columns = reflectance.shape
    values = np.zeros((rows + 2, columns + 2, 2), np.float32)
    values[1:-1, 1:-1, 0] = reflectance
    values[1:-1, 1:-1, 1] = 1.0
    return Texture(values, texel, columns * texel, rows * texel)


def dictionary() -> cv2.aruco.Dictionary:
    """Return the dictionary AprilTag 36h11."""
    return cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)


def tag_texture(number: int, edge: float) -> Texture:
    """Return a tag whose black square has an edge (m), on its sheet of paper."""
    bits = cv2.aruco.generateImageMarker(dictionary(), number, TAG_CELLS) > 0
    cells = np.pad(bits, MARGIN_CELLS, constant_values=True)
    ink = np.where(cells, WHITE, BLACK).astype(np.float32)
    return sheet(np.kron(ink, np.ones((TEXELS, TEXELS), np.float32)), edge / TAG_CELLS / TEXELS)
