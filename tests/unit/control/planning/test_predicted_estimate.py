# SPDX-License-Identifier: Apache-2.0
"""What an estimate is predicted to be worth, against the estimator's own opinion later."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from fivebar_control.estimation.constants import estimator_model
from fivebar_control.estimation.encoder import angle_variance, next_angle, repetitions
from fivebar_control.estimation.estimator import StateEstimator
from fivebar_control.estimation.homing import homing_at
from fivebar_control.estimation.late_reading import GYROSCOPE, PASSIVE, LateReading
from fivebar_control.estimation.mirror import mirror_distance
from fivebar_control.estimation.platform_motion import leg_motion
from fivebar_control.estimation.settings import Drives, EkfSettings, Sensing
from fivebar_control.laws.registry import CONTROLLERS, default_tuning
from fivebar_control.model.geometry import inverse_geometry
from fivebar_control.planning.predicted_estimate import PredictedEstimate, predict_estimate, wrong_mode_probability
from fivebar_control.planning.predicted_run import Peak, predict_run
from fivebar_control.trajectory.path_distance import PATH, TIMED
from fivebar_control.trajectory.planner import plan_motion
from fivebar_control.trajectory.zones import ZoneRule
from fivebar_description.parameters import FiveBar
from fivebar_description.sensors import NO_ENCODER, PassiveEncoder
from fivebar_description.tolerances import EXACT, Tolerances

RATE_HZ = 500
COUNT = math.tau / 20_000
TOLERANCES = Tolerances(length=2e-4, zero=1e-3)


def test_the_position_errs_by_more_than_two_deviations_once_in_twenty_two_runs() -> None:
    estimate = PredictedEstimate(Peak(9.0, 0.1, 0.0, 0.08), Peak(1e-3, 0.1, 0.0, 0.08))
    assert estimate.exceeded_by(math.erfc(math.sqrt(2.0))) == pytest.approx(2e-3, rel=1e-9)
    assert estimate.exceeded_by(1.0) == 0.0


def test_mirror_images_that_coincide_are_told_apart_by_luck() -> None:
    assert wrong_mode_probability(0.0) == 0.5
    assert wrong_mode_probability(2.0 * 3.0902) == pytest.approx(1e-3, rel=1e-3)


@pytest.mark.parametrize(("gyro", "leg"), [(False, 0), (True, 0), (False, 1), (True, 2)])
def test_the_estimator_finds_itself_as_uncertain_as_predicted(dextar: FiveBar, gyro: bool, leg: int) -> None:
    """Its readings are those of the predicted robot, and it looks at them one by one."""
    plan = plan_motion(dextar, (1, -1), ((0.0, 0.12), (0.0, 0.05)), [0.5], RATE_HZ, ZoneRule())
    predicted = predict_run(dextar, plan, RATE_HZ, default_tuning(CONTROLLERS["unified"]), 2.0)
    encoder = PassiveEncoder(leg, None)
    sensing = Sensing(RATE_HZ, Drives(), EkfSettings(gyro=gyro), TOLERANCES, encoder)
    assert sensing.declared
    assert not sensing._replace(tolerances=EXACT).declared
    estimate = predict_estimate(dextar, plan, sensing, predicted)
    home = homing_at(dextar, (1, -1), 0.0, 0.12)
    estimator = StateEstimator(dextar, home, sensing)
    model = estimator_model(dextar, (1, -1), sensing._replace(passive=NO_ENCODER))
    applied = 0.0, 0.0
    largest, closest = 0.0, math.inf
    for number, moment in enumerate(predicted.moments):
        q11, q12, q21, q22 = inverse_geometry(dextar, (1, -1), moment.x, moment.y)
        rate = leg_motion(dextar.leg2, -1, *moment[:4]).dtheta
        readings = [LateReading(GYROSCOPE, number, rate)] if gyro else []
        readings += [LateReading(PASSIVE, number, (q12, q22)[leg - 1])] if leg else []
        estimator.take(number, q11, q21, *applied, readings)
        applied = moment.tau1, moment.tau2
        assert estimator.belief is not None
        largest = max(largest, math.sqrt(np.linalg.eigvalsh(estimator.belief.covariance[:2, :2])[1]))
        closest = min(closest, mirror_distance(model.filter, estimator.belief))
    assert estimator.fault is None
    assert estimate.position.value == pytest.approx(largest, rel=0.02)
    assert estimate.mirror.value == pytest.approx(closest, rel=0.02)


def test_by_the_path_only_the_deviation_across_it_counts(dextar: FiveBar) -> None:
    """On the locus the encoders leave the place along the path open, the worse the nearer; not that across it."""
    sensing = Sensing(RATE_HZ, Drives(20_000), EkfSettings(), TOLERANCES)
    worth = []
    for goal in ((0.0, 0.05), (0.05, 0.09)):
        plan = plan_motion(dextar, (1, -1), ((0.0, 0.12), goal), [0.5], RATE_HZ, ZoneRule())
        predicted = predict_run(dextar, plan, RATE_HZ, default_tuning(CONTROLLERS["unified"]), 2.0)
        estimates = [predict_estimate(dextar, plan, sensing, predicted, judge) for judge in (TIMED, PATH)]
        assert estimates[0].mirror == estimates[1].mirror
        worth.append([one.position.value for one in estimates])
    through, aside = worth
    assert through[1] < 0.2 * through[0]
    assert aside[1] <= aside[0]


@pytest.mark.parametrize("speed", [0.0, 0.001, 0.02, 0.1, 0.5])
def test_a_counted_reading_is_worth_on_average_what_the_filter_takes_the_readings_for(speed: float) -> None:
    """Of a motor at a steady speed, through counts at the filter's own measurement model, reading by reading."""
    readings = [math.floor(speed * number / RATE_HZ / COUNT) * COUNT for number in range(3000)]
    repeated, information = 1, 0.0
    for last, reading in pairwise(readings):
        repeated = repetitions(last, repeated, reading)
        information += 1.0 / next_angle(COUNT, RATE_HZ, last, repeated, reading, speed).variance
    assert angle_variance(COUNT, RATE_HZ, speed) == pytest.approx((len(readings) - 1) / information, rel=0.5)
