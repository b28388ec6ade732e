"""How often the intervals of a calibration hold: `python -m fivebar_bringup.studies.single.calibrate_coverage`.

Robots have more than the model of the calibration: transmissions of 60 to 250 Hz, torque constants off by up to 5 %,
viscous friction, and friction in the passive joints. Each makes the motion of the scenario `calibration` in the
compiled loop, under torque, and is calibrated from what its encoders and gyroscope read. docs/calibration.md has the
table.
"""

from __future__ import annotations

import argparse
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_bringup.simulation.case import case_of, sampled
from fivebar_bringup.simulation.engine import traced_crossing
from fivebar_bringup.simulation.outcome import FAULT_NAMES, TraceRow
from fivebar_control.calibration.calibration import calibrate
from fivebar_control.calibration.closure import GEOMETRY
from fivebar_control.calibration.record import CalibrationRecord
from fivebar_control.calibration.result import Calibration
from fivebar_control.estimation.watch_limits import WatchLimits
from fivebar_control.laws.robot_sizes import bandwidth_of
from fivebar_control.safety.stages import NO_FAULT
from fivebar_description.strict_yaml import validate

FloatArray = NDArray[np.float64]

MOTION = "calibration"

LENGTH, ZERO = 3e-4, math.radians(0.2)
"""Bounds of the errors of lengths and bases (m), and of encoder zeros (rad): the tolerances of the motion."""

SOFTEST, STIFFEST, BANDWIDTH = 60.0, 250.0, 50.0
"""Of the transmissions (Hz), and the largest bandwidth of the law (rad/s)."""

READINGS = 39
"""Of the random numbers that are the noise of the gyroscope."""

UNLIMITED = 1e9
"""In place of a limit of the estimator's watch."""

ANY = "crossings"


class Calibrated(NamedTuple):
    """A calibrated robot.

    Attributes:
        errors: [8 + crossings], of lengths, bases (m) and zeros (rad), and of the elbow gap at each crossing (m).
        half_widths: of their intervals.
    """

    errors: FloatArray
    half_widths: FloatArray


def drawn(seed: int, number: int) -> Scenario:
    """Return the motion on a robot that is more than the model."""
    random = np.random.default_rng((seed, number))
    frequency = math.exp(random.uniform(math.log(SOFTEST), math.log(STIFFEST)))
    share, passive, *scales = random.uniform((0.3, 0.0, 0.8, 0.8, 0.8), (0.85, 0.006, 1.2, 1.2, 1.2)).tolist()
    constant_1, constant_2 = random.uniform(-0.05, 0.05, 2).tolist()
    lengths, zeros = random.uniform(-LENGTH, LENGTH, 6), random.uniform(-ZERO, ZERO, 2)
    content = load_scenario(MOTION).model_dump()
    plant = {
        **dict(zip(("mass_scale", "inertia_scale", "friction_scale"), scales, strict=True)),
        "seed": number,
        "friction": {"viscous": 0.01, "passive": passive},
        "motors": {"constant_1": constant_1, "constant_2": constant_2},
        "transmission": {"frequency": frequency, "damping": 0.04, "rotor_share": share},
        "links": dict(zip(GEOMETRY[:6], lengths.tolist(), strict=True)),
        "encoders": dict(zip(GEOMETRY[6:], zeros.tolist(), strict=True)),
    }
    width = min(BANDWIDTH, bandwidth_of(frequency))
    content |= {
        "tracking_error_limit": 0.1,
        "unified": {**content["unified"], "kp": width**2, "kd": 2.0 * width},
        # the estimator expects what the transmissions yield, and does not end the motion
        "ekf": {
            **content["ekf"],
            **dict.fromkeys(WatchLimits._fields, UNLIMITED),
            "play": 0.0025,
            "acceleration_noise": 0.1,
            "gyro_noise": 0.1,
            "force_deviation": 1.0,
            "force_time": 0.4,
        },
        "plant": {**content["plant"], **plant},
    }
    return validate(content, Scenario, MOTION)


def recorded(scenario: Scenario) -> CalibrationRecord:
    """Return what encoders, drives and gyroscope of a robot read while it makes its motion.

    Raises:
        RuntimeError: a fault ends the motion.
    """
    plan = sampled(scenario.five_bar(), scenario.plan(), scenario.rate_hz, scenario.lead_samples)
    outcome, trace = traced_crossing(case_of(scenario), plan)
    if outcome.fault != NO_FAULT:
        raise RuntimeError(f"{FAULT_NAMES[outcome.fault]} at sample {outcome.fault_sample}")
    by_name = dict(zip(TraceRow._fields, trace.T, strict=True))
    every = round(scenario.rate_hz / scenario.imu.rate_hz)
    times = np.arange(len(trace)) / scenario.rate_hz
    rates = (by_name["dq21"] + by_name["dq22"])[::every]
    random = np.random.default_rng((scenario.plant.seed, READINGS))
    read = scenario.imu.gyro_bias + rates + scenario.imu.gyro_noise * random.normal(size=len(rates))
    turning = np.stack((np.zeros_like(read), np.zeros_like(read), read), axis=1)
    return CalibrationRecord(
        times=times,
        motors=np.stack((by_name["read1"], by_name["read2"]), axis=1),
        torques=np.stack((by_name["applied1"], by_name["applied2"]), axis=1),
        imu_times=times[::every],
        angular_velocity=turning,
        acceleration=np.zeros_like(turning),
    )


def errors_of(scenario: Scenario, found: Calibration) -> Calibrated:
    """Return the errors of a calibration of a simulated robot."""
    plant, count = scenario.plant, len(GEOMETRY)
    actual = found.start[:count] + np.array([*plant.links[:6], plant.encoders.zero_1, plant.encoders.zero_2])
    error = found.values[:count] - actual
    gaps = np.array([row @ error for _, row in found.crossings])
    return Calibrated(
        np.concatenate((error, gaps)), np.concatenate((found.half_widths[:count], found.gap_half_widths()))
    )


def calibrated(seed: int, number: int) -> Calibrated:
    """Return the calibration of a drawn robot.

    Raises:
        RuntimeError: a fault ends its motion.
        NotCalibratable: its readings do not explain a robot.
    """
    scenario = drawn(seed, number)
    found = calibrate(scenario.five_bar(), scenario.known_within(), recorded(scenario))
    return errors_of(scenario, found)


def coverage(robots: list[Calibrated]) -> dict[str, float]:
    """Return the share of intervals that hold the truth, of each parameter, of all eight, and at the crossings."""
    count = len(GEOMETRY)
    held = [np.abs(one.errors) <= one.half_widths for one in robots]
    each = np.mean([one[:count] for one in held], axis=0)
    return {
        **dict(zip(GEOMETRY, each.tolist(), strict=True)),
        "all": float(np.mean(each)),
        ANY: float(np.mean(np.concatenate([one[count:] for one in held]))),
    }


def main() -> None:
    """Print the coverage, with the errors' root mean square and the median half widths."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--robots", type=int, default=60)
    given = parser.parse_args()
    found = [calibrated(given.seed, number) for number in range(given.robots)]
    count = len(GEOMETRY)
    errors, widths = (np.array([one[part][:count] for one in found]) for part in (0, 1))
    gaps, gap_widths = (np.concatenate([one[part][count:] for one in found]) for part in (0, 1))
    middle = {
        **{name: (errors[:, at], widths[:, at]) for at, name in enumerate(GEOMETRY)},
        "all": (errors, widths),
        ANY: (gaps, gap_widths),
    }
    for name, share in coverage(found).items():
        error, width = middle[name]
        spread = "" if name == "all" else f", error {np.sqrt(np.mean(error**2)):.2g}, half width {np.median(width):.2g}"
        print(f"{name}: {100.0 * share:.1f} % of the intervals hold{spread}")


if __name__ == "__main__":
    main()
