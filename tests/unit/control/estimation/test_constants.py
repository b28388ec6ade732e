# SPDX-License-Identifier: Apache-2.0
"""What the estimator's settings come to: constants, and how many samples are kept."""

from __future__ import annotations

import math

import numpy as np
import pytest
from estimator_at_rest import RATE_HZ, ROBOT, TIGHT, model_of

from fivebar_control.estimation.constants import history_samples, largest_bending, watch_limits
from fivebar_control.estimation.covariance import BIAS, ERRORS, L12, SIZE, ZERO2
from fivebar_control.estimation.ekf import NO_ERRORS, Belief, Estimate, error_deviations
from fivebar_control.estimation.readings import (
    Trend,
    after_encoders,
    after_estimate,
    after_gyro,
    largest_offset,
    learned,
    no_pattern,
    strain,
)
from fivebar_control.estimation.settings import Drives, EkfSettings
from fivebar_description.sensors import KnownSensors, PassiveEncoder
from fivebar_description.tolerances import Tolerances
from fivebar_studies.rigs.named import find_rig
from fivebar_studies.sweep.drawing import draw


def test_constants_follow_from_the_settings() -> None:
    settings = TIGHT._replace(play=0.02, camera_deviation=0.003, dwell_limit=0.3, mirror_deviations=4.0)
    passive = PassiveEncoder(2, 1000, rate_hz=100)
    model = model_of(settings, Drives(2000, 2, 1.5), passive, KnownSensors(0.004, 0.1))
    assert (model.resolution, model.elbow_resolution) == pytest.approx((math.tau / 2000, math.tau / 1000), rel=1e-12)
    assert (model.play, model.camera_variance) == pytest.approx((4e-4, 9e-6), rel=1e-12)
    assert (model.delay_samples, model.torque_limit, model.elbow, model.elbow_rate) == (2, 1.5, 2, 100)
    assert (model.gyro_clock, model.elbow_zero) == (0.004, 0.1)
    # after a misfit of one for the time constant, 1 - 1/e of it are in the mean
    assert (1.0 - model.misfit_share) ** (0.02 * RATE_HZ) == pytest.approx(math.exp(-1.0), rel=1e-9)
    # a camera sees on which side of the locus the platform is
    assert model.limits == (4.0, math.inf)
    assert model_of(settings._replace(camera=False)).limits == (4.0, 0.3)
    exact = model_of(drives=Drives(), passive=PassiveEncoder(2, None))
    assert (exact.resolution, exact.elbow_resolution, exact.torque_limit) == (0.0, 0.0, math.inf)


def test_as_many_samples_are_kept_as_the_latest_reading_needs() -> None:
    """And the one before it, from which the filter goes on, and one for the sample's fraction."""
    assert history_samples(500, 0.02) == 12
    assert history_samples(500, 0.0201) == 13
    none = PassiveEncoder(0)
    assert model_of(EkfSettings(), passive=none).history == 2
    assert model_of(EkfSettings(gyro=True), passive=none).history == 12
    assert model_of(EkfSettings()).history == 12
    assert model_of(EkfSettings(camera=True), passive=none).history == 52


RIGID = EkfSettings(gyro=True, force_deviation=1.0)


@pytest.mark.parametrize(
    ("settings", "limits"),
    [
        (EkfSettings(), (50.0, math.inf, math.inf)),
        # the model knows of no load, which sends the innovations to one side
        (EkfSettings(gyro=True), (50.0, math.inf, 10.0)),
        (RIGID, (50.0, 1.273, 10.0)),
        (RIGID._replace(play=0.0025, gyro_noise=0.1, play_frequency=60.0), (199.9, 1.273, 6.0)),
        (EkfSettings(gyro=True, misfit_limit=3.0, offset_limit=2.0, jump_limit=math.inf), (3.0, 2.0, math.inf)),
    ],
    ids=["encoders alone", "no force", "rigid", "elastic", "given"],
)
def test_limits_of_the_watch_follow_from_what_is_declared_unless_they_are_given(
    settings: EkfSettings, limits: tuple[float, float, float]
) -> None:
    assert watch_limits(settings, 500) == pytest.approx(limits, rel=1e-3)
    model = model_of(settings)
    limits = watch_limits(settings, RATE_HZ, largest_bending(ROBOT, settings.play_frequency, math.inf))
    assert (model.misfit_limit, model.offset_limit, model.jump_limit) == pytest.approx(limits)


def test_zeros_that_explain_what_play_does_not_leave_less_room_for_an_offset() -> None:
    elastic = RIGID._replace(play=0.0025, gyro_noise=0.1, play_frequency=60.0)
    offsets = [watch_limits(one, 500, zero=zero).offset_limit for one in (elastic, RIGID) for zero in (0.0024, 0.0026)]
    assert offsets == pytest.approx([1.273, 0.849, 1.273, 1.273], rel=1e-3)


def test_a_jump_is_as_large_as_rotors_swing_when_the_torque_of_the_drives_reverses() -> None:
    """Static bending of the leg with less inertia, four times, beside the deviations of the play."""
    assert largest_bending(ROBOT, 0.0, 2.0) == 0.0
    bending = largest_bending(ROBOT, 60.0, 2.0)
    assert bending == pytest.approx(2.0 / (0.0133 * (math.tau * 60.0) ** 2), rel=1e-9)
    assert largest_bending(ROBOT, 30.0, 1.0) == pytest.approx(2.0 * bending, rel=1e-9)
    elastic, drives = RIGID._replace(play=0.002, play_frequency=60.0), Drives(torque_limit=2.0)
    assert model_of(elastic, drives).jump_limit == pytest.approx(math.hypot(6.0, 4.0 * bending / 0.002), rel=1e-9)
    assert model_of(elastic._replace(play_frequency=0.0), Drives()).jump_limit == 6.0


@pytest.mark.parametrize(
    ("play", "torque"), [(0.0, 2.0), (0.001, 2.0), (0.002, None)], ids=["none declared", "too little", "any torque"]
)
def test_offset_and_jump_have_no_limit_where_play_is_less_than_the_drives_bend(
    play: float, torque: float | None
) -> None:
    settings = RIGID._replace(play=play, play_frequency=60.0)
    model = model_of(settings, Drives(torque_limit=torque))
    assert (model.offset_limit, model.jump_limit) == (math.inf, math.inf)
    assert model.misfit_limit >= 50.0
    # those that are set hold all the same
    assert model_of(settings._replace(jump_limit=4.0), Drives(torque_limit=torque)).jump_limit == 4.0


@pytest.mark.parametrize(
    ("rig", "limits"),
    [
        # zeros that are known better than the play
        ("good", (555.2, 1.273, 6.0)),
        ("middling", (199.9, 0.849, 6.23)),
        # light rotors, or soft transmissions, that the drives bend by more than the declared play
        ("poor", (200.0, math.inf, math.inf)),
        ("printed", (200.0, math.inf, math.inf)),
        ("printed_calibrated", (200.0, math.inf, math.inf)),
    ],
)
def test_the_rigs_leave_the_limits_of_offsets_and_jumps_to_what_they_declare(
    rig: str, limits: tuple[float, float, float]
) -> None:
    kept = find_rig(rig).scenario["ekf"]
    assert not {"offset_limit", "jump_limit"} & set(kept)
    scenario = draw(1, 0, rig).scenario("unified")
    settings, torque = EkfSettings(**kept), scenario.drives().torque_limit
    assert torque is not None
    bending = largest_bending(scenario.five_bar(), settings.play_frequency, torque)
    zero = scenario.tolerances.zero
    assert watch_limits(settings, 500, bending, zero) == pytest.approx(limits, rel=1e-3)


def test_what_swings_averages_out_of_the_signed_mean_and_a_bias_does_not() -> None:
    model = model_of(RIGID)
    swinging = biased = no_pattern()
    for sample in range(RATE_HZ):
        swing = 5.0 * math.sin(math.tau * 60.0 * sample / RATE_HZ)
        swinging = after_gyro(model, after_encoders(model, swinging, swing, 0.0), swing)
        biased = after_gyro(model, after_encoders(model, biased, 0.0, -1.5), 0.0)
    assert largest_offset(swinging) < 0.3 * model.offset_limit
    assert largest_offset(biased) == pytest.approx(1.5, rel=1e-3)
    assert largest_offset(biased) > model.offset_limit


def test_an_estimated_error_counts_in_units_of_its_tolerance_if_it_has_one() -> None:
    model = model_of(RIGID)
    known = model._replace(filter=model.filter._replace(errors=error_deviations(Tolerances(length=2e-4))))
    errors = [0.0] * len(NO_ERRORS)
    errors[L12 - ERRORS], errors[ZERO2 - ERRORS] = -3.6e-4, 1.0
    estimate = Estimate(0.0, 0.15, 0.0, 0.0, 0.0, 0.0, errors=NO_ERRORS._make(errors))
    belief = Belief(estimate, np.zeros((SIZE, SIZE)))
    found = after_estimate(known, after_encoders(known, no_pattern(), 2.0, 0.0), belief, 1)
    assert found.error == pytest.approx(1.8, rel=1e-9)
    assert found.jump == 2.0
    # innovations leave it as it is
    assert after_gyro(known, after_encoders(known, found, 0.0, 0.0), 0.0).error == found.error


def test_offset_and_error_count_together_where_an_error_has_a_limit() -> None:
    without, model = model_of(RIGID), model_of(RIGID._replace(error_limit=2.0))
    biased = no_pattern()._replace(error=1.2)
    for _ in range(RATE_HZ):
        biased = after_gyro(model, biased, 0.8 * model.offset_limit)
    assert strain(without, biased) == pytest.approx(0.8, rel=1e-3)
    assert strain(model, biased) == pytest.approx(1.0, rel=1e-3)


def test_a_bias_is_measured_by_what_readings_have_told_of_it() -> None:
    """The posterior of a bias and a slope by the normal equations, of readings drawn with the declared variances."""
    random = np.random.default_rng(5)
    prior, noise, draws = np.array([0.02, 0.5]), 0.1, 4000
    rows = np.column_stack([np.ones(30), np.linspace(-1.0, 2.0, 30)])
    posterior = np.linalg.inv(np.diag(prior**-2.0) + rows.T @ rows / noise**2)
    constants = prior * random.standard_normal((draws, 2))
    readings = constants @ rows.T + noise * random.standard_normal((draws, 30))
    estimates = (readings @ rows @ posterior / noise**2)[:, 0]
    found = np.array([learned(one, prior[0] ** 2, posterior[0, 0]) for one in estimates])
    # of chi-squared: its mean, and the share beyond two standard deviations
    assert np.mean(found**2) == pytest.approx(1.0, abs=0.08)
    assert np.mean(found > 2.0) == pytest.approx(0.0455, abs=0.01)
    # little has been learned where the variance has hardly changed
    assert learned(-0.004, 4e-4, 4e-4) == pytest.approx(2.0, rel=1e-12)
    assert learned(0.0, 0.0, 0.0) == 0.0


def test_a_bias_that_walks_may_be_larger_later() -> None:
    model = model_of(RIGID._replace(gyro_bias=0.02, gyro_bias_rate=0.03))
    estimate = Estimate(0.0, 0.15, 0.0, 0.0, 0.0, 0.0, bias=-0.1)
    covariance = np.zeros((SIZE, SIZE))
    covariance[BIAS, BIAS] = 1e-4
    found = after_estimate(model, no_pattern(), Belief(estimate, covariance), 3 * RATE_HZ)
    assert found.bias == pytest.approx(0.1 / math.sqrt(4e-4 + 3.0 * 9e-4 - 1e-4), rel=1e-9)
    # together with an offset of half its limit
    half = Trend(-0.5 * model.offset_limit, 1.0)
    assert strain(model, found._replace(gyro=half)) == pytest.approx(math.hypot(0.5, found.bias / 6.0), rel=1e-9)


def test_a_bias_has_no_limit_where_drives_bend_the_transmissions_by_more_than_their_play() -> None:
    soft = RIGID._replace(play=1e-3, play_frequency=30.0)
    assert model_of(soft, Drives(2000, 0, 2.0)).bias_limit == math.inf
    assert model_of(soft._replace(play=0.5), Drives(2000, 0, 2.0)).bias_limit == 6.0
    assert model_of(EkfSettings()).bias_limit == math.inf
