# SPDX-License-Identifier: Apache-2.0
"""A declared gyroscope that is not heard, cannot be used, or repeats itself has a fault of its own name."""

from __future__ import annotations

import math

import pytest
from estimator_at_rest import ANGLES, HOME, RATE_HZ, ROBOT

from fivebar_control.estimation.estimator import StateEstimator
from fivebar_control.estimation.fault_numbers import GYROSCOPE_FROZEN, TRIP_NAMES
from fivebar_control.estimation.gyro_watch import (
    FEWEST,
    LEAST_SWING,
    GyroHeard,
    gyro_fault,
    unheard,
    used,
    waited,
)
from fivebar_control.estimation.homing import Homing
from fivebar_control.estimation.late_reading import GYROSCOPE, LateReading
from fivebar_control.estimation.settings import Drives, EkfSettings, Sensing
from fivebar_control.safety.stages import NO_FAULT

TIMEOUT = round(EkfSettings().gyro_timeout * RATE_HZ)

OLD, NONE, AT_END, AHEAD = -30.0, None, math.inf, 30.0
"""A stamp that is so many samples behind; no reading; one at the end of the range; a stamp so many samples ahead."""


def fault_of(readings: dict[range, float | None], samples: int, settings: EkfSettings | None = None) -> str:
    """Return the first fault of a robot at rest whose readings are so in some samples, else sound, and when."""
    settings = EkfSettings(gyro=True) if settings is None else settings
    estimator = StateEstimator(ROBOT, Homing(*HOME, (1, -1), 1), Sensing(RATE_HZ, Drives(), settings))
    for sample in range(samples):
        kind = next((kind for span, kind in readings.items() if sample in span), 0.0)
        rates = [] if kind is None else [(sample, kind) if math.isinf(kind) else (sample + kind, 0.001 * (sample % 7))]
        late = [LateReading(GYROSCOPE, *one) for one in rates]
        estimator.take(sample, ANGLES.q11, ANGLES.q21, 0.0, 0.0, late)
        if estimator.fault is not None:
            return f"{estimator.fault.name} {sample}"
    return ""


@pytest.mark.parametrize(
    ("kind", "name"),
    [(NONE, "gyroscope_missing"), (OLD, "gyroscope_late"), (AT_END, "gyroscope_saturated"), (AHEAD, "gyroscope_early")],
)
@pytest.mark.parametrize("first", [0, 40])
def test_it_is_named_by_why_its_readings_cannot_be_used(kind: float | None, name: str, first: int) -> None:
    """From the start, and on the way; a shorter absence is none."""
    beyond = first + TIMEOUT + (1 if first == 0 else 0)
    assert fault_of({range(first, 1000): kind}, 400) == f"{name} {beyond}"
    assert fault_of({range(first, first + TIMEOUT - 1): kind}, 400) == ""


def test_the_time_is_a_setting_and_without_it_nothing_is_missing() -> None:
    for timeout, expected in ((0.02, "gyroscope_missing 11"), (math.inf, "")):
        assert fault_of({range(1000): NONE}, 300, EkfSettings(gyro=True, gyro_timeout=timeout)) == expected
    assert fault_of({range(1000): NONE}, 300, EkfSettings(gyro=False)) == ""


def heard_of(readings: list[float], predicted: list[float]) -> GyroHeard:
    heard = unheard()
    for reading, rate in zip(readings, predicted, strict=True):
        heard = used(waited(heard, 2), reading, rate)
    return heard


@pytest.mark.parametrize(
    ("readings", "swing", "noise", "frozen"),
    [
        ([0.3] * FEWEST, 1.1 * LEAST_SWING, 0.01, True),
        ([0.3] * FEWEST, 0.9 * LEAST_SWING, 0.01, False),
        ([0.3] * FEWEST, 1.1 * LEAST_SWING, 0.1, False),
        ([0.3] * (FEWEST - 1) + [0.31], 3.0, 0.01, False),
        ([0.0] * 500, 0.0, 0.01, False),
    ],
    ids=["frozen", "slow", "noisy", "changes", "at rest"],
)
def test_it_repeats_itself_where_the_link_turns_otherwise(
    readings: list[float], swing: float, noise: float, frozen: bool
) -> None:
    predicted = [swing * number / (len(readings) - 1) for number in range(len(readings))]
    found = gyro_fault(heard_of(readings, predicted), math.inf, noise)
    assert found == (GYROSCOPE_FROZEN if frozen else NO_FAULT)


def test_every_trip_has_a_name_of_its_own() -> None:
    assert len(set(TRIP_NAMES.values())) == len(TRIP_NAMES)
