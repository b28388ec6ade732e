"""When the IMU's readings are made and arrive, and the gyroscope's errors: a sample at a time, and all at once."""

from __future__ import annotations

import numpy as np
import pytest

from fivebar_description.imu import ImuSettings
from fivebar_description.readings import ReadingSchedule
from fivebar_sim.imu import Imu, gyro_errors, gyro_stream
from fivebar_sim.readings import ReadingQueue, lost_readings

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
    readings = [imu.read((0.0, 0.0), rate, 0.0).angular_velocity for rate in rates.tolist()]
    found = [settings.turn_rate(reading) for reading in readings]
    # whatever the noise of the accelerometer
    expected = rates + gyro_errors(settings, gyro_stream(11), SAMPLES)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-14)
    # a rotation of the IMU about its own axes takes most of the rate out of each of them
    assert max(abs(one[2]) for one in readings) < 0.8 * float(np.abs(expected).max())


def test_only_the_rate_about_the_links_axis_counts() -> None:
    settings = ImuSettings(roll=0.4, pitch=-0.7, yaw=2.1)
    rotation = np.array(settings.rotation())
    across = rotation.T @ np.array([3.0, -2.0, 0.0])
    assert settings.turn_rate(tuple(across.tolist())) == pytest.approx(0.0, abs=1e-14)
