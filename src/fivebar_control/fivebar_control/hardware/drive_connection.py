# SPDX-License-Identifier: Apache-2.0
"""The knowledge of a bridge of its drives before it opens them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from fivebar_control.hardware.drive_interface import DriveInterface, JointTarget

InnerLoop = Callable[[Sequence[float], Sequence[float], Sequence[float]], JointTarget | None]
"""Target that the drives follow besides the torque of a sample, None where there is none: from x, y (m), vx, vy (m/s)
of the reference, and q11, q12, q21, q22 (rad) with their rates (rad/s)."""


class Bell:
    """Rung by another thread when a measurement has come, where the drives set the pace of the cycles."""

    def __init__(self) -> None:
        """Have nobody hear it."""
        self.heard: Callable[[], None] = _nobody
        """Called in the thread that rings."""

    def ring(self) -> None:
        """Say that a measurement has come."""
        self.heard()


def _nobody() -> None:
    """Do nothing."""


class DriveConnection(NamedTuple):
    """The drives of a configuration.

    Attributes:
        period_us: their sampling period.
        period_key: the key of the configuration that says so.
        tend_period: how often (s) they are tended while inactive.
        open: opens and sets up both, or raises a `DriveError`; takes how many cycles in a row may be without an answer
            where the configuration does not say so.
        waits: whether the robot moves on with the commands alone, so that a cycle may wait for its torque.
        inner_loop: the targets of the drives' own control, where they are to close a loop.
        bell: rung when a measurement has come, where the drives set the pace of the cycles.
    """

    period_us: int
    period_key: str
    tend_period: float
    open: Callable[..., DriveInterface]
    waits: bool = False
    inner_loop: InnerLoop | None = None
    bell: Bell | None = None
