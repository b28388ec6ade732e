# SPDX-License-Identifier: Apache-2.0
"""The faults of sensors: as effects that grow, and at random, with the names that a run's fault may have for each."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fivebar_studies.robustness.effects import BURSTS, EFFECTS, Change, Condition, Effect, Keys, by_name, grid

FOR_EVER = 1e6
"""s."""

BEFORE, AFTER = 0.06, 0.02
"""s. Half of the random faults begin at any time of the motion, the others from so long before the crossing to so long
after it; those that grow begin so long before it."""

ENCODER_FROZEN, GYROSCOPE = "encoder_frozen", "gyroscope_"
MISSING, LATE, EARLY = "gyroscope_missing", "gyroscope_late", "gyroscope_early"
SATURATED, FROZEN = "gyroscope_saturated", "gyroscope_frozen"


class SensorFault(NamedTuple):
    """A fault.

    Attributes:
        words: what it is, with its unit.
        sizes: one of which is drawn.
        names: of those that say which sensor or cause it is, the right ones; names without a cause are never wrong.
        change: as that of an effect.
    """

    words: str
    sizes: tuple[float, ...]
    names: tuple[str, ...]
    change: Change


def _encoders(**keys: float) -> Keys:
    return {"encoders": keys}


def _gyroscope(**keys: float) -> Keys:
    return {"gyroscope": keys}


def _imu(**keys: float) -> Keys:
    return {"imu": keys}


def _missing(size: float, at: Condition) -> Keys:
    return _gyroscope(missing_from=max(0.0, at.time - 0.5 * size), missing_length=size)


FAULTS = {
    "slip": SensorFault(
        "an encoder that slips (counts)",
        (5, 10, 20, 50, 100, 200),
        (),
        lambda size, at: _encoders(**{f"slip_{at.motor}": at.sign * round(size), "slip_time": at.time}),
    ),
    "encoder_frozen": SensorFault(
        "an encoder that freezes",
        (0,),
        (ENCODER_FROZEN,),
        lambda size, at: _encoders(frozen_motor=at.motor, frozen_from=at.time),
    ),
    "interpolation": SensorFault(
        "interpolation error of the encoders (rad)",
        (1e-5, 1e-4, 3e-4),
        (),
        lambda size, at: _encoders(interpolation=size),
    ),
    "eccentricity": SensorFault(
        "eccentricity of the encoders (rad)", (1e-4, 1e-3), (), lambda size, at: _encoders(eccentricity=size)
    ),
    "clip": SensorFault(
        "a gyroscope's range (rad/s)",
        (0.5, 1.0, 2.0, 4.36),
        (SATURATED, FROZEN),
        lambda size, at: _imu(gyro_range=size),
    ),
    "gyro_frozen": SensorFault(
        "a gyroscope that freezes",
        (0,),
        (FROZEN,),
        lambda size, at: _gyroscope(frozen_from=at.time, frozen_length=FOR_EVER),
    ),
    "bias": SensorFault(
        "a jump of the gyroscope's bias (rad/s)",
        (0.05, 0.1, 0.2, 0.5, 1.0),
        (),
        lambda size, at: _gyroscope(bias_jump=at.sign * size, bias_time=at.time),
    ),
    "scale": SensorFault(
        "an error of the gyroscope's sensitivity",
        (0.01, 0.03, 0.1),
        (),
        lambda size, at: _gyroscope(scale=at.sign * size),
    ),
    "misalignment": SensorFault(
        "a misalignment of the gyroscope (rad)", (0.02, 0.1, 0.3), (), lambda size, at: _gyroscope(misalignment=size)
    ),
    "silent": SensorFault(
        "a gyroscope that is never heard", (0,), (MISSING,), lambda size, at: _gyroscope(missing_length=FOR_EVER)
    ),
    "missing": SensorFault(
        "a gyroscope that is missing for a while (s)", (0.03, 0.06, 0.1, 0.2, 0.3), (MISSING,), _missing
    ),
    "clock": SensorFault(
        "an offset of the gyroscope's clock (s)",
        (0.005, 0.01, 0.02, 0.03, 0.06, 0.12),
        (LATE, EARLY),
        lambda size, at: _imu(clock_offset=at.sign * size),
    ),
    "drift": SensorFault(
        "a drift of the gyroscope's clock (s/s)",
        (1e-3, 1e-2),
        (LATE, EARLY),
        lambda size, at: _gyroscope(clock_drift=at.sign * size),
    ),
    "jitter": SensorFault(
        "a jitter of the gyroscope's stamps (s)",
        (1e-3, 3e-3, 1e-2),
        (LATE, EARLY),
        lambda size, at: _gyroscope(clock_jitter=size),
    ),
}
"""Faults by name."""


class DrawnFault(NamedTuple):
    """A fault as it is given to one run, by its name, with a size of those in `FAULTS`."""

    fault: str
    size: float
    at: Condition

    @property
    def keys(self) -> Keys:
        """Return what it changes, as an effect does."""
        return FAULTS[self.fault].change(self.size, self.at)


def drawn_faults(random: np.random.Generator, crossing: float, duration: float) -> list[DrawnFault]:
    """Return each fault once, with a random size, motor, sign and moment, for a motion of a duration (s).

    Args:
        random: numbers.
        crossing: time of the first crossing (s).
        duration: of the motion (s).
    """
    drawn = []
    for name, fault in FAULTS.items():
        size = float(fault.sizes[random.integers(len(fault.sizes))])
        anywhere = random.uniform(0.05, 0.95) * duration
        near = max(0.0, crossing + random.uniform(-BEFORE, AFTER))
        time = float(anywhere if random.integers(2) else near)
        motor, sign = int(random.integers(1, 3)), int(1 - 2 * random.integers(2))
        drawn.append(DrawnFault(name, size, Condition(0, time, motor, sign)))
    return drawn


def is_wrong_name(fault: str, named: str) -> bool:
    """Return whether a run's fault names a cause that the injected one is not; "" for an injected one: none."""
    right = FAULTS[fault].names if fault else ()
    return (named == ENCODER_FROZEN or named.startswith(GYROSCOPE)) and named not in right


def _growing(name: str, fault: str, words: str, unit: str, sizes: tuple[float, ...], needs_gyro: bool = True) -> Effect:
    """Return a fault as an effect that grows."""
    return Effect(name, words, unit, sizes, None, None, FAULTS[fault].change, needs_gyro, before=BEFORE)


SENSOR_EFFECTS = by_name(
    _growing(
        "slip",
        "slip",
        "counts by which an encoder slips before the crossing, ±",
        "",
        (1, 2, 5, 10, 20, 30, 50, 75, 100, 150, 200, 400),
        needs_gyro=False,
    ),
    _growing("interpolation", "interpolation", "interpolation error of the encoders", "mrad", grid(0.01, 0.49), False),
    _growing("gyro_range", "clip", "range of the gyroscope", "rad/s", grid(35.0, 0.5)),
    _growing("gyro_scale", "scale", "error of the gyroscope's sensitivity, ±", "%", grid(0.5, 50.0)),
    _growing("gyro_askew", "misalignment", "misalignment of the gyroscope's axis", "°", grid(2.0, 80.0)),
    _growing("bias_jump", "bias", "jump of the gyroscope's bias before the crossing, ±", "rad/s", grid(0.02, 5.0)),
    _growing(
        "gyro_missing", "missing", "time without the gyroscope's readings before the crossing", "ms", grid(10.0, 500.0)
    ),
    _growing("gyro_clock", "clock", "offset of the gyroscope's clock, ±", "ms", grid(1.0, 120.0)),
    _growing("gyro_drift", "drift", "drift of the gyroscope's clock, ±", "ms/s", grid(0.5, 100.0)),
    _growing("gyro_jitter", "jitter", "jitter of the gyroscope's stamps, ±", "ms", grid(0.5, 50.0)),
)
"""Effects by name. Sound robots have none of them."""

ALL_EFFECTS = {**EFFECTS, **SENSOR_EFFECTS, **BURSTS}
"""All effects that can grow, by name."""
