# SPDX-License-Identifier: Apache-2.0
"""The estimator of a scenario: what it works with, where it starts, and checks that its sensors are there."""

from __future__ import annotations

from fivebar_control.estimation.homing import Homing, homing_at
from fivebar_control.estimation.settings import Sensing
from fivebar_control.scenario.scenario import ControlScenario
from fivebar_description.errors import InputError
from fivebar_description.extra_sensor import SECTION


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


def sensing_of(scenario: ControlScenario) -> Sensing | None:
    """Return what a scenario's estimator has to work with; None without one."""
    if not scenario.estimated:
        return None
    every, camera_every = scenario.imu.schedule(scenario.rate_hz).every, scenario.camera.every(scenario.rate_hz)
    drives, tolerances = scenario.drives(), scenario.known_within()
    return Sensing(drives, scenario.ekf, tolerances, every, scenario.passive, camera_every, scenario.extra())


def homing_of(scenario: ControlScenario) -> Homing:
    """Return the posture in which a scenario's robot starts, as the estimator takes it."""
    (x, y), mode = scenario.waypoints[0], scenario.working_mode
    return homing_at(scenario.five_bar(), mode, x, y)
