"""Faults of sensors that grow, as effects of the simulated robot."""

from __future__ import annotations

from typing import NamedTuple

from fivebar_bringup.studies.robustness.effects import (
    DEGREE,
    EFFECTS,
    MILLI,
    Change,
    Condition,
    Effect,
    FaultyRobot,
    grid,
)
from fivebar_bringup.studies.sensor_faults.faults import BEFORE, Injected, Moment


class _Growing(NamedTuple):
    """A fault of `sensor_faults.faults.FAULTS` that grows: words, unit, its scale, and sizes in the unit."""

    fault: str
    words: str
    unit: str
    scale: float
    sizes: tuple[float, ...]


def _given(fault: str) -> Change:
    def change(robot: FaultyRobot, size: float, at: Condition) -> FaultyRobot:
        moment = Moment(at.begin(2.0 * BEFORE), 1 + at.draw // 2 % 2, at.sign)
        plant, imu = Injected(fault, size, moment).put(robot.plant, robot.imu)
        return robot._replace(plant=plant, imu=imu)

    return change


COUNTS = (1, 2, 5, 10, 20, 30, 50, 75, 100, 150, 200, 400)

_GROWING = {
    "slip": _Growing("slip", "counts by which an encoder slips before the crossing, ±", "", 1.0, COUNTS),
    "interpolation": _Growing("interpolation", "interpolation error of the encoders", "mrad", MILLI, grid(0.01, 0.49)),
    "gyro_range": _Growing("clip", "range of the gyroscope", "rad/s", 1.0, grid(35.0, 0.5)),
    "gyro_scale": _Growing("scale", "error of the gyroscope's sensitivity, ±", "%", 0.01, grid(0.5, 50.0)),
    "gyro_askew": _Growing("misalignment", "misalignment of the gyroscope's axis", "°", DEGREE, grid(2.0, 80.0)),
    "bias_jump": _Growing("bias", "jump of the gyroscope's bias before the crossing, ±", "rad/s", 1.0, grid(0.02, 5.0)),
    "gyro_missing": _Growing(
        "missing",
        "time without the gyroscope's readings before the crossing",
        "ms",
        MILLI,
        grid(10.0, 500.0),
    ),
    "gyro_clock": _Growing("clock", "offset of the gyroscope's clock, ±", "ms", MILLI, grid(1.0, 120.0)),
    "gyro_drift": _Growing("drift", "drift of the gyroscope's clock, ±", "ms/s", MILLI, grid(0.5, 100.0)),
    "gyro_jitter": _Growing("jitter", "jitter of the gyroscope's stamps, ±", "ms", MILLI, grid(0.5, 50.0)),
}

SENSOR_EFFECTS = {
    name: Effect(
        name=name,
        words=one.words,
        unit=one.unit,
        scale=one.scale,
        sizes=one.sizes,
        good=None,
        middling=None,
        change=_given(one.fault),
        needs_gyro=one.fault not in ("slip", "interpolation"),
    )
    for name, one in _GROWING.items()
}
"""By name. Sound robots have none of them."""

ALL_EFFECTS = {**EFFECTS, **SENSOR_EFFECTS}
"""All effects that can grow, by name."""
