"""Detection of a frozen encoder: its reading is constant although the motor must be turning.

A constant reading is no fault by itself: at rest, and where a motor reverses, the angle is within the same count for
many samples, and the filter predicts it there, too. Where the predictions keep differing from a constant reading, and
by more than the robot's tolerances explain, the encoder is frozen.

Without torque both motors come to rest, light links on friction within a sample or two, and samples of drives that are
stopped need not be evenly spaced, so that the predictions are off: then a reading must also stay while the other motor
turns.
"""

from __future__ import annotations

import math

import numpy as np

from fivebar_control.estimation.covariance import ERRORS, ERRORS_END
from fivebar_control.estimation.ekf import Estimate, FilterModel
from fivebar_control.estimation.measurements import encoder_row, share_of_errors
from fivebar_control.estimation.platform_motion import leg_at_rest
from fivebar_control.model.geometry import wrap

FEWEST = 3
"""Readings in a row that are the same before an encoder is suspected."""

LONGEST = 10
"""Readings in a row over which the differences are summed: half a count at rest must not accumulate for ever."""

COUNTS = 10.0
ANGLE = 1e-3
"""An encoder is frozen when the differences from the predictions sum to this many counts and this angle (rad)."""

DEVIATIONS = 3.0
"""Standard deviations of the constant errors by which a prediction may differ: a healthy encoder on a robot whose
geometry is known so well only."""


class FrozenWatch:
    """Compares both motors' readings with the filter's predictions."""

    def __init__(self, model: FilterModel, count: float) -> None:
        """Make a watch for encoders with counts of a size (rad), 0 for exact ones."""
        self._legs = (model.robot.leg1, model.mode1), (model.robot.leg2, model.mode2)
        self._errors = np.array(model.errors)
        self._count = count
        self._last: tuple[float, float] | None = None
        self._restart()

    def _restart(self) -> None:
        self._stays, self._beyond = [1, 1], [0.0, 0.0]

    def check(self, readings: tuple[float, float], expected: Estimate, gap: bool, coasts: bool = False) -> str | None:
        """Return the fault in words, None for none.

        Args:
            readings: of both motors (rad); call it once per sample.
            expected: the prediction for them.
            gap: whether readings before these were lost, over which the prediction is a guess.
            coasts: whether no torque is commanded any more.
        """
        last, self._last = self._last, readings
        if last is None or gap or (coasts and readings == last):
            self._restart()
            return None
        for motor in range(2):
            if readings[motor] != last[motor]:
                self._stays[motor], self._beyond[motor] = 1, 0.0
                continue
            self._stays[motor] += 1
            if self._stays[motor] <= LONGEST:
                self._beyond[motor] += self._difference(motor, readings[motor], expected)
        return self._reason(FEWEST, COUNTS * self._count + ANGLE)

    def suspected(self) -> str | None:
        """Return which encoder appears frozen, by a weaker test for inconsistent estimates; None for none."""
        return self._reason(2, COUNTS * self._count)

    def _reason(self, fewest: int, limit: float) -> str | None:
        for motor, name in enumerate(("q11", "q21")):
            if fewest <= self._stays[motor] <= LONGEST and self._beyond[motor] > limit:
                mean = self._beyond[motor] / (self._stays[motor] - 1)
                repeated = f"{name} has read the same {self._stays[motor]} times"
                away = f"while the motion is {mean:.4f} rad away from it"
                return f"{repeated}, {away} (encoder, or geometry beyond `tolerances`)"
        return None

    def _difference(self, motor: int, reading: float, expected: Estimate) -> float:
        """Return by how much a reading (rad) differs from the prediction, beyond what the geometry explains (rad)."""
        leg, mode = self._legs[motor]
        moving = leg_at_rest(leg, mode, expected.x, expected.y)
        row = encoder_row(motor + 1, moving)
        explained = float(np.linalg.norm(row[ERRORS:ERRORS_END] * self._errors))
        difference = abs(wrap(reading - math.atan2(moving.r_y, moving.r_x) - share_of_errors(expected, row)))
        return max(0.0, difference - DEVIATIONS * explained)
