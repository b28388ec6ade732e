# SPDX-License-Identifier: Apache-2.0
"""What counts say: unbiased angles whose errors are as large as they claim, at any speed."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fivebar_control.estimation.encoder import (
    EXACT_ANGLE,
    MOST_REPETITIONS,
    Angle,
    angle_variance,
    count_angle,
    first_angle,
    next_angle,
    repetitions,
    with_variance,
)
from fivebar_sim.sensors import Encoder

COUNTS, RATE_HZ = 20000, 500
COUNT = 2.0 * math.pi / COUNTS


def readings(speed: float, samples: int, start: float) -> tuple[list[float], list[float]]:
    """Return exact and measured angles of a motor that turns at a constant speed."""
    encoder = Encoder(COUNTS, 1.0 / RATE_HZ)
    exact = [start + speed * sample / RATE_HZ for sample in range(samples)]
    return exact, [encoder.read(angle)[0] for angle in exact]


def angles_of(count: float, readings: list[float], speeds: list[float]) -> list[Angle]:
    """Return the angles for readings (rad) one after the other; each but the first has an expected speed (rad/s)."""
    angles, repeated = [first_angle(count, readings[0])], 1
    for last, reading, speed in zip(readings[:-1], readings[1:], speeds, strict=True):
        repeated = repetitions(last, repeated, reading)
        angles.append(next_angle(count, RATE_HZ, last, repeated, reading, speed))
    return angles


@pytest.mark.parametrize("counts_per_sample", [-7.3137, -1.3719, -0.6173, 0.4391, 0.7747, 1.6171, 12.9071])
def test_angles_are_unbiased_and_as_uncertain_as_they_say(counts_per_sample: float) -> None:
    speed = counts_per_sample * COUNT * RATE_HZ
    exact, measured = readings(speed, 4000, 1.0)
    angles = angles_of(COUNT, measured, [speed] * 3999)[1:]
    errors = np.array([angle.value for angle in angles]) - np.array(exact[1:])
    deviations = np.sqrt([angle.variance for angle in angles])
    changed = np.diff(measured) != 0.0
    assert abs(float(np.mean(errors[changed]))) < 0.03 * COUNT
    assert float(np.mean((errors[changed] / deviations[changed]) ** 2)) == pytest.approx(1.0, abs=0.15)
    assert float(np.mean((errors / deviations) ** 2)) < 1.2


def test_first_reading_is_half_a_count_too_low_on_average() -> None:
    angle = first_angle(COUNT, 5 * COUNT)
    assert angle.value == pytest.approx(5.5 * COUNT)
    assert math.sqrt(angle.variance) == pytest.approx(COUNT / math.sqrt(12.0))


def test_a_reading_that_stays_is_trusted_less_and_less_up_to_a_limit() -> None:
    repeats = MOST_REPETITIONS + 5
    readings = [0.0] * (1 + repeats) + [COUNT, COUNT]
    first, *later = angles_of(COUNT, readings, [0.0] * repeats + [0.1 * COUNT * RATE_HZ, 0.0])
    variances = [angle.variance / first.variance for angle in later[:repeats]]
    assert variances == pytest.approx([*range(2, MOST_REPETITIONS + 1), *[MOST_REPETITIONS] * 6])
    # an edge says more than a reading, and after it the trust is that of a new one
    after_edge, repeated = later[repeats:]
    assert after_edge.variance < first.variance
    assert repeated.variance == pytest.approx(2.0 * first.variance)


@pytest.mark.parametrize(
    ("counts_per_sample", "travel"),
    [(0.0, 0.2), (0.1, 0.2), (0.5, 0.5), (-0.5, 0.5), (0.9, 0.9), (1.0, 1.0), (7.0, 1.0)],
)
def test_an_edge_was_passed_within_the_travel_of_a_period(counts_per_sample: float, travel: float) -> None:
    """The angle is within that travel beyond the edge, a fifth of a count at least and a whole one at most."""
    speed = counts_per_sample * COUNT * RATE_HZ
    for reading, middle in ((COUNT, 1.0 + 0.5 * travel), (-COUNT, -0.5 * travel)):
        _, angle = angles_of(COUNT, [0.0, reading], [speed])
        assert angle.value == pytest.approx(middle * COUNT, rel=1e-12)
        assert angle.variance == pytest.approx((travel * COUNT) ** 2 / 12.0, rel=1e-12)


def test_exact_encoders_are_believed() -> None:
    count = count_angle(0)
    assert count == 0.0
    assert angles_of(count, [0.3, 0.3, 0.3], [0.0, 1.0]) == [(0.3, EXACT_ANGLE**2)] * 3


def test_counts_divide_a_revolution() -> None:
    assert count_angle(COUNTS) == COUNT
    assert count_angle(1) == 2.0 * math.pi


@pytest.mark.parametrize("readings", [2, 4, 16, 32, 64])
def test_the_mean_information_of_a_count_is_that_of_its_readings(readings: int) -> None:
    """One that is new and its repetitions: information is the inverse of a variance, and adds up. Either direction."""
    count, rate_hz = 2.0**-12, 512
    speed = count * rate_hz / readings
    variances, repeated = [next_angle(count, rate_hz, 0.0, 1, count, speed).variance], 1
    for _ in range(readings - 1):
        repeated = repetitions(count, repeated, count)
        variances.append(next_angle(count, rate_hz, count, repeated, count, speed).variance)
    expected = readings / sum(1.0 / variance for variance in variances)
    for direction in (1.0, -1.0):
        assert angle_variance(count, rate_hz, direction * speed) == pytest.approx(expected, rel=1e-12)


def test_the_mean_information_at_its_ends() -> None:
    """A motor that stands repeats its reading for ever, a fast one never does, and exact encoders need no speed."""
    one = COUNT * COUNT / 12.0
    assert angle_variance(COUNT, RATE_HZ, 0.0) == MOST_REPETITIONS * one
    for counts_per_sample in (1.0, 1.5, -7.0):
        assert angle_variance(COUNT, RATE_HZ, counts_per_sample * COUNT * RATE_HZ) == pytest.approx(one, rel=1e-12)
    for speed in (0.0, 1.0):
        assert angle_variance(0.0, RATE_HZ, speed) == EXACT_ANGLE**2


def test_an_angle_is_never_surer_than_that_of_an_exact_encoder() -> None:
    assert first_angle(1e-9, 0.5) == (0.5 + 0.5e-9, EXACT_ANGLE**2)


def test_play_adds_to_the_variance_of_an_angle() -> None:
    assert with_variance(Angle(1.0, 2.0), 3.0) == (1.0, 5.0)
