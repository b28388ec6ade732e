# SPDX-License-Identifier: Apache-2.0
"""Defaults of a scenario that follow from the robot: what its file says of drives, sensors, transmissions and loads.

Defaults of torques are those of DexTAR, and on another robot in proportion to the torque of its crossings; see
`fivebar_control.laws.robot_sizes`. Whatever a file declares sets what follows from it: backlash the play that the
estimator expects, the frequency of the transmissions the bandwidth of the laws, loads the force that is expected. The
section `tuning` overrides these for all scenarios of the robot, a scenario's own keys for itself.
"""

from __future__ import annotations

import math
from typing import Any

from fivebar_control.estimation.settings import EkfSettings
from fivebar_control.laws.robot_sizes import (
    ELASTIC_DISTURBANCE_RATE,
    bandwidth_for,
    blended_gains,
    law_sizes,
    size_ratio,
    torque_ratio,
)
from fivebar_description.imu import STANDARD_GRAVITY
from fivebar_description.loads import Loads
from fivebar_description.parameters import FiveBar
from fivebar_description.robot_file import RobotFile
from fivebar_description.transmission import RIGID

ERROR_TOLERANCE = 2e-3
"""Distance (m) from its reference within which DexTAR succeeds; of other robots in proportion to their size."""

STOPPED_BEYOND = 2.0
"""Distance from the reference at which a robot that is known within tolerances is stopped, over `error_tolerance`."""

ELASTIC_PLAY, PER_BACKLASH = 2.5e-3, 2.5
"""Difference that the estimator expects between motor and link of elastic transmissions: rad, and rad per rad of
backlash."""

ELASTIC_NOISE = 0.1
"""The same of noises (m/s^2 per root Hz, and rad/s of a gyroscope)."""

RIGID_DISTURBANCE_RATE = 0.3
"""Rate of the estimator's disturbance noise with rigid transmissions, for DexTAR's torques (Nm per root s)."""

FORCE_TIME = 0.4
"""Correlation time (s) of the unknown force on a robot that is known within tolerances."""


def expected_force(robot: FiveBar, loads: Loads) -> float:
    """Return the force on the platform (N) that loads come to, which the estimator expects (`ekf.force_deviation`).

    It is the push, or what lasts where that is larger: the platform's weight on the tilted base, and the friction of
    the passive joints on the Type 2 locus, where the elbows stand still and each distal link turns against its crank
    and the other distal link.
    """
    weight = robot.mass * STANDARD_GRAVITY * math.sin(loads.tilt)
    friction = 2.0 * loads.passive * (1.0 / robot.leg1.distal + 1.0 / robot.leg2.distal)
    return max(loads.push, weight + friction)


def robot_tolerances(file: RobotFile) -> dict[str, float]:
    """Return the distances from the reference (m) by which a robot succeeds and is stopped, as keys of a scenario."""
    tolerance = round(ERROR_TOLERANCE * size_ratio(file.five_bar()), 6)
    tolerances = {"error_tolerance": tolerance}
    return tolerances | {"tracking_error_limit": STOPPED_BEYOND * tolerance} if file.declares_errors else tolerances


def derived_tuning(file: RobotFile) -> dict[str, float]:
    """Return the section `tuning` of a robot: what its file says, and what follows from its transmission and loads."""
    elastic, ratio = file.transmission != RIGID, torque_ratio(file)
    tuning: dict[str, float] = {}
    bandwidth = bandwidth_for(file)
    if bandwidth is not None:
        tuning["bandwidth"] = bandwidth
    if file.declares_errors:
        usual = EkfSettings()
        tuning |= {
            "acceleration_noise": ELASTIC_NOISE if elastic else usual.acceleration_noise,
            "disturbance_rate": _rounded((ELASTIC_DISTURBANCE_RATE if elastic else RIGID_DISTURBANCE_RATE) * ratio),
            "force_deviation": _rounded(expected_force(file.five_bar(), file.loads)),
            "play": _rounded(ELASTIC_PLAY + PER_BACKLASH * file.transmission.backlash) if elastic else usual.play,
        }
        if file.imu is not None and elastic:
            tuning["gyro_noise"] = max(ELASTIC_NOISE, file.imu.gyro_noise)
    return {**tuning, **{name: value for name, value in file.tuning._asdict().items() if value is not None}}


def _rounded(value: float) -> float:
    return float(f"{value:.2g}")


def robot_defaults(file: RobotFile, estimated: bool) -> dict[str, dict[str, Any]]:
    """Return the settings of the controllers that a robot determines, by section and key of a scenario.

    Args:
        file: of the robot.
        estimated: whether there is an estimator, which uses the sensors that the file declares.
    """
    usual, ratio = EkfSettings(), torque_ratio(file)
    ekf: dict[str, Any] = {}
    sections: dict[str, dict[str, Any]] = {"unified": law_sizes(file)["unified"], "ekf": ekf}
    gains = blended_gains(file)
    if gains is not None:
        sections["gains"] = gains._asdict()
    if file.drives.joint_speed_limit is not None:
        sections["safety"] = {"joint_speed_limit": file.drives.joint_speed_limit}
    if ratio != 1.0:
        ekf["disturbance_rate"] = usual.disturbance_rate * ratio
        ekf["disturbance_initial"] = usual.disturbance_initial * ratio
    if file.declares_errors:
        ekf |= {"force_time": FORCE_TIME, "play_frequency": file.transmission.frequency}
    if estimated:
        ekf |= {"gyro": file.imu is not None, "camera": file.camera is not None}
        if file.imu is not None and file.imu.gyro_noise > 0.0:
            ekf["gyro_noise"] = file.imu.gyro_noise
    # last, because a noise in the robot's tuning comes before that of its sensor
    ekf |= {name: value for name, value in derived_tuning(file).items() if name in EkfSettings._fields}
    return sections
