# SPDX-License-Identifier: Apache-2.0
"""How often the intervals of a calibration hold: `python docs/studies/calibrate_coverage.py`.

Robots have more than the model of the calibration: transmissions of 60 to 250 Hz, torque constants off by up to 5 %,
viscous friction, and friction in the passive joints. Each makes the motion of the scenario `calibration` in the
compiled loop, under torque, and is calibrated from what its encoders and gyroscope read. With `--rig` the robots are
those of a rig, and with `--led` a hand leads them without power. docs/calibration.md has the tables.
"""

from __future__ import annotations

import argparse
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from calibrated_crossings import actual_geometry, robot_of_rig
from fivebar_bringup.odds.robot_errors import drawn_gyro_bias
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_bringup.simulation.case import case_of
from fivebar_bringup.simulation.engine import traced_crossing
from fivebar_bringup.simulation.engine_table import TraceRow
from fivebar_bringup.simulation.guided import guide
from fivebar_control.calibration.by_turning_points import calibrate_by_turning_points, dragged_lag
from fivebar_control.calibration.calibration import calibrate
from fivebar_control.calibration.closure import GEOMETRY
from fivebar_control.calibration.record import CalibrationRecord
from fivebar_control.calibration.result import Calibration
from fivebar_control.estimation.constants import WatchLimits
from fivebar_control.laws.robot_sizes import bandwidth_of
from fivebar_control.loop.closed_loop import FAULT_NAMES
from fivebar_control.loop.sampled_plan import sampled
from fivebar_control.safety.stages import NO_FAULT
from fivebar_description.strict_yaml import validate
from fivebar_studies.rigs.named import find_rig, shipped_rigs
from fivebar_studies.rigs.rig import Rig, merged

FloatArray = NDArray[np.float64]

MOTION = "calibration"

LENGTH, ZERO = 3e-4, math.radians(0.2)
"""Bounds of the errors of lengths and bases (m), and of encoder zeros (rad): the tolerances of the motion."""

SOFTEST, STIFFEST, BANDWIDTH = 60.0, 250.0, 50.0
"""Range of the transmissions (Hz), and the largest bandwidth of the law (rad/s)."""

READINGS = 39
"""Stream of the random numbers that are the noise of the gyroscope."""

UNLIMITED = 1e9
"""In place of a limit of the estimator's watch."""

FAR = 0.1
"""Distance from the reference (m) up to which the motion goes on."""

ANY = "crossings"


class Calibrated(NamedTuple):
    """A calibrated robot.

    Attributes:
        errors: [8 + crossings], of lengths, bases (m) and zeros (rad), and of the elbow gap at each crossing (m).
        half_widths: of their intervals.
        gaps_before: [crossings], elbow gap at each crossing by the file before (m).
    """

    errors: FloatArray
    half_widths: FloatArray
    gaps_before: FloatArray


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
        "tracking_error_limit": FAR,
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


def put_together(rig: Rig) -> Rig:
    """Return a rig whose robots have the lengths and zeros of robots that were put together from parts."""
    known = {"length": LENGTH, "base": LENGTH, "zero": ZERO}
    errors = rig.errors._replace(length=LENGTH, zero=ZERO)
    return rig.model_copy(update={"errors": errors, "scenario": {**rig.scenario, "tolerances": known}})


def drawn_of_rig(rig: Rig, seed: int, number: int) -> Scenario:
    """Return the motion on a robot of a rig."""
    keys = rig.content(load_scenario(MOTION), "unified", {**robot_of_rig(rig, seed, number), "seed": number})
    going_on = {
        "tracking_error_limit": FAR,
        "ekf": dict.fromkeys(WatchLimits._fields, UNLIMITED),
        "imu": {"gyro_bias": drawn_gyro_bias(rig.errors, seed, number)},
    }
    return validate(merged(keys, going_on), Scenario, MOTION)


def led(scenario: Scenario) -> CalibrationRecord:
    """Return what encoders and gyroscope of a robot read while a hand leads it without power.

    Raises:
        InputError: it moves faster than it can be simulated.
    """
    samples = guide(scenario)
    motors = np.array([sample.motors for sample in samples])
    readings = [(made, reading) for sample in samples for made, reading in sample.imu]
    return CalibrationRecord(
        times=np.arange(len(samples)) / scenario.rate_hz,
        motors=motors,
        torques=np.zeros_like(motors),
        imu_times=np.array([made for made, _ in readings]) / scenario.rate_hz,
        angular_velocity=np.array([reading.angular_velocity for _, reading in readings]),
        acceleration=np.array([reading.acceleration for _, reading in readings]),
    )


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
    count, actual = len(GEOMETRY), actual_geometry(found, scenario.plant)
    error = found.values[:count] - actual
    rows = np.array([row for _, row in found.crossings])
    return Calibrated(
        np.concatenate((error, rows @ error)),
        np.concatenate((found.half_widths[:count], found.gap_half_widths())),
        rows @ (found.start[:count] - actual),
    )


def calibrated(scenario: Scenario) -> Calibrated:
    """Return the calibration of a robot that makes its motion under torque.

    Raises:
        RuntimeError: a fault ends its motion.
        NotCalibratable: its readings do not explain a robot.
    """
    found = calibrate(scenario.five_bar(), scenario.known_within(), recorded(scenario))
    return errors_of(scenario, found)


def calibrated_by_hand(scenario: Scenario, encoders_only: bool) -> Calibrated:
    """Return the calibration of a robot that a hand leads, by its encoders and gyroscope or by the encoders alone.

    Raises:
        InputError: it moves faster than it can be simulated.
        NotCalibratable: its readings do not explain a robot.
    """
    robot, known, record = scenario.five_bar(), scenario.known_within(), led(scenario)
    if encoders_only:
        # as a robot file declares its transmissions
        lag = dragged_lag(robot, scenario.plant.transmission)
        return errors_of(scenario, calibrate_by_turning_points(robot, known, record, lag))
    return errors_of(scenario, calibrate(robot, known, record))


def gap_text(robots: list[Calibrated]) -> str:
    """Return the elbow gap of robots before and after: each one's largest at a crossing, and the intervals there."""
    count = len(GEOMETRY)
    before = [1e3 * float(np.max(np.abs(robot.gaps_before))) for robot in robots]
    after = [1e3 * float(np.max(np.abs(robot.errors[count:]))) for robot in robots]
    widths = [1e3 * float(np.median(robot.half_widths[count:])) for robot in robots]
    crossings = sum(len(robot.gaps_before) for robot in robots)
    return (
        f"elbow gap of {len(robots)} robots before {np.median(before):.2f}, {max(before):.2f} mm (median, largest),"
        f" after {np.median(after):.4f}, {max(after):.4f} mm, half width {np.median(widths):.4f} mm;"
        f" {100.0 * coverage(robots)[ANY]:.1f} % of {crossings} crossings within it"
    )


def coverage(robots: list[Calibrated]) -> dict[str, float]:
    """Return the share of intervals that hold the truth, of each parameter, of all eight, and at the crossings."""
    count = len(GEOMETRY)
    held = [np.abs(robot.errors) <= robot.half_widths for robot in robots]
    each = np.mean([one[:count] for one in held], axis=0)
    return {
        **dict(zip(GEOMETRY, each.tolist(), strict=True)),
        "all": float(np.mean(each)),
        ANY: float(np.mean(np.concatenate([one[count:] for one in held]))),
    }


def main() -> None:
    """Print the coverage, or the elbow gaps of robots of a rig."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--robots", type=int, default=60)
    parser.add_argument("--rig", choices=shipped_rigs(), help="robots of a rig, in place of those with more")
    parser.add_argument("--put-together", action="store_true", help="with lengths within 0.3 mm and zeros within 0.2°")
    parser.add_argument("--led", action="store_true", help="by hand, without power")
    parser.add_argument("--encoders-only", action="store_true", help="led by hand, without the gyroscope")
    given = parser.parse_args()
    numbers = range(given.robots)
    if given.rig is None:
        if given.put_together or given.led or given.encoders_only:
            parser.error("--put-together, --led and --encoders-only: expected --rig as well")
        print_coverage([calibrated(drawn(given.seed, number)) for number in numbers])
        return
    rig = put_together(find_rig(given.rig)) if given.put_together else find_rig(given.rig)
    by_hand = given.led or given.encoders_only
    scenarios = (drawn_of_rig(rig, given.seed, number) for number in numbers)
    print(
        gap_text(
            [
                calibrated_by_hand(scenario, given.encoders_only) if by_hand else calibrated(scenario)
                for scenario in scenarios
            ]
        )
    )


def print_coverage(found: list[Calibrated]) -> None:
    """Print how often the intervals hold, with the errors' root mean square and the median half widths."""
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
