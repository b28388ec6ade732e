"""Checks that what a scenario's estimator is to read is there, and that what is there is read."""

from __future__ import annotations

from fivebar_control.scenario.scenario import ControlScenario
from fivebar_description.errors import InputError


def check_sensors(scenario: ControlScenario) -> None:
    """Check the sensors of a scenario besides the motors' encoders.

    Raises:
        InputError: the estimator is to use a camera that is not there, or a sensor is there that only it would read.
    """
    if not scenario.estimated:
        if scenario.passive.leg:
            raise InputError("sensors.passive_encoder: only the estimator reads it: expected estimator ekf")
    elif (scenario.ekf.camera or scenario.ekf.seen_start) and not scenario.camera.on:
        raise InputError("ekf.camera: there is no camera: expected camera: {on: true}")
