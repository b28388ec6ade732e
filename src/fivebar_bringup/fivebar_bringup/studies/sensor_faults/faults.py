"""The faults that sensors are given, their sizes, and the names that a fault of the run may have for each."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from fivebar_bringup.scenario import Scenario
from fivebar_description.imu import ImuSettings
from fivebar_sim.effects.settings import PlantSettings

FOR_EVER = 1e6
"""s."""

BEFORE, AFTER = 0.06, 0.02
"""s. Half of the faults begin at any time of the motion, the others from so long before the crossing to so long after
it."""

ENCODER_FROZEN, GYROSCOPE = "encoder_frozen", "gyroscope_"
MISSING, LATE, EARLY = "gyroscope_missing", "gyroscope_late", "gyroscope_early"
SATURATED, FROZEN = "gyroscope_saturated", "gyroscope_frozen"


class Moment(NamedTuple):
    """When and where a fault is: from a time on (s), on motor 1 or 2, with a sign."""

    time: float
    motor: int
    sign: int


Keys = dict[str, Any]
Change = Callable[[float, Moment], Keys]


class SensorFault(NamedTuple):
    """A fault.

    Attributes:
        words: what it is, with its unit.
        sizes: one of which is drawn.
        names: of those that say which sensor or cause it is, the right ones; names without a cause are never wrong.
        change: returns the keys of the scenario that give a size of it, by their section.
    """

    words: str
    sizes: tuple[float, ...]
    names: tuple[str, ...]
    change: Change


def _encoders(**keys: Any) -> Keys:
    return {"encoders": keys}


def _gyroscope(**keys: Any) -> Keys:
    return {"gyroscope": keys}


def _imu(**keys: Any) -> Keys:
    return {"imu": keys}


def _missing(size: float, at: Moment) -> Keys:
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
        "a gyroscope that is never heard",
        (0,),
        (MISSING,),
        lambda size, at: _gyroscope(missing_length=FOR_EVER),
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


class Injected(NamedTuple):
    """A fault as it is given to one run: its name, its size, and when and where it is."""

    fault: str
    size: float
    at: Moment

    def on(self, scenario: Scenario) -> Scenario:
        """Return a scenario whose robot has the fault besides what it has already."""
        plant, imu = self.put(scenario.plant, scenario.imu)
        return scenario.model_copy(update={"plant": plant, "imu": imu})

    def put(self, plant: PlantSettings, imu: ImuSettings) -> tuple[PlantSettings, ImuSettings]:
        """Return the settings of a simulated robot with the fault besides what they have already."""
        for section, keys in FAULTS[self.fault].change(self.size, self.at).items():
            if section == "imu":
                imu = imu._replace(**keys)
            else:
                changed: dict[str, Any] = {section: getattr(plant, section)._replace(**keys)}
                plant = plant._replace(**changed)
        return plant, imu


def drawn_faults(random: np.random.Generator, crossing: float, duration: float) -> list[Injected]:
    """Return each fault once, with a random size, motor, sign and moment, for a motion of a duration (s).

    Args:
        random: numbers.
        crossing: time of the first crossing (s).
        duration: of the motion (s).
    """
    found = []
    for name, fault in FAULTS.items():
        size = float(fault.sizes[random.integers(len(fault.sizes))])
        anywhere = random.uniform(0.05, 0.95) * duration
        near = max(0.0, crossing + random.uniform(-BEFORE, AFTER))
        time = anywhere if random.integers(2) else near
        found.append(
            Injected(name, size, Moment(float(time), int(random.integers(1, 3)), int(1 - 2 * random.integers(2))))
        )
    return found


def is_wrong_name(fault: str, named: str) -> bool:
    """Return whether a run's fault names a cause that the injected one is not; "" for an injected one: none."""
    right = FAULTS[fault].names if fault else ()
    return (named == ENCODER_FROZEN or named.startswith(GYROSCOPE)) and named not in right
