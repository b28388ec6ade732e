"""Faults of sensors that grow, as effects of the simulated robot."""

from __future__ import annotations

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

COUNTS = (1, 2, 5, 10, 20, 30, 50, 75, 100, 150, 200, 400)


def _given(fault: str) -> Change:
    def change(robot: FaultyRobot, size: float, at: Condition) -> FaultyRobot:
        moment = Moment(at.begin(2.0 * BEFORE), 1 + at.draw // 2 % 2, at.sign)
        plant, imu = Injected(fault, size, moment).put(robot.plant, robot.imu)
        return robot._replace(plant=plant, imu=imu)

    return change


def _encoders(name: str, words: str, unit: str, scale: float, sizes: tuple[float, ...]) -> Effect:
    """Return a fault of the encoders, which has the same name in `sensor_faults.faults.FAULTS`."""
    return Effect(name, words, unit, scale, sizes, None, None, _given(name))


def _gyroscope(name: str, fault: str, words: str, unit: str, scale: float, sizes: tuple[float, ...]) -> Effect:
    """Return a fault of the gyroscope, by its name there."""
    return Effect(name, words, unit, scale, sizes, None, None, _given(fault), needs_gyro=True)


SENSOR_EFFECTS = {
    effect.name: effect
    for effect in (
        _encoders("slip", "counts by which an encoder slips before the crossing, ±", "", 1.0, COUNTS),
        _encoders("interpolation", "interpolation error of the encoders", "mrad", MILLI, grid(0.01, 0.49)),
        _gyroscope("gyro_range", "clip", "range of the gyroscope", "rad/s", 1.0, grid(35.0, 0.5)),
        _gyroscope("gyro_scale", "scale", "error of the gyroscope's sensitivity, ±", "%", 0.01, grid(0.5, 50.0)),
        _gyroscope("gyro_askew", "misalignment", "misalignment of the gyroscope's axis", "°", DEGREE, grid(2.0, 80.0)),
        _gyroscope(
            "bias_jump", "bias", "jump of the gyroscope's bias before the crossing, ±", "rad/s", 1.0, grid(0.02, 5.0)
        ),
        _gyroscope(
            "gyro_missing",
            "missing",
            "time without the gyroscope's readings before the crossing",
            "ms",
            MILLI,
            grid(10.0, 500.0),
        ),
        _gyroscope("gyro_clock", "clock", "offset of the gyroscope's clock, ±", "ms", MILLI, grid(1.0, 120.0)),
        _gyroscope("gyro_drift", "drift", "drift of the gyroscope's clock, ±", "ms/s", MILLI, grid(0.5, 100.0)),
        _gyroscope("gyro_jitter", "jitter", "jitter of the gyroscope's stamps, ±", "ms", MILLI, grid(0.5, 50.0)),
    )
}
"""Effects by name. Sound robots have none of them."""

ALL_EFFECTS = {**EFFECTS, **SENSOR_EFFECTS}
"""All effects that can grow, by name."""
