# SPDX-License-Identifier: Apache-2.0
"""Checks of what a camera publishes, before it is used: sensor_msgs/Image and CameraInfo."""

from __future__ import annotations

from typing import Any

import numpy as np

from fivebar_description.joint_sample import MessageError
from fivebar_vision.camera_file import CameraCalibration, checked_calibration
from fivebar_vision.detector import Picture

LARGEST_PICTURE = 1 << 26
"""Largest number of bytes of a picture."""

ENCODING = "mono8"


def picture_of(message: Any) -> Picture:
    """Return the pixels of an Image, [height, width].

    Raises:
        MessageError: it is none of `mono8`, or its sizes contradict each other.
    """
    width, height, step, size = message.width, message.height, message.step, len(message.data)
    whole = 0 < width <= step and height > 0 and size == step * height <= LARGEST_PICTURE
    if message.encoding != ENCODING or not whole:
        raise MessageError(
            f"encoding {message.encoding[:20]!r}, {width} x {height} pixels, {step} bytes a row, {size} in all:"
            f" expected a picture of {ENCODING}"
        )
    return np.frombuffer(message.data, np.uint8).reshape(height, step)[:, :width]


def calibration_of(message: Any) -> CameraCalibration:
    """Return the calibration that a CameraInfo has, of whole pictures.

    Raises:
        MessageError: it has none, that of another model of the lens, or of a part of the sensor.
    """
    try:
        calibration = checked_calibration(message.width, message.height, message.distortion_model, message.k, message.d)
    except ValueError as error:
        raise MessageError(str(error)) from error
    roi = message.roi
    whole = (0, 0), (message.width, message.height)
    if (roi.x_offset, roi.y_offset) != (0, 0) or (roi.width, roi.height) not in whole:
        raise MessageError(
            f"roi: {roi.width} x {roi.height} px at ({roi.x_offset}, {roi.y_offset}): expected whole pictures"
        )
    return calibration
