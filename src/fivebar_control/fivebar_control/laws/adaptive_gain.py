"""The error-based adaptive gain (4.1.3): raises the gains of the law on the locus when a switch disturbs the track.

The thesis compares what two controllers track at the moment of the switch. With one plant its output does not jump, so
the term x_CTC - x_VHC is zero, and what is compared here is the tracked error: its change, per coordinate, since the
last sample before the zone. Both coordinates must stay within the limit for the nominal gains ("and", where the thesis
prints "or"). Scaling Kp and Kd by the same alpha changes the damping; by alpha^2 and alpha it stays.
"""

from __future__ import annotations

import math
from typing import NamedTuple


class AdaptiveGainSettings(NamedTuple):
    """Factor alpha (at least 1), the limit on the jump of the tracked error (m), and whether the damping is kept."""

    alpha: float = 1.5
    error_limit: float = 1e-4
    keep_damping: bool = True


class GainMemory(NamedTuple):
    """The tracked error (m) of the last sample before the zone; NaN before the first sample."""

    error_x: float
    error_y: float


NO_MEMORY = GainMemory(math.nan, math.nan)


def gain_memory(before: GainMemory, in_zone: bool, error_x: float, error_y: float) -> GainMemory:
    """Return what is remembered after a sample; arguments as for :meth:`AdaptiveGain.factors`."""
    if not in_zone or math.isnan(before.error_x):
        return GainMemory(error_x, error_y)
    return before


def gain_factors(
    before: GainMemory, error_x: float, error_y: float, alpha: float, error_limit: float, keep_damping: bool
) -> tuple[float, float]:
    """Return the factors on (Kp, Kd) for an error (m), by its jump from the one that is remembered."""
    if abs(error_x - before.error_x) <= error_limit and abs(error_y - before.error_y) <= error_limit:
        return 1.0, 1.0
    return (alpha * alpha if keep_damping else alpha), alpha


class AdaptiveGain:
    """Follows the tracked error sample by sample and gives the factors on the gains."""

    def __init__(self, settings: AdaptiveGainSettings) -> None:
        """Start outside any blending zone."""
        self._settings = settings
        self._before = NO_MEMORY

    def factors(self, in_zone: bool, error_x: float, error_y: float) -> tuple[float, float]:
        """Return the factors on (Kp, Kd) for a sample; call it once for every sample.

        Args:
            in_zone: whether the law on the locus has a say, sigma > 0.
            error_x, error_y: the platform's distance from the reference (m).
        """
        self._before = gain_memory(self._before, in_zone, error_x, error_y)
        return gain_factors(self._before, error_x, error_y, *self._settings)
