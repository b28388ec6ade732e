"""The estimator's constants and the steps of a sample, each by itself."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fivebar_control.estimation.constants import Drives, EstimatorModel, estimator_model, history_samples
from fivebar_control.estimation.ekf import Belief, EkfSettings, advanced, guessed, predicted
from fivebar_control.estimation.encoder import MOST_REPETITIONS, Angle
from fivebar_control.estimation.history import (
    ELBOW,
    LAG,
    PERIODS,
    RATE,
    SAMPLE,
    TAU1,
    TAU2,
    angle_at,
    keep_belief,
    row_of,
)
from fivebar_control.estimation.measurements import corrected, motor_speeds, seen_at, turn_rate
from fivebar_control.estimation.readings import EstimatorMemory, Misfit, with_elbow, with_motors, with_rate, with_seen
from fivebar_control.estimation.step import Mean, first_update, inconsistency_reason, mean_of, next_update, prediction
from fivebar_control.model.geometry import inverse_geometry
from fivebar_description.known_sensors import KnownSensors
from fivebar_description.passive_encoder import PassiveEncoder
from fivebar_description.robot_file import load_robot

ROBOT, MODES, RATE_HZ = load_robot(), (1, -1), 500
HOME = (0.0, 0.15)
ANGLES = inverse_geometry(ROBOT, *MODES, *HOME)
TIGHT = EkfSettings(gyro=True, camera=True, misfit_time=0.01)


def model_of(
    settings: EkfSettings = TIGHT,
    drives: Drives | None = None,
    passive: PassiveEncoder | None = None,
    known: KnownSensors | None = None,
) -> EstimatorModel:
    return estimator_model(
        ROBOT,
        *MODES,
        RATE_HZ,
        Drives() if drives is None else drives,
        settings,
        passive=PassiveEncoder(2, None) if passive is None else passive,
        known=KnownSensors() if known is None else known,
    )


def started(model: EstimatorModel, samples: int = 4) -> EstimatorMemory:
    """Return the memory of a robot at rest at home, its last motor readings still to be taken."""
    memory = first_update(model, 1, ANGLES.q11, ANGLES.q21)
    for sample in range(1, samples + 1):
        if sample > 1:
            memory = next_update(model, memory, memory.newest).memory
        memory = with_motors(memory, sample, 1, ANGLES.q11, ANGLES.q21, 0.0, 0.0)
    return memory


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


def test_a_mean_of_nothing_is_not_known() -> None:
    assert math.isnan(mean_of(Mean(0.0, 0)))
    assert mean_of(Mean(3.0, 1)) == 3.0
    assert mean_of(Mean(3.0, 2)) == 1.5


def test_the_first_readings_give_the_place_and_expect_nothing_unusual() -> None:
    model = model_of(TIGHT._replace(play=0.001))
    memory = first_update(model, 1, ANGLES.q11, ANGLES.q21)
    assert memory.belief.estimate[:2] == pytest.approx(HOME, abs=1e-12)
    assert memory.misfit == (1.0, 1.0, 1.0)
    assert (memory.newest, memory.near, memory.repeated1, memory.repeated2, memory.elbow_repeated) == (0, 0, 1, 1, 1)
    stiff = first_update(model_of(), 1, ANGLES.q11, ANGLES.q21).belief.covariance
    # the play of 1 mrad adds to the 1e-6 rad of an exact encoder
    assert memory.belief.covariance[0, 0] / stiff[0, 0] == pytest.approx(1.0 + 1e6, rel=1e-6)


def test_further_readings_remember_those_before() -> None:
    memory = first_update(model_of(), 1, 1.0, 2.0)
    later = with_motors(with_motors(memory, 1, 1, 1.0, 2.5, 0.1, 0.2), 4, 3, 1.0, 2.5, 0.3, 0.4)
    assert (later.newest, later.last1, later.last2, later.before1, later.before2) == (2, 1.0, 2.5, 1.0, 2.5)
    assert (later.repeated1, later.repeated2) == (3, 2)
    kept = later.history.inputs[row_of(later.history, 2)]
    assert kept[[SAMPLE, PERIODS, TAU1, TAU2]].tolist() == [4.0, 3.0, 0.3, 0.4]
    for sample in range(5, 40):
        later = with_motors(later, sample, 1, 1.0, 2.5, 0.0, 0.0)
    assert later.repeated1 == MOST_REPETITIONS


@pytest.mark.parametrize(
    ("made", "entry", "lag"), [(3.0, 3, 0.0), (2.25, 3, -0.75), (2.0, 2, 0.0), (4.5, 4, 0.5), (0.5, 1, -0.5)]
)
def test_a_rate_is_put_at_the_sample_after_it(made: float, entry: int, lag: float) -> None:
    """By its own clock, of which 2 ms are known; what comes after the newest sample is put there."""
    model = model_of(known=KnownSensors(imu_clock=0.002))
    placed = with_rate(model, started(model), made + 1.0, 0.3)
    kept = placed.memory.history.inputs[row_of(placed.memory.history, entry)]
    assert placed.start == entry
    assert kept[RATE] == 0.3
    assert kept[LAG] * RATE_HZ == pytest.approx(lag, abs=1e-9)


@pytest.mark.parametrize(("clock", "entry"), [(0.0, 4), (0.0015, 3), (0.0035, 2), (-0.0015, 4)])
def test_a_rate_is_put_where_its_clock_is_estimated_to_have_been(clock: float, entry: int) -> None:
    """It was stamped half a period after sample 3, by a clock that is so late (s)."""
    model, memory = model_of(), started(model_of())
    belief = memory.belief._replace(estimate=memory.belief.estimate._replace(clock=clock))
    placed = with_rate(model, memory._replace(belief=belief), 3.5, 0.3)
    assert placed.start == entry
    lag = placed.memory.history.inputs[row_of(placed.memory.history, entry), LAG]
    assert lag * RATE_HZ == pytest.approx(3.5 - entry, abs=1e-12)


@pytest.mark.parametrize("zero", [0.0, 0.1])
def test_the_passive_encoders_zero_is_taken_off_its_reading(zero: float) -> None:
    model = model_of(known=KnownSensors(passive_zero=zero))
    placed = with_elbow(model, started(model), 4.0, ANGLES.q22 + zero)
    kept = placed.memory.history.inputs[row_of(placed.memory.history, placed.start)]
    assert kept[ELBOW] == pytest.approx(ANGLES.q22, abs=1e-12)


@pytest.mark.parametrize("add", [with_rate, lambda *rest: with_seen(*rest, 0.15, 1e-8), with_elbow])
def test_a_reading_of_before_the_second_sample_is_left_out(add: object) -> None:
    model = model_of()
    memory = started(model)
    before = memory.history.inputs.copy()
    assert add(model, memory, -0.5, 0.3) == (memory, memory.newest)  # type: ignore[operator]
    np.testing.assert_array_equal(memory.history.inputs, before)


def test_each_reading_of_a_sensor_counts_once_in_its_mean() -> None:
    """A rate that is 3 deviations off, late by two samples, and then nothing; the passive joint's angle likewise."""
    model = model_of(TIGHT._replace(gyro_bias=0.0, gyro_noise=1.0, gyro_bias_rate=0.0))
    memory = started(model)
    placed = with_rate(model, memory, 2.0, turn_rate(model.filter, memory.belief.estimate) + 3.0)
    found = next_update(model, placed.memory, placed.start)
    # the velocity is known so much better that the noise of the reading is all
    assert found.squared.gyro == pytest.approx(9.0, rel=0.02)
    assert math.isnan(found.squared.elbow)
    expected = 1.0 + model.misfit_share * (found.squared.gyro - 1.0)
    assert found.memory.misfit.gyro == pytest.approx(expected, rel=1e-12)
    again = next_update(model, with_motors(found.memory, 5, 1, ANGLES.q11, ANGLES.q21, 0.0, 0.0), placed.start)
    assert math.isnan(again.squared.gyro)
    assert again.memory.misfit.gyro == found.memory.misfit.gyro

    elbow = with_elbow(model, again.memory, 5.0, ANGLES.q22 + 0.01)
    seen = next_update(model, elbow.memory, elbow.start)
    assert seen.squared.elbow > 0.0
    expected = 1.0 + model.misfit_share * (seen.squared.elbow - 1.0)
    assert seen.memory.misfit.elbow == pytest.approx(expected, rel=1e-12)
    assert math.isnan(next_update(model, seen.memory, elbow.start).squared.elbow)


def test_two_rates_of_one_update_count_by_their_mean() -> None:
    model = model_of(TIGHT._replace(gyro_bias=0.0, gyro_noise=1.0, gyro_bias_rate=0.0))
    memory = started(model)
    for made, off in ((3.0, 3.0), (4.0, 1.0)):
        placed = with_rate(model, memory, made, turn_rate(model.filter, memory.belief.estimate) + off)
    assert next_update(model, placed.memory, 3).squared.gyro == pytest.approx(5.0, rel=0.02)


def expect_same(found: Belief, wanted: Belief) -> None:
    np.testing.assert_allclose(found.estimate, wanted.estimate, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(found.covariance, wanted.covariance, rtol=1e-9, atol=1e-18)


@pytest.mark.parametrize("periods", [1, 2, 4])
def test_over_a_gap_the_torque_and_the_time_of_the_reading_are_in_doubt(periods: int) -> None:
    """Each period has the torque of the last one, unsure by its difference from that before the gap.

    The angles may be those of a period later: their variance grows by what the motors turn in one.
    """
    model = model_of()
    start = first_update(model, 1, ANGLES.q11, ANGLES.q21)
    moving = Belief(start.belief.estimate._replace(vx=0.3, vy=-0.4, d1=0.1), start.belief.covariance)
    keep_belief(start.history, 0, moving)
    memory = with_motors(start, 1, 1, ANGLES.q11 + 1e-3, ANGLES.q21 - 2e-3, 0.3, -0.2)
    memory = next_update(model, memory, 1).memory
    belief = memory.belief
    reading = memory.last1 + 2e-3 * periods, memory.last2 + 1e-3 * periods
    memory = with_motors(memory, 1 + periods, periods, *reading, 0.8, -0.5)
    found = next_update(model, memory, 2)
    for _ in range(periods):
        if periods == 1:
            belief = predicted(model.filter, belief, 0.8, -0.5)
        else:
            belief = guessed(model.filter, belief, 0.8, -0.5, 0.8 - 0.3, -0.5 + 0.2)
    assert found.predicted == pytest.approx(belief.estimate, rel=1e-12, abs=1e-15)
    late = np.array(motor_speeds(model.filter, belief.estimate)) / RATE_HZ if periods > 1 else np.zeros(2)
    angles = []
    for number in (1, 2):
        kept = angle_at(memory.history, 2, number)
        assert kept.value == reading[number - 1]
        angles.append(Angle(kept.value, kept.variance + float(late[number - 1]) ** 2))
    expect_same(found.memory.belief, corrected(model.filter, belief, *angles).belief)


@pytest.mark.parametrize(("made", "variance", "counted"), [(4.5, 1e-20, 0.002**2), (4.0, 1e-4, 1e-4)])
def test_a_position_by_the_camera_counts_at_its_exposure(made: float, variance: float, counted: float) -> None:
    """With the variance that it says of itself, and no less than what the settings say of every camera."""
    model = model_of(TIGHT._replace(camera_deviation=0.002, play=0.01))
    without = started(model)
    plain = next_update(model, without, without.newest).memory.belief
    memory = started(model)
    place = HOME[0] + 1e-3, HOME[1] - 2e-3
    placed = with_seen(model, memory, made, *place, variance)
    assert placed.start == 4
    found = next_update(model, placed.memory, placed.start).memory.belief
    expect_same(found, seen_at(plain, *place, (made - 4.0) / RATE_HZ, counted, model.camera_gate).belief)
    assert found.estimate.x != plain.estimate.x


def test_the_motors_misfit_is_the_mean_of_both() -> None:
    """Readings that are both three deviations off: 1e-6 rad is all that is not known of exact encoders at rest."""
    model = model_of(TIGHT._replace(acceleration_noise=1e-6, disturbance_rate=0.0, disturbance_initial=0.0))
    memory = first_update(model, 1, ANGLES.q11, ANGLES.q21)
    exact = Belief(memory.belief.estimate, 1e-30 * np.eye(len(memory.belief.covariance)))
    memory.history.covariances[0] = exact.covariance.reshape(-1)
    there = advanced(model.filter, memory.belief.estimate, 0.0, 0.0)
    q = inverse_geometry(ROBOT, *MODES, there.x, there.y)
    found = next_update(model, with_motors(memory, 1, 1, q.q11 + 3e-6, q.q21 - 3e-6, 0.0, 0.0), 1)
    assert found.predicted == there
    assert found.squared.encoders == pytest.approx(9.0, rel=1e-3)
    expected = 1.0 + model.misfit_share * (found.squared.encoders - 1.0)
    assert found.memory.misfit.encoders == pytest.approx(expected, rel=1e-12)


def test_a_prediction_takes_the_commands_that_do_not_act_yet() -> None:
    """Those of samples 4 and 5 in a ring of three, within the drives' limit."""
    model = model_of(drives=Drives(delay_samples=2, torque_limit=1.0))
    memory = started(model)
    commands = [(9.0, 9.0), (0.5, -3.0), (2.0, -0.25)]
    found = prediction(model, memory, commands, 4)
    expected = advanced(model.filter, memory.belief.estimate, 0.5, -1.0)
    assert found.estimate == advanced(model.filter, expected, 1.0, -0.25)
    assert not found.lost
    assert not found.inconsistent


@pytest.mark.parametrize("sensor", range(3))
def test_one_sensor_beyond_the_limit_is_enough(sensor: int) -> None:
    model = model_of(TIGHT._replace(misfit_limit=30.0))
    for misfit, inconsistent in ((30.0, False), (30.001, True)):
        means = [1.0, 1.0, 1.0]
        means[sensor] = misfit
        memory = started(model)._replace(misfit=Misfit(*means))
        assert prediction(model, memory, [], 0).inconsistent == inconsistent


def test_a_place_out_of_reach_is_lost() -> None:
    model, memory = model_of(), started(model_of())
    far = Belief(memory.belief.estimate._replace(y=0.5), memory.belief.covariance)
    found = prediction(model, memory._replace(belief=far, near=7), [], 0)
    assert found.lost
    assert (found.memory.near, found.ambiguity) == (7, (7, math.inf, False))
    assert not found.inconsistent


def test_the_reason_names_every_sensor_that_is_far_off_the_furthest_first() -> None:
    model = model_of(TIGHT._replace(misfit_limit=36.0))
    reason = inconsistency_reason(model, Misfit(100.0, 9.1, 9.0))
    assert reason.startswith(
        "the motor encoders differ from the predictions by 10.0 standard deviations, the gyroscope differs by 3.0,"
        " limit 6.0: check"
    )
    assert inconsistency_reason(model, Misfit(1.0, 9.1, 49.0)).startswith(
        "the passive joint's encoder differs from the predictions by 7.0 standard deviations, the gyroscope differs"
    )
