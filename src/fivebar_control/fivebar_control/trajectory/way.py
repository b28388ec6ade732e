"""A path of the platform from rest to rest, without the time that it takes."""

from __future__ import annotations

from typing import NamedTuple

from fivebar_control.trajectory.rounded import RoundedPolyline


class StraightWay(NamedTuple):
    """A straight path (m)."""

    start_x: float
    start_y: float
    end_x: float
    end_y: float

    @property
    def legs(self) -> int:
        """Of how many legs it is."""
        return 1

    def at(self, s: float) -> tuple[float, float, float, float, float, float]:
        """Return the place (m) at a share s of the way, with its first and second derivative by s (m)."""
        d_x, d_y = self.end_x - self.start_x, self.end_y - self.start_y
        return self.start_x + s * d_x, self.start_y + s * d_y, d_x, d_y, 0.0, 0.0


Way = StraightWay | RoundedPolyline
"""A path from rest to rest, without the time that it takes."""
