# SPDX-License-Identifier: Apache-2.0
"""What a camera publishes: usable pictures and calibrations, and what is refused, named and never the end of a node."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

from fivebar_bringup.bag.definitions import TYPESTORE
from fivebar_description.camera import CameraSettings
from fivebar_description.joint_sample import MessageError
from fivebar_optics.camera_model import Optics
from fivebar_vision.localisation import PlatformTracker
from fivebar_vision.messages import calibration_of, picture_of
from fivebar_vision.picture_reading import reading_of

TYPES = TYPESTORE.types
STAMP = TYPES["builtin_interfaces/msg/Time"](1, 0)
HEADER = TYPES["std_msgs/msg/Header"](STAMP, "camera")
ROI = TYPES["sensor_msgs/msg/RegionOfInterest"](0, 0, 0, 0, False)
MATRIX = np.array([800.0, 0.0, 320.0, 0.0, 810.0, 240.0, 0.0, 0.0, 1.0])


def image(**changes: Any) -> Any:
    plain = TYPES["sensor_msgs/msg/Image"](HEADER, 2, 3, "mono8", 0, 4, np.arange(8, dtype=np.uint8))
    return dataclasses.replace(plain, **changes)


def info(**changes: Any) -> Any:
    plain = TYPES["sensor_msgs/msg/CameraInfo"](
        HEADER, 480, 640, "plumb_bob", np.zeros(5), MATRIX, np.eye(3).ravel(), np.zeros(12), 0, 0, ROI
    )
    return dataclasses.replace(plain, **changes)


def test_a_picture_has_its_rows_without_their_padding() -> None:
    assert picture_of(image()).tolist() == [[0, 1, 2], [4, 5, 6]]


@pytest.mark.parametrize(
    "changes",
    [
        {"encoding": "rgb8"},
        {"encoding": "mono16"},
        {"encoding": ""},
        {"encoding": "\0" * 100_000},
        {"step": 2},
        {"step": 0},
        {"width": 0},
        {"height": 0},
        {"height": 3},
        {"width": 2**32 - 1, "step": 2**32 - 1, "height": 2**32 - 1},
        {"data": np.zeros(0, np.uint8)},
        {"data": np.zeros(9, np.uint8)},
    ],
)
def test_a_picture_of_another_kind_or_size_is_refused(changes: dict[str, Any]) -> None:
    with pytest.raises(MessageError, match=r"^encoding .{0,90} pixels, .* in all: expected a picture of mono8$"):
        picture_of(image(**changes))


def test_a_calibration_is_read() -> None:
    found = calibration_of(info(d=np.array([0.1, -0.2, 0.003, 0.004, 0.05])))
    assert (found.width, found.height) == (640, 480)
    assert found.optics == Optics(800.0, 810.0, 320.0, 240.0, 0.1, -0.2, 0.003, 0.004, 0.05)


def with_entry(place: int, value: float) -> np.ndarray:
    matrix = MATRIX.copy()
    matrix[place] = value
    return matrix


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"distortion_model": "equidistant"}, "distortion_model: 'equidistant': expected plumb_bob"),
        ({"distortion_model": ""}, "distortion_model: '': expected plumb_bob"),
        ({"d": np.zeros(4)}, "distortion_coefficients: 4 values: expected the 5 of plumb_bob"),
        ({"d": np.zeros(0)}, "distortion_coefficients: 0 values: expected the 5 of plumb_bob"),
        ({"d": np.array([0.0, math.nan, 0.0, 0.0, 0.0])}, "distortion_coefficients: 0, nan, 0, 0, 0: expected numbers"),
        ({"d": np.array([1e300, 0.0, 0.0, 0.0, 0.0])}, "distortion_coefficients: 1e[+]300, 0, 0, 0, 0: expected"),
        ({"k": np.zeros(9)}, "camera_matrix: focal lengths 0, 0 px: expected 1 to 1e[+]06 px"),
        ({"k": with_entry(0, math.nan)}, "camera_matrix: focal lengths nan, 810 px"),
        ({"k": with_entry(4, math.inf)}, "camera_matrix: focal lengths 800, inf px"),
        ({"k": with_entry(2, math.nan)}, "camera_matrix: principal point nan, 240 px"),
        ({"k": with_entry(5, -1e300)}, "camera_matrix: principal point 320, -1e[+]300 px"),
        ({"width": 0}, "pictures of 0 x 480 px: expected 1 to 100000 px"),
        ({"height": 2**32 - 1}, "pictures of 640 x 4294967295 px: expected 1 to 100000 px"),
        ({"roi": dataclasses.replace(ROI, x_offset=8, width=320, height=480)}, "roi: 320 x 480 px at .8, 0.: expected"),
    ],
)
def test_a_calibration_that_is_none_is_refused_by_what_is_wrong(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(MessageError, match=f"^{words}"):
        calibration_of(info(**changes))


@pytest.mark.parametrize("size", [(1, 1), (1, 3000), (3000, 1), (7, 5), (480, 640)])
def test_no_picture_ends_the_search_of_the_platform(size: tuple[int, int]) -> None:
    """Of any size and by any calibration that is read; in none of these is the platform."""
    random = np.random.default_rng(1)
    extreme = info(k=np.array([1.0, 0, 1e6, 0, 1e6, -1e6, 0, 0, 1]), d=np.array([1e6, -1e6, 1e6, 1e6, -1e6]))
    for message in (info(), extreme):
        tracker = PlatformTracker(CameraSettings(), calibration_of(message).optics)
        for picture in (np.zeros(size), np.full(size, 255), random.integers(0, 256, size)):
            reading, _ = reading_of(tracker, CameraSettings(), picture.astype(np.uint8))
            assert math.isnan(reading.x)
