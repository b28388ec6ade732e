# SPDX-License-Identifier: Apache-2.0
"""Measurement model of an incremental encoder: the angle and its variance for each reading.

The encoder rounds down to a count. A reading that has just changed carries more information than a single one: the
angle crossed the count's edge within the last period. A repeated reading carries less each time: its error is that of
the reading before, and a filter that took it as independent would become overconfident. On the locus, where the motors
reverse, half a count is a millimetre of the platform.
"""

from __future__ import annotations

import math
from typing import NamedTuple

EXACT_ANGLE = 1e-6
"""Standard deviation (rad) that is assumed of an encoder without counts."""

LEAST_TRAVEL = 0.2
"""Least travel since the edge that is assumed, in counts: the speed from which it follows is an estimate."""

MOST_REPETITIONS = 20
"""Repetitions of a reading beyond which its variance does not grow further."""


class Angle(NamedTuple):
    """An angle (rad) and its variance (rad^2)."""

    value: float
    variance: float


def count_angle(counts: int) -> float:
    """Return the angle of a count (rad) for so many counts per revolution; 0 for exact encoders, which have none."""
    return 2.0 * math.pi / counts if counts > 0 else 0.0


def first_angle(count: float, reading: float, samples: int = 1) -> Angle:
    """Return the angle for a first reading (rad), the same for some samples: uniform over the count (rad) above it."""
    return Angle(reading + 0.5 * count, _repeated_variance(count, samples))


def repetitions(last: float, repeated: int, reading: float) -> int:
    """Return for how many samples a reading (rad) has been the same; `last` and `repeated` are of the sample before."""
    return min(repeated + 1, MOST_REPETITIONS) if reading == last else 1


def next_angle(count: float, rate_hz: int, last: float, repeated: int, reading: float, speed: float) -> Angle:
    """Return the angle for a reading (rad) after another.

    Args:
        count: angle of a count (rad), 0 for an exact encoder.
        rate_hz: samples per second.
        last: the reading before (rad).
        repeated: :func:`repetitions` of this reading.
        reading: the reading (rad).
        speed: expected speed (rad/s).
    """
    if count == 0.0:
        return Angle(reading, EXACT_ANGLE * EXACT_ANGLE)
    if reading == last:
        return first_angle(count, reading, repeated)
    travel = min(1.0, max(LEAST_TRAVEL, abs(speed) / (rate_hz * count)))
    width = travel * count
    if reading > last:
        return Angle(reading + 0.5 * travel * count, width * width / 12.0)
    return Angle(reading + (1.0 - 0.5 * travel) * count, width * width / 12.0)


def _repeated_variance(count: float, samples: int) -> float:
    """Return the variance (rad^2) of a reading that has been the same for so many samples."""
    return max(count * count / 12.0, EXACT_ANGLE * EXACT_ANGLE) * samples


def with_variance(angle: Angle, variance: float) -> Angle:
    """Return an angle with a further variance (rad^2): that between the motor, where the encoder is, and the link."""
    return Angle(angle.value, angle.variance + variance)


def angle_variance(count: float, rate_hz: int, speed: float) -> float:
    """Return the variance (rad^2) that the readings of an encoder have on average at a speed (rad/s).

    Of the readings within a count one is new and the others repeat it; their information adds up.
    """
    if count == 0.0:
        return EXACT_ANGLE * EXACT_ANGLE
    readings = rate_hz * count / abs(speed) if speed != 0.0 else math.inf
    if readings <= 1.0:
        return _repeated_variance(count, 1)
    if math.isinf(readings):
        return _repeated_variance(count, MOST_REPETITIONS)
    width = max(LEAST_TRAVEL, 1.0 / readings) * count
    information = 12.0 / (width * width)
    repeats = 0.0
    for repeated in range(2, int(min(readings, float(MOST_REPETITIONS))) + 1):
        repeats += 1.0 / _repeated_variance(count, repeated)
    information += repeats
    information += max(readings - MOST_REPETITIONS, 0.0) / _repeated_variance(count, MOST_REPETITIONS)
    return readings / information
