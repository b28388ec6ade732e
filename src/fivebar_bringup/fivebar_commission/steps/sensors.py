# SPDX-License-Identifier: Apache-2.0
"""The gyroscope's sign, unit and clock, and how the IMU is mounted, from a motion by hand."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from fivebar_bringup.bag.reader import read_bag
from fivebar_bringup.bag.recording import FloatArray
from fivebar_bringup.calibrate.reading import read_record
from fivebar_bringup.recorded.results import write_results
from fivebar_bringup.scenario import Scenario
from fivebar_commission.motions import LEAST_KAPPA, crossing_points, through_all
from fivebar_commission.record import imu_keys
from fivebar_commission.session import Session
from fivebar_commission.step import Findings, GateClosed, GatedStep
from fivebar_control.calibration.record import CalibrationRecord, turning_axis
from fivebar_control.model.geometry import direct_geometry, elbow_position
from fivebar_control.model.kinematics import assembly_mode, state_from_motors
from fivebar_control.model.singularity import inverse_condition
from fivebar_description.parameters import FiveBar

SEGMENT = 1.6
"""Time (s) of a way in a simulated motion by hand."""

LONGEST_CLOCK = 0.03
"""Largest offset (s) of the IMU's clock that is looked for."""

LEAST_LIKENESS = 0.9
"""Least correlation of the gyroscope with the link's rate by the encoders."""

UNIT = 0.15
"""How wrong the gyroscope's sensitivity may be."""

SMOOTHED = 0.05
"""Time (s) over which the link's angle by the encoders is differentiated."""

RECORDING = "led"
"""Name of the recording of the motion by hand."""


class LinkRate(NamedTuple):
    """The link's rate by the encoders, away from the locus: times (s) and rates (rad/s)."""

    times: FloatArray
    rates: FloatArray


def run(session: Session) -> Findings:
    """Record a motion by hand through the locus, and find out how the gyroscope is mounted."""
    scenario = by_hand(session)
    session.at_home()
    points = ", ".join(f"({1e3 * x:.0f}, {1e3 * y:.0f})" for x, y in scenario.waypoints)
    run_directory = session.bench.record_by_hand(
        session.person,
        "sensors.lead",
        "Lead the platform by hand, without power, slowly and without turning back on the way, along the points"
        f" {points} mm; rest for a second at both ends",
        scenario,
        session.drives_path,
        session.new_folder(RECORDING),
    )
    session.keep_drives(run_directory)
    imu, pages = session.imu, (str(run_directory.path.relative_to(session.folder)),)
    if imu is None:
        return Findings("no gyroscope: the elbow gap is calibrated from the motors' turning points", {}, pages)
    record = read_record(read_bag(run_directory.bag))
    turned = link_rate(session.five_bar, record)
    axis, spread = turning_axis(record.angular_velocity, (0.0, 0.0, 1.0))
    if spread[0] < 5.0 * spread[1]:
        raise GateClosed(
            "gyroscope_contradicts",
            "the gyroscope turns about no fixed axis: is it fixed to the distal link of leg 2, with its rates on"
            " imu/data?",
        )
    clock, likeness, gain = _compared(record, record.angular_velocity @ axis, turned)
    if abs(likeness) < LEAST_LIKENESS:
        raise GateClosed(
            "gyroscope_contradicts",
            f"the gyroscope follows the distal link of leg 2 with a correlation of {likeness:.2f} only, expected"
            f" {LEAST_LIKENESS:g}: is it on another link?",
        )
    if abs(abs(gain) * math.pi / 180.0 - 1.0) < UNIT:
        raise GateClosed("gyroscope_in_degrees", "the gyroscope's rates are in degrees per second: expected rad/s")
    if abs(abs(gain) - 1.0) > UNIT:
        raise GateClosed("gyroscope_scale", f"the gyroscope reads {abs(gain):.2f} times the link's rate: expected 1")
    x, y, z = (math.copysign(1.0, likeness) * axis).tolist()
    # the turning about the link's axis does not show here: calibration finds it from the accelerometer
    mounted = imu._replace(roll=math.atan2(y, z), pitch=-math.asin(max(-1.0, min(1.0, x))))
    session.learn(imu=imu_keys(mounted))
    learnt = scenario.model_copy(update={"imu": mounted, "robot": run_directory.robot.name})
    write_results(run_directory.path, {run_directory.scenario.name: learnt.to_yaml()})
    figures = {
        "axis of the link in the IMU's frame": [round(component, 3) for component in (x, y, z)],
        "correlation with the encoders": round(abs(likeness), 4),
        "rate over that by the encoders": round(abs(gain), 4),
        "stamps late by about, ms": round(1e3 * clock, 1),
    }
    way = "upside down" if z < 0.0 else "upright"
    return Findings(
        f"the gyroscope is on the right link, {way}, its stamps late by about {1e3 * clock:.1f} ms", figures, pages
    )


def by_hand(session: Session) -> Scenario:
    """Return the motion by hand through the locus, each way there and back."""
    robot, home = session.five_bar, session.robot.home_m
    points = through_all(robot, home, crossing_points(robot, home))
    return session.scenario(RECORDING, waypoints=points, segment_duration=SEGMENT)


def link_rate(robot: FiveBar, record: CalibrationRecord) -> LinkRate:
    """Return the rate of the distal link of leg 2 by the encoders, until the robot first comes near the locus."""
    times, angles = record.times, list[float]()
    q11, q21 = record.motors[0].tolist()
    mode = max((1, -1), key=lambda sign: direct_geometry(robot, sign, q11, q21)[1])
    for q11, q21 in record.motors.tolist():
        state = state_from_motors(robot, mode, q11, q21, 0.0, 0.0)
        if not inverse_condition(state) > 0.5 * LEAST_KAPPA or assembly_mode(state) != mode:
            break
        x, y = direct_geometry(robot, mode, q11, q21)
        elbow_x, elbow_y = elbow_position(robot.leg2, q21)
        angles.append(math.atan2(y - elbow_y, x - elbow_x))
    followed = np.unwrap(np.array(angles))
    period = float(np.median(np.diff(times)))
    reach = max(1, round(0.5 * SMOOTHED / period))
    if len(followed) < 4 * reach:
        raise GateClosed(
            "too_short", "the motion by hand begins too near the locus: begin at home, and rest there first"
        )
    rates = (followed[2 * reach :] - followed[: -2 * reach]) / (2.0 * reach * period)
    return LinkRate(times[reach : reach + len(rates)], rates)


def _compared(record: CalibrationRecord, readings: FloatArray, turned: LinkRate) -> tuple[float, float, float]:
    """Return by how much the stamps are late (s), the correlation, and the ratio of the readings to the link's rate."""
    best = (0.0, 0.0, 0.0)
    for clock in np.arange(-LONGEST_CLOCK, LONGEST_CLOCK + 1e-9, 5e-4).tolist():
        seen = np.interp(turned.times + clock, record.imu_times, readings)
        seen, wanted = seen - seen.mean(), turned.rates - turned.rates.mean()
        product = float(seen @ wanted)
        likeness = product / math.sqrt(max(float(seen @ seen) * float(wanted @ wanted), 1e-30))
        if abs(likeness) > abs(best[1]):
            best = clock, likeness, product / max(float(wanted @ wanted), 1e-30)
    return best


SENSORS = GatedStep(
    name="sensors",
    title="A motion by hand, and the gyroscope",
    does="records a motion by hand through the locus, and compares the gyroscope with the encoders",
    cost="five minutes",
    risk="none: the motors have no power",
    gate="the gyroscope follows the distal link of leg 2; its sign, unit, axis and clock are known",
    run=run,
)
