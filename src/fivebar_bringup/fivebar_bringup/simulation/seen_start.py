# SPDX-License-Identifier: Apache-2.0
"""A start that nobody declares: the camera sees the resting robot, and the motion is planned from there."""

from __future__ import annotations

import math

from fivebar_bringup.scenario import DECLARED, Scenario
from fivebar_control.estimation.homing import Homing, HomingContradicted, seen_posture
from fivebar_control.scenario.start import initial_joints
from fivebar_description.optional import CAMERA_ON, CAMERA_SIMULATION, optional_part
from fivebar_sim.plant import Plant


def looked(scenario: Scenario) -> Homing:
    """Return the posture of a scenario's simulated robot by a rendered picture and its motors' encoders.

    Raises:
        HomingContradicted: the camera does not see the platform, or not which assembly mode it is in.
        InputError: the robot cannot stand there.
    """
    plant = Plant(scenario.five_bar(), initial_joints(scenario), scenario.rate_hz, scenario.plant, scenario.imu)
    (q11, q21), _ = plant.measure().of_motors()
    (seen,) = optional_part(CAMERA_SIMULATION, CAMERA_ON)(scenario).arrived(0, plant.truth())
    x, y = seen.reading[:2]
    if not math.isfinite(x + y):
        raise HomingContradicted("homing_contradicted: the camera does not see the platform at the start")
    return seen_posture(scenario.five_bar(), q11, q21, x, y)


def as_seen(scenario: Scenario) -> Scenario:
    """Return a scenario with `start: seen` with the start that the camera sees, which the run itself checks again.

    Raises:
        InputError: as `looked`.
    """
    posture = looked(scenario)
    return scenario.model_copy(
        update={
            "start": DECLARED,
            "waypoints": ((posture.x, posture.y), *scenario.waypoints),
            "working_mode": posture.mode,
            "ekf": scenario.ekf._replace(seen_start=True),
        }
    )
