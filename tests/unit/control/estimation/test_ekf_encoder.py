"""What counts say: unbiased angles whose errors are as large as they claim, at any speed."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fivebar_control.estimation.encoder import EXACT_ANGLE, LONGEST_STAY, CountedAngle
from fivebar_sim.sensors import Encoder

COUNTS, RATE_HZ = 20000, 500
COUNT = 2.0 * math.pi / COUNTS


def readings(speed: float, samples: int, start: float) -> tuple[list[float], list[float]]:
    """Return exact and measured angles of a motor that turns at a constant speed."""
    encoder = Encoder(COUNTS, 1.0 / RATE_HZ)
    exact = [start + speed * sample / RATE_HZ for sample in range(samples)]
    return exact, [encoder.read(angle)[0] for angle in exact]


@pytest.mark.parametrize("counts_per_sample", [-7.3137, -1.3719, -0.6173, 0.4391, 0.7747, 1.6171, 12.9071])
def test_angles_are_unbiased_and_as_uncertain_as_they_say(counts_per_sample: float) -> None:
    speed = counts_per_sample * COUNT * RATE_HZ
    exact, measured = readings(speed, 4000, 1.0)
    encoder = CountedAngle(COUNTS, RATE_HZ)
    encoder.first(measured[0])
    angles = [encoder.next(reading, speed) for reading in measured[1:]]
    errors = np.array([angle.value for angle in angles]) - np.array(exact[1:])
    deviations = np.sqrt([angle.variance for angle in angles])
    changed = np.diff(measured) != 0.0
    assert abs(float(np.mean(errors[changed]))) < 0.03 * COUNT
    assert float(np.mean((errors[changed] / deviations[changed]) ** 2)) == pytest.approx(1.0, abs=0.15)
    assert float(np.mean((errors / deviations) ** 2)) < 1.2


def test_first_reading_is_half_a_count_too_low_on_average() -> None:
    angle = CountedAngle(COUNTS, RATE_HZ).first(5 * COUNT)
    assert angle.value == pytest.approx(5.5 * COUNT)
    assert math.sqrt(angle.variance) == pytest.approx(COUNT / math.sqrt(12.0))


def test_a_reading_that_stays_is_trusted_less_and_less_up_to_a_limit() -> None:
    encoder = CountedAngle(COUNTS, RATE_HZ)
    first = encoder.first(0.0)
    variances = [encoder.next(0.0, 0.0).variance / first.variance for _ in range(LONGEST_STAY + 5)]
    assert variances == pytest.approx([*range(2, LONGEST_STAY + 1), *[LONGEST_STAY] * 6])
    # an edge says more than a reading, and after it the trust is that of a new one
    assert encoder.next(COUNT, 0.1 * COUNT * RATE_HZ).variance < first.variance
    assert encoder.next(COUNT, 0.0).variance == pytest.approx(2.0 * first.variance)


@pytest.mark.parametrize(
    ("counts_per_sample", "travel"),
    [(0.0, 0.2), (0.1, 0.2), (0.5, 0.5), (-0.5, 0.5), (0.9, 0.9), (1.0, 1.0), (7.0, 1.0)],
)
def test_an_edge_was_passed_within_the_travel_of_a_period(counts_per_sample: float, travel: float) -> None:
    """The angle is within that travel beyond the edge, a fifth of a count at least and a whole one at most."""
    speed = counts_per_sample * COUNT * RATE_HZ
    for reading, middle in ((COUNT, 1.0 + 0.5 * travel), (-COUNT, -0.5 * travel)):
        encoder = CountedAngle(COUNTS, RATE_HZ)
        encoder.first(0.0)
        angle = encoder.next(reading, speed)
        assert angle.value == pytest.approx(middle * COUNT, rel=1e-12)
        assert angle.variance == pytest.approx((travel * COUNT) ** 2 / 12.0, rel=1e-12)


def test_exact_encoders_are_believed() -> None:
    encoder = CountedAngle(None, RATE_HZ)
    assert encoder.first(0.3) == (0.3, EXACT_ANGLE**2)
    assert encoder.next(0.3, 0.0) == encoder.next(0.3, 1.0) == (0.3, EXACT_ANGLE**2)
