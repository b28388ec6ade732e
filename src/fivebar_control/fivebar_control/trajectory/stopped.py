# SPDX-License-Identifier: Apache-2.0
"""A motion that stops on its way, and one that goes on from there: its time slows down, or sets in again."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, cast

from fivebar_control.model.line import Line
from fivebar_control.model.state import Platform
from fivebar_control.trajectory.joint_segment import NO_LINE
from fivebar_control.trajectory.path import AnySegment, Path
from fivebar_control.trajectory.time_scaling import rest_to_rest


class StoppedSegment(NamedTuple):
    """One motion along a path that stops before its end.

    Attributes:
        path: that of the motion, which begins at time 0.
        begin: when it begins to slow down (s).
        slowing: how long that takes (s); the path goes on by half of it.
        start_time: s since sample 0.
    """

    path: Path
    begin: float
    slowing: float
    start_time: float = 0.0

    @property
    def duration(self) -> float:
        """From the beginning of the motion until it stands still (s)."""
        return self.begin + self.slowing

    @property
    def end(self) -> float:
        """The time of the path at which the motion ends (s)."""
        return self.begin + 0.5 * self.slowing

    def as_path(self) -> Path:
        """Return the motion as a path of its own."""
        return Path(cast(Sequence[AnySegment], [self]))

    def at(self, t: float) -> Platform:
        """Return the reference at time t (s): that of the path until it slows down."""
        since = t - self.start_time
        if since <= self.begin:
            return self.path.at(since)
        tau, rate, bend = self._progress(since)
        return _paced(self.path, tau, rate, bend)

    def line_at(self, t: float) -> Line:
        """Return NaN: its line changes with the path."""
        return NO_LINE

    def _progress(self, since: float) -> tuple[float, float, float]:
        """Return the time of the path (s), its rate, and how that changes (1/s)."""
        u = min(max((since - self.begin) / self.slowing, 0.0), 1.0)
        if u == 0.0:
            return since, 1.0, 0.0
        if u == 1.0:
            return self.end, 0.0, 0.0
        lost, slope, _ = rest_to_rest(u)
        return self.begin + self.slowing * (u - _area(u)), 1.0 - lost, -slope / self.slowing


class ResumedSegment(NamedTuple):
    """The rest of a motion along a path, from where it has stopped.

    Attributes:
        path: that of the whole motion, which begins at time 0.
        begin: the time of the path at which it has stopped (s).
        rising: how long it takes until the motion is as quick as the path (s); it goes on by half of that.
        start_time: s since sample 0.
    """

    path: Path
    begin: float
    rising: float
    start_time: float = 0.0

    @property
    def duration(self) -> float:
        """From where it stands until the end of the path (s)."""
        return self.path.duration - self.begin + 0.5 * self.rising

    def as_path(self) -> Path:
        """Return the motion as a path of its own."""
        return Path(cast(Sequence[AnySegment], [self]))

    def at(self, t: float) -> Platform:
        """Return the reference at time t (s); before and after the motion the platform rests."""
        tau, rate, bend = self._progress(t - self.start_time)
        return _paced(self.path, tau, rate, bend)

    def line_at(self, t: float) -> Line:
        """Return NaN: its line changes with the path."""
        return NO_LINE

    def _progress(self, since: float) -> tuple[float, float, float]:
        """Return the time of the path (s), its rate, and how that changes (1/s)."""
        u = min(max(since / self.rising, 0.0), 1.0)
        if u == 1.0:
            return self.begin + since - 0.5 * self.rising, 1.0, 0.0
        gained, slope, _ = rest_to_rest(u)
        return self.begin + self.rising * _area(u), gained, slope / self.rising


def _area(u: float) -> float:
    """Return the integral of the polynomial from rest to rest from 0 to u."""
    return u * u * u * u * (2.5 + u * (u - 3.0))


def _paced(path: Path, tau: float, rate: float, bend: float) -> Platform:
    """Return the reference of a path at its time tau (s), which passes at a rate that changes by `bend` (1/s)."""
    place = path.at(tau)
    return Platform(
        place.x,
        place.y,
        place.vx * rate,
        place.vy * rate,
        place.ax * rate * rate + place.vx * bend,
        place.ay * rate * rate + place.vy * bend,
    )
