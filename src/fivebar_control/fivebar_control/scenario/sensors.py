# SPDX-License-Identifier: Apache-2.0
"""The estimator of a scenario: what it works with, where it starts, and checks that its sensors are there."""

from __future__ import annotations

from fivebar_control.estimation.homing import Homing, homing_at
from fivebar_control.estimation.settings import Sensing
from fivebar_control.scenario.scenario import ControlScenario
from fivebar_description.errors import InputError
from fivebar_description.extra_sensor import SECTION
from fivebar_description.robot_file import read_robot
from fivebar_description.sensors import KnownSensors


def check_sensors(scenario: ControlScenario) -> None:
    """Check the sensors of a scenario besides the motors' encoders.

    Raises:
        InputError: the estimator is to use a camera that is not there, or a sensor is there that only it would read.
    """
    if not scenario.estimated:
        if scenario.passive.leg:
            raise InputError("sensors.passive_encoder: only the estimator reads it: expected estimator ekf")
        if scenario.extra_sensor:
            raise InputError(f"{SECTION}: only the estimator reads it: expected estimator ekf")
    elif (scenario.ekf.camera or scenario.ekf.seen_start) and not scenario.camera.on:
        raise InputError("ekf.camera: there is no camera: expected camera: {on: true}")


def known_sensors(scenario: ControlScenario) -> KnownSensors:
    """Return what the robot's file says of its sensors, and by how much the gyroscope's low-pass lags behind."""
    return read_robot(scenario.robot).sensors.lagging(scenario.imu.gyro_lag(1.0 / scenario.rate_hz))


def sensing_of(scenario: ControlScenario) -> Sensing:
    """Return what the estimator of a scenario has to work with."""
    return Sensing(
        scenario.rate_hz,
        scenario.drives(),
        scenario.ekf,
        scenario.known_within(),
        scenario.passive,
        known_sensors(scenario),
        scenario.extra(),
        scenario.imu.schedule(scenario.rate_hz).every,
        scenario.camera.every(scenario.rate_hz),
    )


def sensing_if_estimated(scenario: ControlScenario) -> Sensing | None:
    """Return what a scenario's estimator has to work with; None without one."""
    return sensing_of(scenario) if scenario.estimated else None


def homing_of(scenario: ControlScenario) -> Homing:
    """Return the posture in which a scenario's robot starts, as the estimator takes it."""
    (x, y), mode = scenario.waypoints[0], scenario.working_mode
    return homing_at(scenario.five_bar(), mode, x, y)
