# SPDX-License-Identifier: Apache-2.0
"""When the IMU's readings are made and arrive, and the gyroscope's errors: a sample at a time, and all at once."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from fivebar_description.imu import ImuSettings
from fivebar_description.sensors import ReadingSchedule
from fivebar_sim.sensors import Gyroscope, Imu, ReadingQueue, gyro_errors, gyro_stream, lost_readings

RATE_HZ, SAMPLES = 500, 400

SETTINGS = [
    ImuSettings(),
    ImuSettings(latency=0.004),
    ImuSettings(rate_hz=100),
    ImuSettings(rate_hz=100, latency=0.01, lost=0.2),
    ImuSettings(rate_hz=50, latency=0.003, lost=0.05),
    ImuSettings(lost=1.0),
    # faster than the samples: one per sample
    ImuSettings(rate_hz=1000, latency=0.1),
]


@pytest.mark.parametrize(
    ("settings", "rate_hz", "expected"),
    [
        (ImuSettings(), 500, ReadingSchedule(1, 0)),
        (ImuSettings(rate_hz=100, latency=0.004), 500, ReadingSchedule(5, 2)),
        (ImuSettings(rate_hz=100, latency=0.004), 1000, ReadingSchedule(10, 4)),
        # rounded
        (ImuSettings(rate_hz=120, latency=0.0049), 500, ReadingSchedule(4, 2)),
        (ImuSettings(rate_hz=800), 500, ReadingSchedule(1, 0)),
    ],
)
def test_rate_and_latency_are_whole_samples(settings: ImuSettings, rate_hz: int, expected: ReadingSchedule) -> None:
    assert settings.schedule(rate_hz) == expected


@pytest.mark.parametrize("settings", SETTINGS)
def test_readings_arrive_by_the_schedule_but_for_the_lost_ones(settings: ImuSettings) -> None:
    every, latency = settings.schedule(RATE_HZ)
    lost = lost_readings(settings, 7, SAMPLES)
    queue: ReadingQueue[str] = ReadingQueue(settings, RATE_HZ, 7)
    for sample in range(SAMPLES):
        made = sample - latency
        expected = [(made, f"of {made}")] if made >= 0 and made % every == 0 and not lost[made] else []
        assert queue.arrived(sample, f"of {sample}") == expected


def test_so_many_are_lost_as_is_said_and_which_ones_is_the_seeds_choice() -> None:
    settings = ImuSettings(lost=0.2)
    lost = lost_readings(settings, 3, 20_000)
    # five standard deviations of a binomial
    assert float(np.mean(lost)) == pytest.approx(0.2, abs=5.0 * np.sqrt(0.2 * 0.8 / 20_000))
    assert np.array_equal(lost, lost_readings(settings, 3, 20_000))
    assert not np.array_equal(lost, lost_readings(settings, 4, 20_000))
    assert not lost_readings(ImuSettings(), 3, 1000).any()


@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_errors_drawn_one_by_one_are_those_drawn_at_once(noise: float) -> None:
    settings = ImuSettings(gyro_noise=noise, gyro_bias=0.02)
    stream, at_once = gyro_stream(11), gyro_errors(settings, gyro_stream(11), SAMPLES)
    one_by_one = [gyro_errors(settings, stream, 1)[0] for _ in range(SAMPLES)]
    assert np.array_equal(one_by_one, at_once)
    assert float(at_once.std()) == pytest.approx(noise, rel=0.2, abs=1e-15)
    assert float(at_once.mean()) == pytest.approx(0.02, abs=5.0 * noise / np.sqrt(SAMPLES) + 1e-15)


def test_a_mounted_gyroscope_gives_back_the_links_rate_with_its_errors() -> None:
    settings = ImuSettings(gyro_noise=0.01, gyro_bias=0.02, roll=0.4, pitch=-0.7, yaw=2.1, noise=0.3)
    imu = Imu(settings, RATE_HZ, 11)
    rates = np.random.default_rng(12).uniform(-10.0, 10.0, SAMPLES)
    readings = [imu.read((0.0, 0.0), 0.0, rate, 0.0).angular_velocity for rate in rates.tolist()]
    found = [settings.turn_rate(reading) for reading in readings]
    # whatever the noise of the accelerometer
    expected = rates + gyro_errors(settings, gyro_stream(11), SAMPLES)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-14)
    # a rotation of the IMU about its own axes takes most of the rate out of each of them
    assert max(abs(one[2]) for one in readings) < 0.8 * float(np.abs(expected).max())


@pytest.mark.parametrize("cut_off", [20.0, 60.0])
def test_the_gyroscopes_low_pass_is_that_of_a_fast_filter_between_its_samples(cut_off: float) -> None:
    """A slow turn passes late, a vibration that the readings would alias hardly at all: against a filter at 100 kHz."""
    fine, ratio = 100_000, 100_000 // RATE_HZ
    times = np.arange(fine // 2) / fine
    slow, quick = 2.0 * np.pi * 3.0, 2.0 * np.pi * 0.93 * RATE_HZ
    rates = np.cos(slow * times) + 0.5 * np.cos(quick * times)
    angles = np.sin(slow * times) / slow + 0.5 * np.sin(quick * times) / quick
    kept = np.exp(-2.0 * np.pi * cut_off / fine)
    truth = lfilter([1.0 - kept], [1.0, -kept], rates)[::ratio]
    gyroscope = Gyroscope(ImuSettings(gyro_bandwidth_hz=cut_off), RATE_HZ, 0)
    read = [gyroscope.read(angle, rate) for angle, rate in zip(angles[::ratio], rates[::ratio], strict=True)]
    settled = RATE_HZ // 10
    # without a low-pass the whole vibration would be in the readings; a first-order filter leaves its f_c / f
    assert np.abs(rates[::ratio] - truth)[settled:].max() > 0.4
    vibration = 0.5 * 2.0 * np.pi * cut_off / quick
    np.testing.assert_allclose(read[settled:], truth[settled:], rtol=0.0, atol=0.01 + vibration)


@pytest.mark.parametrize("cut_off", [16.0, 60.0, 150.0, 1e4])
def test_the_lag_of_the_low_pass_is_what_a_steadily_growing_rate_shows(cut_off: float) -> None:
    settings, growth = ImuSettings(gyro_bandwidth_hz=cut_off), 7.0
    gyroscope = Gyroscope(settings, RATE_HZ, 0)
    times = np.arange(RATE_HZ) / RATE_HZ
    read = [gyroscope.read(0.5 * growth * time**2, growth * time) for time in times.tolist()]
    lag = max(1.0 / (2.0 * np.pi * cut_off), 0.5 / RATE_HZ)
    assert read[-1] == pytest.approx(growth * (times[-1] - lag), abs=1e-9)
    assert settings.gyro_lag(1.0 / RATE_HZ) == pytest.approx(lag, rel=1e-12)
    assert ImuSettings().gyro_lag(1.0 / RATE_HZ) == 0.0


def test_a_missing_sample_leaves_the_low_pass_where_a_steady_turn_has_it() -> None:
    settings = ImuSettings(gyro_bandwidth_hz=30.0)
    every, gaps = Gyroscope(settings, RATE_HZ, 0), Gyroscope(settings, RATE_HZ, 0)
    for gyroscope in (every, gaps):
        gyroscope.read(0.0, 0.0)
    for number in range(1, 13):
        steady = every.read(2.0 * number / RATE_HZ, 2.0)
        if number % 4 == 0:
            assert gaps.read(2.0 * number / RATE_HZ, 2.0, periods=4) == pytest.approx(steady, rel=1e-12)


def test_only_the_rate_about_the_links_axis_counts() -> None:
    settings = ImuSettings(roll=0.4, pitch=-0.7, yaw=2.1)
    rotation = np.array(settings.rotation())
    across = rotation.T @ np.array([3.0, -2.0, 0.0])
    assert settings.turn_rate(tuple(across.tolist())) == pytest.approx(0.0, abs=1e-14)
