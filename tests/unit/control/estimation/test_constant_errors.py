# SPDX-License-Identifier: Apache-2.0
"""What a motion shows of the constant errors of robot and sensors, and what it leaves open."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fivebar_control.estimation import covariance as cov
from fivebar_control.estimation.constants import estimator_model
from fivebar_control.estimation.ekf import NO_ERRORS, Belief, as_vector, error_deviations, from_vector
from fivebar_control.estimation.encoder import Angle
from fivebar_control.estimation.estimator import StateEstimator
from fivebar_control.estimation.history import belief_at, empty_history, keep_belief
from fivebar_control.estimation.homing import homing_at
from fivebar_control.estimation.late_reading import CAMERA, LateReading
from fivebar_control.estimation.measurements import corrected, encoder_row, homed_belief
from fivebar_control.estimation.platform_motion import leg_at_rest
from fivebar_control.estimation.settings import Drives, EkfSettings, Sensing
from fivebar_control.model.geometry import inverse_geometry
from fivebar_description.parameters import FiveBar
from fivebar_description.tolerances import Tolerances

RATE_HZ, MODES, PLACE = 500, (1, -1), (0.01, 0.14)
COUNT = math.tau / 20_000
DEVIATION = 5e-5
"""Of a position by the camera (m)."""

numbers = st.floats(allow_nan=False, width=64)


@given(st.lists(numbers, min_size=cov.SIZE, max_size=cov.SIZE))
def test_an_estimate_and_its_vector_are_the_same(values: list[float]) -> None:
    vector = np.array(values)
    estimate = from_vector(vector)
    np.testing.assert_array_equal(as_vector(estimate), vector)
    history = empty_history(2)
    keep_belief(history, 3, Belief(estimate, np.zeros((cov.SIZE, cov.SIZE))))
    assert belief_at(history, 3).estimate == estimate
    assert (estimate.x, estimate.vy, estimate.clock, estimate.fy) == tuple(
        vector[[cov.X, cov.VY, cov.CLOCK_ERROR, cov.FY]]
    )
    assert (estimate.errors.zero2, estimate.errors.scale) == tuple(vector[[cov.ZERO2, cov.SCALE]])


def rested(robot: FiveBar, zero1: float, tolerances: Tolerances, fixes: int) -> Belief:
    """Return the belief of a robot at rest whose first encoder has a zero, after some positions by an exact camera."""
    angles = inverse_geometry(robot, MODES, *PLACE)
    settings = EkfSettings(camera=True, camera_deviation=DEVIATION)
    estimator = StateEstimator(
        robot,
        homing_at(robot, MODES, *PLACE),
        Sensing(RATE_HZ, Drives(encoder_counts=20000), settings, tolerances),
    )
    for sample in range(10 * fixes + 1):
        seen = [LateReading(CAMERA, float(sample), *PLACE, 1e-9)] if sample % 10 == 5 else []
        estimator.take(sample, angles.q11 + zero1, angles.q21, 0.0, 0.0, seen)
    assert estimator.fault is None
    assert estimator.belief is not None
    return estimator.belief


@pytest.mark.parametrize("zero", [4e-3, -2e-3])
def test_a_camera_shows_an_encoders_zero(dextar: FiveBar, zero: float) -> None:
    """Where nothing else can be wrong it is found, and known as well as the camera's position is."""
    belief = rested(dextar, zero, Tolerances(zero=5e-3), 50)
    assert belief.estimate.errors.zero1 == pytest.approx(zero, abs=0.05 * abs(zero) + COUNT)
    assert belief.estimate.errors.zero2 == pytest.approx(0.0, abs=0.05 * abs(zero) + COUNT)
    assert belief.estimate.errors._replace(zero1=0.0, zero2=0.0, scale=0.0)[2:] == NO_ERRORS[2:]
    assert math.hypot(belief.estimate.x - PLACE[0], belief.estimate.y - PLACE[1]) < 0.2 * DEVIATION
    deviation = math.sqrt(belief.covariance[cov.ZERO1, cov.ZERO1])
    assert abs(belief.estimate.errors.zero1 - zero) < 3.0 * deviation
    assert deviation < 0.1 * 5e-3 / math.sqrt(3.0)


def test_of_several_errors_only_their_sum_is_shown(dextar: FiveBar) -> None:
    """A link's length explains the reading as well as the zero: both stay uncertain, but not their sum."""
    zero, tolerances = 2e-3, Tolerances(length=3e-4, zero=5e-3)
    belief = rested(dextar, zero, tolerances, 50)
    row = encoder_row(1, leg_at_rest(dextar.leg1, MODES[0], *PLACE))
    row[cov.X] = row[cov.Y] = 0.0
    assert float(row @ as_vector(belief.estimate)) == pytest.approx(zero, abs=0.1 * zero + COUNT)
    declared = np.array(error_deviations(tolerances))
    left = np.sqrt(np.diag(belief.covariance))[cov.ERRORS : cov.ERRORS_END]
    assert left[0] > 0.5 * declared[0]
    assert left[3] > 0.5 * declared[3]
    assert math.sqrt(row @ belief.covariance @ row) < 0.1 * math.sqrt(
        np.sum((row[cov.ERRORS : cov.ERRORS_END] * declared) ** 2)
    )


def test_the_encoders_alone_are_not_believed_about_themselves(dextar: FiveBar) -> None:
    model = estimator_model(
        dextar, MODES, Sensing(RATE_HZ, Drives(20000), EkfSettings(), Tolerances(length=0.0003, zero=0.005))
    )
    belief = homed_belief(model.filter, *PLACE, 1e-8)
    angles = inverse_geometry(dextar, MODES, *PLACE)
    after = corrected(model.filter, belief, Angle(angles.q11 + 3e-3, 1e-8), Angle(angles.q21, 1e-8)).belief
    assert after.estimate.x != belief.estimate.x
    assert after.estimate.errors == NO_ERRORS
    errors = slice(cov.ERRORS, cov.ERRORS_END)
    np.testing.assert_array_equal(after.covariance[errors, errors], belief.covariance[errors, errors])


def test_an_error_that_is_said_to_be_none_is_none(dextar: FiveBar) -> None:
    """The encoder errs by less than the counts' own noise can hide; nothing moves what has no tolerance."""
    belief = rested(dextar, COUNT, Tolerances(gyro_scale=0.0), 20)
    assert belief.estimate.errors == NO_ERRORS
    assert not belief.covariance[cov.ERRORS : cov.ERRORS_END].any()
