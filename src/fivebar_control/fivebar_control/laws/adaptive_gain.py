# SPDX-License-Identifier: Apache-2.0
"""The error-based adaptive gain (4.1.3): raises the gains of the law on the locus when a switch disturbs the track.

The thesis compares what two controllers track at the moment of the switch. With one plant its output does not jump, so
the term x_CTC - x_VHC is zero, and what is compared here is the tracked error: its change, per coordinate, since the
last sample before the zone. Both coordinates must stay within the limit for the nominal gains ("and", where the thesis
prints "or"). Scaling Kp and Kd by the same alpha changes the damping; by alpha^2 and alpha it stays.
"""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from fivebar_description.settings import Setting

ENABLED = Setting("Whether the gains are raised when a switch disturbs the track.")
ALPHA = Setting("Factor of the raised gains.", "", at_least=1.0, at_most=100.0)
ERROR_LIMIT = Setting("Jump of the tracked error that raises the gains.", "m", at_least=0.0, at_most=1.0)
KEEP_DAMPING = Setting("Scale kp by alpha^2 and kd by alpha, instead of both by alpha.")


class AdaptiveGain(NamedTuple):
    """The adaptive gain of `multi_joint`."""

    enabled: Annotated[bool, ENABLED] = True
    alpha: Annotated[float, ALPHA] = 1.5
    error_limit: Annotated[float, ERROR_LIMIT] = 1e-4
    keep_damping: Annotated[bool, KEEP_DAMPING] = True


class GainMemory(NamedTuple):
    """The tracked error (m) of the last sample before the zone; NaN before the first sample."""

    error_x: float
    error_y: float


NO_MEMORY = GainMemory(math.nan, math.nan)


def gain_memory(before: GainMemory, in_zone: bool, error_x: float, error_y: float) -> GainMemory:
    """Return the memory after a sample; call it once for every sample.

    Args:
        before: after the sample before.
        in_zone: whether the constraint law contributes, sigma > 0.
        error_x, error_y: the platform's distance from the reference (m).
    """
    if not in_zone or math.isnan(before.error_x):
        return GainMemory(error_x, error_y)
    return before


def gain_factors(
    before: GainMemory, error_x: float, error_y: float, alpha: float, error_limit: float, keep_damping: bool
) -> tuple[float, float]:
    """Return the factors on (Kp, Kd) for an error (m), by its change from the stored one."""
    if abs(error_x - before.error_x) <= error_limit and abs(error_y - before.error_y) <= error_limit:
        return 1.0, 1.0
    return (alpha * alpha if keep_damping else alpha), alpha
