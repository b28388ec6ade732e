"""What the estimator's settings come to: constants, and how many samples are kept."""

from __future__ import annotations

import math

import pytest
from estimator_at_rest import RATE_HZ, TIGHT, model_of

from fivebar_control.estimation.constants import Drives, history_samples
from fivebar_control.estimation.ekf import EkfSettings
from fivebar_description.known_sensors import KnownSensors
from fivebar_description.passive_encoder import PassiveEncoder


def test_constants_follow_from_the_settings() -> None:
    settings = TIGHT._replace(play=0.02, camera_deviation=0.003, dwell_limit=0.3, mirror_deviations=4.0)
    passive = PassiveEncoder(2, 1000, rate_hz=100)
    model = model_of(settings, Drives(2000, 2, 1.5), passive, KnownSensors(0.004, 0.1))
    assert (model.resolution, model.elbow_resolution) == pytest.approx((math.tau / 2000, math.tau / 1000), rel=1e-12)
    assert (model.play, model.camera_variance) == pytest.approx((4e-4, 9e-6), rel=1e-12)
    assert (model.delay_samples, model.torque_limit, model.elbow, model.elbow_rate) == (2, 1.5, 2, 100)
    assert (model.gyro_clock, model.elbow_zero) == (0.004, 0.1)
    # after a misfit of one for the time constant, 1 - 1/e of it are in the mean
    assert (1.0 - model.misfit_share) ** (0.01 * RATE_HZ) == pytest.approx(math.exp(-1.0), rel=1e-9)
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
    assert model_of(EkfSettings(camera=True, camera_latency=0.1), passive=none).history == 52
    assert model_of(EkfSettings(camera=True, camera_latency=0.0), passive=none).history == 12
