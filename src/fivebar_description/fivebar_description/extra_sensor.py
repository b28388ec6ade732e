# SPDX-License-Identifier: Apache-2.0
"""A sensor from another package: what the estimator expects of it, and what the simulated one reads.

A package declares one as an `ExtraSensor` in a module of its own; a scenario or a robot file names it as MODULE:NAME in
its section `extra_sensor`, beside its settings. Its readings come as those of the other late sensors do, on the topic
`extra_sensor`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import Annotated, Any, NamedTuple

from fivebar_description.errors import InputError
from fivebar_description.modules import PLACE, load_part
from fivebar_description.sensors import ReadingSchedule, schedule_of
from fivebar_description.settings import Setting, as_numbers, read_settings

SECTION = "extra_sensor"

KIND = "kind"
"""Key of the section that names the sensor; the others are its settings."""


ExtraSection = Annotated[
    dict[str, Any],
    Setting("A sensor from another package, named as MODULE:NAME under `kind`, and its settings."),
]


class ExpectedReading(NamedTuple):
    """An expected reading, and its derivatives.

    Attributes:
        value: reading at a state of the platform, in the sensor's unit.
        by_x, by_y: derivatives by the platform's position (unit/m).
        by_vx, by_vy: by its velocity (unit s/m).
    """

    value: float
    by_x: float
    by_y: float
    by_vx: float = 0.0
    by_vy: float = 0.0


class ExtraSensor(NamedTuple):
    """A kind of sensor.

    `expected` and `read` are plain module-level functions that numba can compile; `settings` come to them as numbers
    (`as_numbers`).

    Attributes:
        name: of it, as faults name it.
        settings: class of its settings, with `rate_hz`, `latency` and `lost` as other late sensors have them.
        expected: returns the `ExpectedReading`: of (settings, robot, mode, x, y, vx, vy), the nominal robot
            with its working mode, and the platform's position (m) and velocity (m/s).
        read: returns the reading of the simulated sensor: of (settings, robot, q11, q12, q21, q22, noise), the actual
            robot, its exact joint angles (rad), and a number that is normally distributed with deviation 1.
        deviation: returns the standard deviation of a reading, all that is not known of it included: of (settings).
    """

    name: str
    settings: type[Any]
    expected: Callable[..., ExpectedReading]
    read: Callable[..., float]
    deviation: Callable[[Any], float]


class MountedSensor(NamedTuple):
    """A sensor with its settings, as a section names it."""

    kind: ExtraSensor
    settings: Any

    @property
    def numbers(self) -> Any:
        """Its settings as compiled code takes them."""
        return as_numbers(self.settings)

    @property
    def lost(self) -> float:
        """Fraction of the readings that never arrive."""
        return float(self.settings.lost)

    def schedule(self, rate_hz: int) -> ReadingSchedule:
        """Return when readings are made and arrive, at a sampling rate (Hz)."""
        return schedule_of(self.settings.rate_hz, self.settings.latency, rate_hz)


def mounted(section: Mapping[str, Any]) -> MountedSensor | None:
    """Return the sensor of a section; None of an empty one.

    Raises:
        InputError: the sensor cannot be loaded, or the settings do not fit it.
    """
    if not section:
        return None
    place = section.get(KIND)
    if not isinstance(place, str) or not PLACE.fullmatch(place):
        raise InputError(f"{SECTION}.{KIND}: {place!r}: expected my_package.my_sensor:SENSOR")
    kind = _loaded(place)
    return MountedSensor(
        kind, read_settings({key: value for key, value in section.items() if key != KIND}, kind.settings, SECTION)
    )


@cache
def _loaded(place: str) -> ExtraSensor:
    kind = load_part(place)
    if not isinstance(kind, ExtraSensor):
        raise InputError(
            f"{SECTION}.{KIND}: {place}: expected a fivebar_description.extra_sensor.ExtraSensor, found"
            f" {type(kind).__name__}"
        )
    lacking = [name for name in ("rate_hz", "latency", "lost") if name not in getattr(kind.settings, "_fields", ())]
    if lacking:
        raise InputError(f"{SECTION}.{KIND}: {place}: its settings lack {', '.join(lacking)}")
    return kind
