# SPDX-License-Identifier: Apache-2.0
"""Is the filter as good as it says on robots that are not as their file says: NEES over robots drawn from tolerances.

The truth is Pinocchio's plant with the actual lengths, friction and encoders' counts, driven open loop by the torques
that take a nominal robot along; each robot gives one value per sample, since a constant error is not white within a
run. The position is judged from both sides: its error is that of the lengths and zeros, which is all that it has. The
velocity is judged from above only: this plant has neither the unexplained acceleration nor the walking disturbances
that the filter allows for, so that it must be surer than it says.
"""

from __future__ import annotations

import functools
from typing import NamedTuple

import numpy as np
import pytest
from scipy.stats import chi2

from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_bringup.simulation.offline import simulate
from fivebar_control.estimation.estimator import StateEstimator
from fivebar_control.estimation.homing import homing_at
from fivebar_control.estimation.late_reading import GYROSCOPE, LateReading
from fivebar_control.estimation.settings import Drives, EkfSettings, Sensing
from fivebar_control.model.geometry import inverse_geometry
from fivebar_control.model.kinematics import det_a, state_from_joints
from fivebar_description.imu import ImuSettings
from fivebar_description.parameters import FiveBar, LegParameters
from fivebar_description.robot_file import load_robot
from fivebar_description.tolerances import Tolerances
from fivebar_sim.effects.settings import PlantSettings
from fivebar_sim.plant import Plant

RATE_HZ, COUNTS, MODES = 500, 20000, (1, -1)
ROBOTS = 200
TOLERANCES = Tolerances(length=2e-4, zero=1e-3)
EXACTLY_KNOWN = Tolerances(gyro_scale=0.0)
SETTINGS = EkfSettings(gyro=True)

AWAY = ((0.0, 0.15), (0.03, 0.12))
THROUGH = ((0.0, 0.15), (0.0, 0.02))
LOOKS = {AWAY: (50, 130, 200), THROUGH: (50, 130, 200, 250)}
"""Samples at which the errors are judged; through the locus before it, about on it, and beyond it."""


class Errors(NamedTuple):
    """Of a robot at a look: NEES of position and of velocity, and the sign of det A."""

    position: float
    velocity: float
    side: float


@functools.cache
def torques(way: tuple[tuple[float, float], ...]) -> tuple[tuple[float, float], ...]:
    """Return the torques (Nm) that take the nominal robot along."""
    content = load_scenario("middle").model_dump(mode="json")
    content |= {"controller": "unified", "waypoints": [list(place) for place in way], "segment_duration": 0.52}
    return tuple((float(one.command[0]), float(one.command[1])) for one in simulate(Scenario(**content)).samples)


def errors_of(way: tuple[tuple[float, float], ...], seed: int, tolerances: Tolerances) -> list[Errors]:
    """Return the errors at the looks of the filter on a robot with a seed's lengths, zeros and gyroscope."""
    nominal, random = load_robot(), np.random.default_rng(seed)
    lengths = (TOLERANCES.length * random.uniform(-1.0, 1.0, 4)).tolist()
    zero1, zero2 = (TOLERANCES.zero * random.uniform(-1.0, 1.0, 2)).tolist()
    scale = 1.0 + TOLERANCES.gyro_scale * float(random.uniform(-1.0, 1.0))
    bias = SETTINGS.gyro_bias * float(random.normal())
    actual = nominal._replace(leg1=erring(nominal.leg1, *lengths[:2]), leg2=erring(nominal.leg2, *lengths[2:]))
    imu = ImuSettings(gyro_noise=SETTINGS.gyro_noise)
    start = inverse_geometry(actual, MODES, *way[0])
    plant = Plant(actual, tuple(start), RATE_HZ, PlantSettings(encoder_counts=COUNTS, seed=seed), imu)
    home, drives = homing_at(nominal, MODES, *way[0]), Drives(encoder_counts=COUNTS)
    estimator = StateEstimator(nominal, home, Sensing(RATE_HZ, drives, SETTINGS, tolerances))
    found = []
    for sample, torque in enumerate(torques(way)[: max(LOOKS[way]) + 1]):
        (q11, q21), applied = plant.measure().of_motors()
        rate = scale * imu.turn_rate(plant.measure_imu().angular_velocity) + bias
        estimator.take(sample, q11 + zero1, q21 + zero2, *applied, [LateReading(GYROSCOPE, sample, rate)])
        if sample in LOOKS[way]:
            found.append(error_of(actual, estimator, plant))
        plant.advance(torque)
    return found


def erring(leg: LegParameters, proximal: float, distal: float) -> LegParameters:
    return leg._replace(proximal=leg.proximal + proximal, distal=leg.distal + distal)


def error_of(actual: FiveBar, estimator: StateEstimator, plant: Plant) -> Errors:
    measured, belief = plant.truth(), estimator.belief
    assert belief is not None
    truth = state_from_joints(actual, *measured.position, *measured.velocity)
    error = np.array(belief.estimate[:4]) - (truth.x, truth.y, truth.vx, truth.vy)
    position, velocity = (
        float(error[part] @ np.linalg.solve(belief.covariance[part, part], error[part]))
        for part in (slice(0, 2), slice(2, 4))
    )
    return Errors(position, velocity, det_a(truth))


@functools.cache
def all_errors(way: tuple[tuple[float, float], ...]) -> tuple[list[Errors], ...]:
    return tuple(errors_of(way, seed, TOLERANCES) for seed in range(ROBOTS))


@pytest.mark.extra
@pytest.mark.parametrize("way", [AWAY, THROUGH], ids=["away from the locus", "through the locus"])
def test_the_filter_is_as_uncertain_as_it_says_over_robots_within_their_tolerances(
    way: tuple[tuple[float, float], ...],
) -> None:
    robots = all_errors(way)
    low, high = (float(chi2.ppf(level, 2 * ROBOTS)) / ROBOTS for level in (1e-4, 1.0 - 1e-4))
    for number, look in enumerate(LOOKS[way]):
        position = float(np.mean([robot[number].position for robot in robots]))
        velocity = float(np.mean([robot[number].velocity for robot in robots]))
        assert low < position < high, look
        assert velocity < high, look
    # where they were to go
    sides = {robot[-1].side > 0.0 for robot in robots}
    assert sides == {way is AWAY}


@pytest.mark.parametrize("way", [AWAY, THROUGH], ids=["away from the locus", "through the locus"])
def test_without_the_tolerances_it_believes_itself_too_much(way: tuple[tuple[float, float], ...]) -> None:
    """The same robots: the errors are thousands of times what the filter takes for possible."""
    robots = [errors_of(way, seed, EXACTLY_KNOWN) for seed in range(4)]
    assert (
        min(float(np.mean([robot[number].position for robot in robots])) for number in range(len(LOOKS[way]))) > 100.0
    )
