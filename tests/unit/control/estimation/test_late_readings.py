# SPDX-License-Identifier: Apache-2.0
"""A reading counts at the time of its stamp, however late and in whatever order it comes, also by another clock."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
import pytest

from fivebar_control.estimation.covariance import CLOCK_ERROR, PASSIVE
from fivebar_control.estimation.ekf import Belief, Estimate, advanced, as_vector, filter_model
from fivebar_control.estimation.estimator import StateEstimator
from fivebar_control.estimation.homing import homing_at
from fivebar_control.estimation.late_reading import GYROSCOPE, LateReading
from fivebar_control.estimation.late_reading import PASSIVE as PASSIVE_JOINT
from fivebar_control.estimation.platform_motion import leg_motion
from fivebar_control.estimation.settings import Drives, EkfSettings, Sensing
from fivebar_control.model.geometry import inverse_geometry
from fivebar_description.parameters import FiveBar
from fivebar_description.robot_file import load_robot
from fivebar_description.sensors import LONGEST_LATENCY, KnownSensors, PassiveEncoder
from fivebar_description.tolerances import Tolerances
from fivebar_sim.sensors import Encoder

RATE_HZ, SAMPLES, COUNTS = 500, 60, 20000
TORQUE = (0.7, -0.6)
HOME = homing_at(load_robot(), (1, -1), 0.0, 0.15)
TOLERANCES = Tolerances(length=2e-4, zero=1e-3)
OLDEST = round(LONGEST_LATENCY * RATE_HZ)
LAST = SAMPLES - 1

Rates = dict[int, list[tuple[float, float]]]


class Readings(NamedTuple):
    """Motor angles (rad), rates of the distal link of leg 2 (rad/s) and its passive angle (rad), sample by sample."""

    angles: list[tuple[float, float]]
    rates: list[float]
    passive: list[float]


def recorded(robot: FiveBar, counts: int | None) -> Readings:
    """Return the readings of a platform that is accelerated from rest towards the locus, the gyroscope's with noise."""
    random = np.random.default_rng(5)
    model, truth = filter_model(robot, (1, -1), RATE_HZ, EkfSettings()), Estimate(0.0, 0.15, 0.0, 0.0, 0.0, 0.0)
    encoders = [Encoder(counts, 1.0 / RATE_HZ) for _ in range(2)] if counts is not None else []
    found = Readings([], [], [])
    for _ in range(SAMPLES):
        q = inverse_geometry(robot, (1, -1), truth.x, truth.y)
        found.angles.append((encoders[0].read(q.q11)[0], encoders[1].read(q.q21)[0]) if encoders else (q.q11, q.q21))
        found.passive.append(q.q22 + 0.003)
        noise = 0.02 + 0.01 * float(random.normal())
        found.rates.append(leg_motion(robot.leg2, -1, *truth[:4]).dtheta + noise)
        truth = advanced(model, truth, *TORQUE)
    return found


@pytest.fixture(scope="module")
def exact() -> Readings:
    """Readings of exact encoders."""
    return recorded(load_robot(), None)


def estimated(
    readings: Readings,
    arriving: Rates,
    left_out: Iterable[int] = (),
    counts: int | None = None,
    last: int = LAST,
    clock: float = 0.0,
    known: float = 0.0,
    elbows: Rates | None = None,
) -> Belief:
    """Return the belief after the last sample, with the gyroscope's readings that arrive at each."""
    drives, settings = Drives(encoder_counts=counts), EkfSettings(gyro=True, gyro_clock=clock, gyro_timeout=math.inf)
    encoder, sensors = PassiveEncoder(2 if elbows else 0, None), KnownSensors(imu_clock=known)
    estimator = StateEstimator(load_robot(), HOME, Sensing(RATE_HZ, drives, settings, TOLERANCES, encoder, sensors))
    missing = set(left_out)
    for sample in range(last + 1):
        if sample not in missing:
            late = [LateReading(GYROSCOPE, *one) for one in arriving.get(sample, [])]
            late += [LateReading(PASSIVE_JOINT, *one) for one in (elbows or {}).get(sample, [])]
            estimator.take(sample, *readings.angles[sample], *TORQUE, late)
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
            np.abs(as_vector(one.estimate) - as_vector(expected.estimate))[:4].max() for one in (found, without)
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


def test_a_reading_that_is_stamped_ahead_counts_at_the_newest_sample(exact: Readings) -> None:
    """Its clock is ahead: left out, the readings of such a clock would be missed by nobody."""
    ahead = estimated(exact, {20: [(21, exact.rates[20])]}, last=20)
    expect_different(ahead, estimated(exact, {}, last=20))
    in_time_too = estimated(exact, in_time(exact, [20]), last=20)
    assert 0.0 < np.abs(as_vector(ahead.estimate) - as_vector(in_time_too.estimate)).max() < 0.1


@pytest.mark.parametrize("latency", [1, 5])
def test_late_readings_of_a_passive_joint_count_as_ones_in_time(exact: Readings, latency: int) -> None:
    numbers = range(1, SAMPLES)
    angles = Readings(exact.angles, exact.passive, [])
    expected = estimated(exact, {}, elbows=in_time(angles, numbers))
    expect_equal(estimated(exact, {}, elbows=late(angles, numbers, latency)), expected)
    # from which it learns the zero of its encoder, as far as the lengths let it
    deviation = math.sqrt(expected.covariance[PASSIVE, PASSIVE])
    assert expected.estimate.passive == pytest.approx(0.003, abs=3.0 * deviation)
    assert deviation < 0.7 * TOLERANCES.passive_zero


@pytest.mark.parametrize("offset", [-8, 3, 8])
def test_stamps_of_a_known_clock_are_put_right(exact: Readings, offset: int) -> None:
    numbers = range(1, SAMPLES)
    expected = estimated(exact, in_time(exact, numbers))
    stamped = {number: [(number + offset, exact.rates[number])] for number in numbers}
    expect_equal(estimated(exact, stamped, known=offset / RATE_HZ), expected)


@pytest.mark.parametrize("offset", [-2.5, 2.5])
def test_the_offset_of_an_unknown_clock_is_estimated(exact: Readings, offset: float) -> None:
    """Of 5 ms, from 0.1 s of motion."""
    stamped = {number: [(number + offset, exact.rates[number])] for number in range(1, SAMPLES)}
    expected = estimated(exact, in_time(exact, range(1, SAMPLES)))
    found = estimated(exact, stamped, clock=0.005)
    assert found.estimate.clock == pytest.approx(
        offset / RATE_HZ, abs=3.0 * math.sqrt(found.covariance[CLOCK_ERROR, CLOCK_ERROR])
    )
    assert math.sqrt(found.covariance[CLOCK_ERROR, CLOCK_ERROR]) < 1e-3
    assert np.hypot(*(as_vector(found.estimate) - as_vector(expected.estimate))[2:4]) < 2e-3


def test_every_late_reading_counts_for_whether_they_agree(exact: Readings) -> None:
    """All wrong by 0.3 rad/s, and all with the last sample: one of them could be chance."""

    def after(readings: int) -> StateEstimator:
        settings = EkfSettings(gyro=True, gyro_timeout=math.inf)
        estimator = StateEstimator(load_robot(), HOME, Sensing(RATE_HZ, Drives(), settings, TOLERANCES))
        for sample in range(SAMPLES):
            made = range(SAMPLES - readings, SAMPLES) if sample == LAST else ()
            rates = [LateReading(GYROSCOPE, number, exact.rates[number] + 0.3 * (-1) ** number) for number in made]
            estimator.take(sample, *exact.angles[sample], *TORQUE, rates)
        return estimator

    assert after(1).fault is None
    fault = after(8).fault
    assert fault is not None
    assert str(fault).startswith(f"estimate_inconsistent: at sample {LAST} the gyroscope differs")
