# SPDX-License-Identifier: Apache-2.0
"""Faults of the simulated gyroscope and of the encoders: when they begin and end, and what they do to a reading."""

from __future__ import annotations

import math

import pytest

from fivebar_description.errors import InputError
from fivebar_description.imu import ImuSettings
from fivebar_description.interface import late_stamp_ns, moment_of_stamp
from fivebar_sim.effects.encoders import EncoderErrors, EncoderReading, angle_seen_as, disc_of, read_at, seen
from fivebar_sim.effects.gyroscope import GyroscopeFaults, ImuClock, SampleSpan, jump, jumps, missing_samples
from fivebar_sim.sensors import Gyroscope, Imu, ReadingQueue, made_readings

RATE_HZ = 500


def read(faults: GyroscopeFaults, samples: int = 20, **imu: float) -> list[float]:
    """Return the readings of a link that turns faster and faster, by 0.1 rad/s a sample."""
    gyroscope = Gyroscope(ImuSettings(**imu), RATE_HZ, 3, faults)  # type: ignore[arg-type]
    return [gyroscope.read(0.0, 0.1 * number) for number in range(samples)]


def test_a_gyroscope_freezes_jumps_and_errs_from_the_sample_of_its_time_on() -> None:
    frozen = read(GyroscopeFaults(frozen_from=0.01, frozen_length=0.008))
    assert frozen == pytest.approx([0.1 * (4 if 5 <= number < 9 else number) for number in range(20)])
    jumped = read(GyroscopeFaults(bias_jump=0.5, bias_time=0.0101))
    assert jumped == pytest.approx([0.1 * number + 0.5 * (number >= 6) for number in range(20)])
    erring = read(GyroscopeFaults(scale=0.1, misalignment=math.pi / 3.0))
    assert erring == pytest.approx([0.1 * number * 1.1 * 0.5 for number in range(20)])


def test_noise_is_the_same_whatever_the_faults() -> None:
    sound, faulty = read(GyroscopeFaults(), gyro_noise=0.01), read(GyroscopeFaults(frozen_length=0.01), gyro_noise=0.01)
    assert faulty[5:] == sound[5:]
    assert set(faulty[:5]) == {sound[0]}


@pytest.mark.parametrize("tilt", [0.0, 0.9])
def test_each_axis_ends_at_the_range_and_such_a_reading_is_not_used(tilt: float) -> None:
    settings = ImuSettings(gyro_range=2.0, roll=tilt)
    for rate, usable in ((1.5, True), (40.0, False)):
        axes = Imu(settings, RATE_HZ, 0).read((0.0, 0.0), 0.0, rate, 0.0).angular_velocity
        assert max(map(abs, axes)) <= 2.0
        assert math.isfinite(settings.usable_rate(axes)) is usable is (rate < settings.gyro_limit())
        if usable:
            assert settings.usable_rate(axes) == pytest.approx(rate)
    assert math.isinf(ImuSettings().gyro_limit())


def test_missing_readings_never_arrive() -> None:
    settings = ImuSettings(rate_hz=250, latency=0.004)
    missing = missing_samples(GyroscopeFaults(missing_from=0.02, missing_length=0.02), RATE_HZ)
    assert missing == SampleSpan(10, 20)
    queue: ReadingQueue[int] = ReadingQueue(settings, RATE_HZ, 0, missing=missing)
    came = [made for sample in range(40) for made, _ in queue.arrived(sample, sample)]
    assert came == [number for number in range(0, 38, 2) if not 10 <= number < 20]
    assert [*made_readings(settings, RATE_HZ, 0, 38, missing=missing).nonzero()[0]] == came


def test_a_clock_is_off_drifts_and_jitters() -> None:
    settings = ImuSettings(clock_offset=-0.12)
    drifting = ImuClock(settings, GyroscopeFaults(clock_drift=1e-3), RATE_HZ, 1)
    assert [drifting.offset(number) for number in (0, 1000)] == pytest.approx([-0.12, -0.118])
    jitter = ImuClock(settings, GyroscopeFaults(clock_jitter=2e-3), RATE_HZ, 1)
    offsets = [jitter.offset(number) + 0.12 for number in range(500)]
    assert -2e-3 <= min(offsets) < -1.8e-3
    assert 1.8e-3 < max(offsets) <= 2e-3
    assert abs(sum(offsets)) / 500 < 2e-4


def test_an_encoder_slips_and_freezes_at_its_time() -> None:
    errors = EncoderErrors(slip_2=-50, slip_time=0.1, frozen_motor=1, frozen_from=0.2, frozen_length=0.1)
    one, two = (disc_of(errors, motor, 20_000, 0.0, 0.0) for motor in (1, 2))
    before, slip = EncoderReading(7.0, 1.0), 50 * math.tau / 20_000
    assert read_at(one, 1.0, 2.0, 0.198, before) == (1.0, 2.0)
    assert read_at(one, 1.0, 2.0, 0.2, before) == (7.0, 0.0)
    assert read_at(one, 1.0, 2.0, 0.3, before) == (1.0, 2.0)
    assert read_at(two, 1.0, 2.0, 0.098, before) == (1.0, 2.0)
    assert read_at(two, 1.0, 2.0, 0.1, before) == pytest.approx((1.0 - slip, 2.0))


def test_interpolation_repeats_in_every_line_and_is_taken_back_at_the_start() -> None:
    disc = disc_of(EncoderErrors(interpolation=1e-4, lines=1000), 1, 0, 0.0, 0.3)
    line = math.tau / 1000
    errors = [seen(disc, 1.0 + part * line, 0.0).angle - 1.0 - part * line for part in (0.0, 0.25, 0.5, 1.0)]
    assert errors[0] == pytest.approx(errors[3], abs=1e-12)
    assert math.hypot(errors[0], errors[1]) == pytest.approx(1e-4, rel=1e-9)
    assert angle_seen_as(disc, seen(disc, 1.2345, 0.0).angle) == pytest.approx(1.2345, abs=1e-12)


@pytest.mark.parametrize(
    ("errors", "words"),
    [
        (EncoderErrors(slip_1=5), r"plant\.encoders\.slip_1: 5 counts of an exact encoder: expected"),
        (EncoderErrors(interpolation=0.01), r"plant\.encoders\.interpolation: 0\.01 rad with 1000 lines: expected at"),
    ],
)
def test_what_no_encoder_can_have_is_refused(errors: EncoderErrors, words: str) -> None:
    with pytest.raises(InputError, match=words):
        disc_of(errors, 1, 0, 0.0, 0.0)


@pytest.mark.parametrize(("offset", "drift", "jitter"), [(0.0, 0.0, 0.0), (-0.0123, 2e-3, 0.0), (0.1, 1e-3, 5e-3)])
def test_all_stamps_and_jumps_at_once_are_those_of_each_sample(offset: float, drift: float, jitter: float) -> None:
    faults = GyroscopeFaults(clock_drift=drift, clock_jitter=jitter, bias_jump=0.5, bias_time=0.333)
    clock = ImuClock(ImuSettings(clock_offset=offset), faults, 250, 7)
    samples = range(300)
    stamps = [late_stamp_ns(sample, 250, clock.offset(sample)) for sample in samples]
    assert clock.moments(300).tolist() == [moment_of_stamp(stamp, 250) for stamp in stamps]
    assert jumps(faults, 250, 300).tolist() == [jump(faults, 250, sample) for sample in samples]
