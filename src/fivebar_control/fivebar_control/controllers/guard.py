"""The last decision before the drives: blend the candidates, and command zero torque once something is wrong."""

from __future__ import annotations

import math
from typing import NamedTuple

from fivebar_control.controllers.blend import blend
from fivebar_control.controllers.torque import ZERO, Torque


class Fault(NamedTuple):
    """A named cause for zero torque, and what was seen."""

    name: str
    detail: str

    def __str__(self) -> str:
        """Return the text that is published: the name, a colon, the detail."""
        return f"{self.name}: {self.detail}"


class Guard:
    """Blends candidate torques and latches the first fault."""

    def __init__(self, tracking_error_limit: float) -> None:
        """Make a guard that gives up where the platform is further than the limit (m) from the reference."""
        self._tracking_error_limit = tracking_error_limit
        self.fault: Fault | None = None

    def trip(self, name: str, detail: str) -> None:
        """Latch a fault, unless one is latched already."""
        if self.fault is None:
            self.fault = Fault(name, detail)

    def reset(self) -> None:
        """Clear the latched fault."""
        self.fault = None

    def command(self, sample: int, tracking_error: float, sigma: float, away: Torque, on_locus: Torque) -> Torque:
        """Return the torque to command (Nm): the blend, or zero once a fault is latched.

        Args:
            sample: number of the sample, for the fault's text.
            tracking_error: distance (m) of the platform from the reference.
            sigma: blending weight.
            away: candidate for sigma = 0.
            on_locus: candidate for sigma = 1.
        """
        if self.fault is not None:
            return ZERO
        if not tracking_error <= self._tracking_error_limit:
            self.trip(
                "tracking_lost",
                f"{tracking_error * 1e3:.1f} mm from the reference at sample {sample},"
                f" limit {self._tracking_error_limit * 1e3:.1f} mm",
            )
            return ZERO
        torque = blend(sigma, away, on_locus)
        if not (math.isfinite(torque.tau1) and math.isfinite(torque.tau2)):
            self.trip(
                "torque_undefined",
                f"candidate torque ({torque.tau1}, {torque.tau2}) Nm at sample {sample}, sigma = {sigma:.3f}",
            )
            return ZERO
        return torque
