"""The error-based adaptive gain (4.1.3): raises the gains of the law on the locus when a switch disturbs the track.

The thesis compares what two controllers track at the moment of the switch. With one plant its output does not jump, so
the term x_CTC - x_VHC is zero, and what is compared here is the tracked error: its change, per coordinate, since the
last sample before the zone. Both coordinates must stay within the limit for the nominal gains ("and", where the thesis
prints "or"). Scaling Kp and Kd by the same alpha changes the damping; by alpha^2 and alpha it stays.
"""

from __future__ import annotations

from typing import NamedTuple


class AdaptiveGainSettings(NamedTuple):
    """Factor alpha (at least 1), the limit on the jump of the tracked error (m), and whether the damping is kept."""

    alpha: float = 1.5
    error_limit: float = 1e-4
    keep_damping: bool = True


class AdaptiveGain:
    """Follows the tracked error sample by sample and gives the factors on the gains."""

    def __init__(self, settings: AdaptiveGainSettings) -> None:
        """Start outside any blending zone."""
        self._settings = settings
        self._before: tuple[float, float] | None = None

    def factors(self, in_zone: bool, error_x: float, error_y: float) -> tuple[float, float]:
        """Return the factors on (Kp, Kd) for a sample; call it once for every sample.

        Args:
            in_zone: whether the law on the locus has a say, sigma > 0.
            error_x, error_y: the platform's distance from the reference (m).
        """
        if not in_zone or self._before is None:
            self._before = (error_x, error_y)
            return 1.0, 1.0
        settings = self._settings
        jump_x, jump_y = abs(error_x - self._before[0]), abs(error_y - self._before[1])
        if jump_x <= settings.error_limit and jump_y <= settings.error_limit:
            return 1.0, 1.0
        alpha = settings.alpha
        return (alpha * alpha if settings.keep_damping else alpha), alpha
