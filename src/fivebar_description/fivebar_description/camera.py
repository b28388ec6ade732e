# SPDX-License-Identifier: Apache-2.0
"""The camera above the robot: its optics, its exposures, and the tags that it sees."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from fivebar_description.settings import Setting

PLATFORM_TAG = 0
"""Number of the tag on the distal link of leg 2, centred on the platform, in the dictionary AprilTag 36h11."""

TAG_CELLS = 8
"""Cells of a tag in a row, with its black frame."""

BASE_TAGS = (1, 2, 3, 4)
"""Numbers of the tags on the base, in the order of `CameraSettings.base_tags`."""

LONGEST_CAMERA_LATENCY = 0.2
"""Age (s) beyond which a picture is of no use."""


def _not_installed(on: bool) -> str | None:
    if not on:
        return None
    # here, because only a robot with a camera needs it
    from fivebar_description.optional import CAMERA_PARTS, first_missing

    return first_missing(CAMERA_PARTS)


def _distortion(name: str) -> Setting:
    return Setting(f"Coefficient {name} of the lens (Brown-Conrady).", at_least=-10.0, at_most=10.0)


def _turned(axis: str) -> Setting:
    return Setting(f"Rotation of the camera about its {axis} axis.", "rad", at_least=-0.8, at_most=0.8)


def _pairs_of_base_tags(value: tuple[float, ...]) -> str | None:
    return None if len(value) == 2 * len(BASE_TAGS) else f"expected {len(BASE_TAGS)} pairs x, y"


Pixels = Annotated[int, Setting("Pixels of a row or column.", "px", at_least=64, at_most=8192)]
Coordinate = Annotated[float, Setting("Place of the camera's centre.", "m", at_least=-10.0, at_most=10.0)]


class CameraSettings(NamedTuple):
    """A camera that looks down on the robot, off by default.

    The optical axis points down; the picture's x is the robot's x, its y the robot's -y. The platform carries a tag on
    the distal link of leg 2, four more mark the plane of the base, z = 0. A trigger exposes every n-th sample, a
    picture is stamped with the middle of its exposure. Without `pictures` the position of the tag is simulated
    instead, with an error of `deviation`: for sweeps, which cannot render.
    """

    on: Annotated[bool, Setting("Whether there is a camera.", check=_not_installed)] = False
    pictures: Annotated[
        bool, Setting("Render pictures and detect the tags in them; else the result of that is simulated.")
    ] = True
    record: Annotated[bool, Setting("Record the pictures: 1.2 MB each.")] = False
    width: Pixels = 1280
    height: Pixels = 960
    focal: Annotated[float, Setting("Focal length.", "px", at_least=50.0, at_most=1e5)] = 1920.0
    k1: Annotated[float, _distortion("k1")] = -0.12
    k2: Annotated[float, _distortion("k2")] = 0.1
    p1: Annotated[float, _distortion("p1")] = 4e-4
    p2: Annotated[float, _distortion("p2")] = -3e-4
    k3: Annotated[float, _distortion("k3")] = 0.0
    x: Coordinate = 0.0
    y: Coordinate = 0.06
    z: Annotated[float, Setting("Height of the camera above the base.", "m", at_least=0.05, at_most=10.0)] = 0.6
    roll: Annotated[float, _turned("x")] = 0.01
    pitch: Annotated[float, _turned("y")] = -0.015
    yaw: Annotated[float, _turned("optical")] = 0.02
    rate_hz: Annotated[
        int, Setting("Pictures per second, rounded to every n-th sample.", "Hz", at_least=1, at_most=1000)
    ] = 60
    exposure: Annotated[float, Setting("Time of exposure.", "s", at_least=1e-5, at_most=0.05)] = 1e-3
    readout: Annotated[
        float,
        Setting(
            "Time by which the last row is exposed later than the first: 0 for a global shutter, 0.01 to 0.03 for a"
            " rolling one.",
            "s",
            at_least=0.0,
            at_most=0.05,
        ),
    ] = 0.0
    defocus: Annotated[float, Setting("Blur of the lens, a standard deviation.", "px", at_least=0.0, at_most=10.0)] = (
        0.6
    )
    noise: Annotated[
        float,
        Setting(
            "Noise of a white pixel after 1 ms of exposure, in grey levels of 255; light noise, so that it falls with"
            " the root of the exposure.",
            at_least=0.0,
            at_most=100.0,
        ),
    ] = 3.0
    latency: Annotated[
        float,
        Setting(
            "Time from the middle of an exposure to the arrival of what was seen in it.",
            "s",
            at_least=0.0,
            at_most=LONGEST_CAMERA_LATENCY,
        ),
    ] = 0.03
    jitter: Annotated[
        float,
        Setting("Further delay, spread evenly from 0 to this.", "s", at_least=0.0, at_most=LONGEST_CAMERA_LATENCY),
    ] = 0.01
    dropped: Annotated[float, Setting("Fraction of the pictures that never arrive.", at_least=0.0, at_most=1.0)] = 0.0
    clock_offset: Annotated[
        float, Setting("Time by which the camera's stamps are late.", "s", at_least=-0.05, at_most=0.05)
    ] = 0.0
    platform_tag: Annotated[
        float, Setting("Edge of the black square of the platform's tag.", "m", at_least=1e-3, at_most=1.0)
    ] = 0.03
    tag_height: Annotated[
        float, Setting("Height of the platform's tag above the base.", "m", at_least=0.0, at_most=1.0)
    ] = 0.02
    base_tag: Annotated[
        float, Setting("Edge of the black squares of the base's tags.", "m", at_least=1e-3, at_most=1.0)
    ] = 0.03
    base_tags: Annotated[
        tuple[float, ...],
        Setting(
            "Centres x, y of the base's tags, the first four of the numbers 1, 2, ...",
            "m",
            check=_pairs_of_base_tags,
        ),
    ] = (-0.17, -0.06, 0.17, -0.06, -0.17, 0.18, 0.17, 0.18)
    deviation: Annotated[
        float,
        Setting("Standard deviation of a position that is simulated without pictures.", "m", at_least=0.0, at_most=0.1),
    ] = 3e-5
    calibration: Annotated[
        str, Setting("Calibration of the camera (camera_info, YAML) for who reads it; empty for the exact values.")
    ] = ""

    def every(self, rate_hz: int) -> int:
        """Return from how many samples to the next there is an exposure, at a sampling rate (Hz)."""
        return max(1, round(rate_hz / self.rate_hz))


NO_CAMERA = CameraSettings()
