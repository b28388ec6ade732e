"""A gyroscope's reading counts at the time of its stamp, however late and in whatever order it comes."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
import pytest

from fivebar_control.estimation.ekf import Belief, EkfSettings, Estimate, advanced, filter_model
from fivebar_control.estimation.estimator import StateEstimator
from fivebar_control.estimation.homing import homing_at
from fivebar_control.estimation.platform_motion import leg_motion
from fivebar_control.estimation.step import Drives
from fivebar_control.model.geometry import inverse_geometry
from fivebar_description.imu import LONGEST_LATENCY
from fivebar_description.parameters import FiveBar, load_robot
from fivebar_description.tolerances import Tolerances
from fivebar_sim.sensors import Encoder

RATE_HZ, SAMPLES, COUNTS = 500, 60, 20000
TORQUE = (0.7, -0.6)
HOME = homing_at(load_robot(), 1, -1, 0.0, 0.15)
TOLERANCES = Tolerances(length=2e-4, zero=1e-3)
OLDEST = round(LONGEST_LATENCY * RATE_HZ)
LAST = SAMPLES - 1

Rates = dict[int, list[tuple[int, float]]]


class Readings(NamedTuple):
    """Motor angles (rad) and rates of the distal link (rad/s), sample by sample."""

    angles: list[tuple[float, float]]
    rates: list[float]


def recorded(robot: FiveBar, counts: int | None) -> Readings:
    """Return the readings of a platform that is accelerated from rest towards the locus, the gyroscope's with noise."""
    random = np.random.default_rng(5)
    model, truth = filter_model(robot, 1, -1, RATE_HZ, EkfSettings()), Estimate(0.0, 0.15, 0.0, 0.0, 0.0, 0.0)
    encoders = [Encoder(counts, 1.0 / RATE_HZ) for _ in range(2)] if counts is not None else []
    found = Readings([], [])
    for _ in range(SAMPLES):
        q = inverse_geometry(robot, 1, -1, truth.x, truth.y)
        found.angles.append((encoders[0].read(q.q11)[0], encoders[1].read(q.q21)[0]) if encoders else (q.q11, q.q21))
        noise = 0.02 + 0.01 * float(random.normal())
        found.rates.append(leg_motion(robot.leg2, -1, *truth[:4]).dtheta + noise)
        truth = advanced(model, truth, *TORQUE)
    return found


@pytest.fixture(scope="module")
def exact() -> Readings:
    """Readings of exact encoders."""
    return recorded(load_robot(), None)


def estimated(
    readings: Readings, arriving: Rates, left_out: Iterable[int] = (), counts: int | None = None, last: int = LAST
) -> Belief:
    """Return the belief after the last sample, with the gyroscope's readings that arrive at each."""
    drives, settings = Drives(encoder_counts=counts), EkfSettings(gyro=True)
    estimator = StateEstimator(load_robot(), HOME, RATE_HZ, drives, settings, TOLERANCES)
    missing = set(left_out)
    for sample in range(last + 1):
        if sample not in missing:
            estimator.take(sample, *readings.angles[sample], *TORQUE, arriving.get(sample, []))
    assert estimator.fault is None
    assert estimator.belief is not None
    return estimator.belief


def in_time(readings: Readings, numbers: Iterable[int]) -> Rates:
    return {number: [(number, readings.rates[number])] for number in numbers}


def late(readings: Readings, numbers: Iterable[int], latency: int, left_out: Iterable[int] = ()) -> Rates:
    """Return readings that come so many samples late, those of the end with the last sample.

    What would come with a sample that is left out comes with the next one.
    """
    found: Rates = {}
    for number in numbers:
        arrival = min(number + latency, LAST)
        while arrival in set(left_out):
            arrival += 1
        found.setdefault(arrival, []).append((number, readings.rates[number]))
    return found


def expect_equal(found: Belief, expected: Belief) -> None:
    """To the last bit."""
    assert found.estimate == expected.estimate
    assert np.array_equal(found.covariance, expected.covariance)


def expect_different(found: Belief, other: Belief) -> None:
    assert abs(found.estimate.bias - other.estimate.bias) > 1e-6
    assert not np.array_equal(found.covariance, other.covariance)


@pytest.mark.parametrize("every", [1, 5])
@pytest.mark.parametrize("latency", range(1, 9))
def test_a_late_reading_counts_as_one_in_time(exact: Readings, latency: int, every: int) -> None:
    numbers = range(every, SAMPLES, every)
    expected = estimated(exact, in_time(exact, numbers))
    expect_equal(estimated(exact, late(exact, numbers, latency)), expected)
    expect_different(expected, estimated(exact, {}))


@pytest.mark.parametrize("latency", [1, 3, 8])
def test_a_late_reading_counts_over_a_gap_in_the_motor_readings(exact: Readings, latency: int) -> None:
    left_out = (20, 21, 22, 40, 50, 51)
    numbers = [number for number in range(1, SAMPLES) if number not in left_out]
    expected = estimated(exact, in_time(exact, numbers), left_out)
    expect_equal(estimated(exact, late(exact, numbers, latency, left_out), left_out), expected)


def test_with_counted_angles_a_late_reading_counts_almost_as_one_in_time() -> None:
    """Angles between the counts are those of the speeds that were predicted then, without the late readings."""
    counted = recorded(load_robot(), COUNTS)
    numbers = range(1, SAMPLES)
    expected = estimated(counted, in_time(counted, numbers), counts=COUNTS)
    without = estimated(counted, {}, counts=COUNTS)
    for latency in (1, 4, 8):
        found = estimated(counted, late(counted, numbers, latency), counts=COUNTS)
        off, gained = (
            np.abs(np.array(one.estimate) - np.array(expected.estimate))[:4].max() for one in (found, without)
        )
        assert off < 0.05 * gained


def test_the_order_of_arrival_does_not_matter(exact: Readings) -> None:
    numbers = range(1, SAMPLES)
    expected = estimated(exact, in_time(exact, numbers))
    # each sample brings the readings of four samples, in any order and long ago
    random = np.random.default_rng(6)
    arriving: Rates = {}
    for first in range(1, SAMPLES, 4):
        group = [(number, exact.rates[number]) for number in range(first, min(first + 4, SAMPLES))]
        random.shuffle(group)
        arriving[min(first + 7, LAST)] = [*arriving.get(min(first + 7, LAST), []), *group]
    expect_equal(estimated(exact, arriving), expected)
    # later ones first, two samples apart
    swapped: Rates = {}
    for number in numbers:
        arrival = min(number + (1 if number % 2 else 4), LAST)
        swapped.setdefault(arrival, []).append((number, exact.rates[number]))
    expect_equal(estimated(exact, swapped), expected)


def test_a_reading_counts_up_to_the_longest_latency_and_not_beyond(exact: Readings) -> None:
    made = 30
    expected = estimated(exact, in_time(exact, [made]))
    without = estimated(exact, {})
    expect_different(expected, without)
    expect_equal(estimated(exact, late(exact, [made], OLDEST)), expected)
    for latency in (OLDEST + 1, OLDEST + 2, 2 * OLDEST):
        expect_equal(estimated(exact, late(exact, [made], latency)), without)


def test_a_reading_of_sample_0_is_left_out(exact: Readings) -> None:
    """It is the start of the filter, which is at rest by declaration."""
    without = estimated(exact, {})
    for arrival in (0, 1, 5):
        expect_equal(estimated(exact, {arrival: [(0, exact.rates[0])]}), without)


def test_a_reading_of_a_sample_without_motor_readings_is_left_out(exact: Readings) -> None:
    left_out = (20, 21)
    without = estimated(exact, {}, left_out)
    for arrival in (22, 25):
        expect_equal(estimated(exact, {arrival: [(20, 1.0), (21, 2.0)]}, left_out), without)


def test_a_reading_of_a_sample_to_come_is_left_out(exact: Readings) -> None:
    expect_equal(estimated(exact, {20: [(21, 1.0)]}), estimated(exact, {}))
