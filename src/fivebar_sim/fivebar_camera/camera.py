# SPDX-License-Identifier: Apache-2.0
"""The simulated camera, sample by sample: it exposes the moving robot and delivers the pictures later."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from fivebar_camera.frames import Frame, FrameSchedule
from fivebar_camera.renderer import Picture, RenderedPosture, Renderer, posture_of
from fivebar_description.camera import CameraSettings
from fivebar_description.interface import NANOSECONDS
from fivebar_description.parameters import FiveBar

Joints = Sequence[float]


class Delivered(NamedTuple):
    """A picture, or a position in its place, that arrives from the camera.

    Attributes:
        sample: that of the middle of its exposure.
        picture: None where the position is simulated instead.
        x, y: that position (m), NaN with a picture.
    """

    sample: int
    picture: Picture | None
    x: float
    y: float


class Moving(NamedTuple):
    """The four joints (rad), their rates (rad/s) and accelerations (rad/s^2) at an exposure, from which it is drawn."""

    robot: FiveBar
    position: Joints
    velocity: Joints
    acceleration: Joints

    def at(self, time: float) -> RenderedPosture:
        """Return the posture at a time (s) from the sample."""
        q11, _, q21, q22 = (
            q + time * (dq + 0.5 * time * ddq)
            for q, dq, ddq in zip(self.position, self.velocity, self.acceleration, strict=True)
        )
        return posture_of(self.robot, q11, q21, q22)


class Camera:
    """The camera above a robot; call `take` once for every sample, in their order."""

    def __init__(self, robot: FiveBar, settings: CameraSettings, rate_hz: int, seed: int) -> None:
        """Begin before sample 0, with the actual robot; the seed is that of noise, latency and losses."""
        self._robot, self._settings, self._rate_hz = robot, settings, rate_hz
        self._renderer = Renderer(robot, settings, seed) if settings.pictures else None
        self._schedule = FrameSchedule(settings, rate_hz, seed)
        self._seen: dict[int, Delivered] = {}
        self._before: Joints | None = None

    def take(self, sample: int, position: Joints, velocity: Joints, skips: bool = False) -> list[Delivered]:
        """Return what arrives with a sample, given the exact joints (rad) and their rates (rad/s) at it.

        Where it `skips` there is no exposure at this sample, since there would be no time to render it.
        """
        frame = None if skips else self._schedule.exposed(sample)
        if frame is not None:
            self._seen[frame.number] = self._exposed(frame, position, velocity)
        self._before = velocity
        return [self._seen.pop(due.number) for due in self._schedule.arrived(sample)]

    def stamp_ns(self, sample_stamp_ns: int) -> int:
        """Return the camera's stamp (ns) of a picture by that of its sample (ns)."""
        return sample_stamp_ns + round(self._settings.clock_offset * NANOSECONDS)

    def _exposed(self, frame: Frame, position: Joints, velocity: Joints) -> Delivered:
        before = self._before or velocity
        a, b, c, d = ((now - then) * self._rate_hz for now, then in zip(velocity, before, strict=True))
        moving = Moving(self._robot, position, velocity, (a, b, c, d))
        if self._renderer is None:
            x, y = moving.at(0.0).platform
            spread = self._settings.deviation
            return Delivered(frame.sample, None, x + spread * frame.noise_x, y + spread * frame.noise_y)
        picture = self._renderer.picture(frame.number, moving.at)
        return Delivered(frame.sample, picture, float("nan"), float("nan"))
