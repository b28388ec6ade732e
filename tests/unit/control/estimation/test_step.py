# SPDX-License-Identifier: Apache-2.0
"""The steps of the estimator's sample, each by itself."""

from __future__ import annotations

import math

import numpy as np
import pytest
from estimator_at_rest import ANGLES, HOME, MODES, RATE_HZ, ROBOT, TIGHT, model_of, started

from fivebar_control.estimation.camera import CAMERA_GATE, seen_at, with_seen
from fivebar_control.estimation.causes import causes_of, inconsistency_reason
from fivebar_control.estimation.ekf import Belief, advanced, as_vector, guessed, predicted
from fivebar_control.estimation.encoder import Angle
from fivebar_control.estimation.fault_numbers import ESTIMATE_INCONSISTENT, ESTIMATE_LOST
from fivebar_control.estimation.gyroscope import turn_rate, with_rate
from fivebar_control.estimation.history import VALUE, angle_at, keep_belief, row_of
from fivebar_control.estimation.late_reading import GYROSCOPE, PASSIVE, SENSORS
from fivebar_control.estimation.measurements import corrected, motor_speeds
from fivebar_control.estimation.passive_encoder import elbow_speed, with_elbow
from fivebar_control.estimation.readings import Misfit, Pattern, Trend, with_motors
from fivebar_control.estimation.settings import Drives
from fivebar_control.estimation.step import first_update, mean_square, next_update, prediction
from fivebar_control.model.geometry import inverse_geometry
from fivebar_control.safety.stages import NO_FAULT


def test_a_mean_of_nothing_is_not_known() -> None:
    squares = np.zeros((SENSORS, 2))
    assert math.isnan(mean_square(squares, GYROSCOPE))
    squares[GYROSCOPE] = 3.0, 1.0
    assert mean_square(squares, GYROSCOPE) == 3.0
    squares[GYROSCOPE] = 3.0, 2.0
    assert mean_square(squares, GYROSCOPE) == 1.5


def test_the_first_readings_give_the_place_and_expect_nothing_unusual() -> None:
    model = model_of(TIGHT._replace(play=0.001))
    memory = first_update(model, 1, ANGLES.q11, ANGLES.q21)
    assert memory.belief.estimate[:2] == pytest.approx(HOME, abs=1e-12)
    assert memory.misfit == (1.0, 1.0, 1.0, 1.0)
    assert (memory.newest, memory.near, memory.repeated1, memory.repeated2, memory.elbow_repeated) == (0, 0, 1, 1, 1)
    stiff = first_update(model_of(), 1, ANGLES.q11, ANGLES.q21).belief.covariance
    # the play of 1 mrad adds to the 1e-6 rad of an exact encoder
    assert memory.belief.covariance[0, 0] / stiff[0, 0] == pytest.approx(1.0 + 1e6, rel=1e-6)


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


def test_a_reading_of_a_passive_joint_between_two_samples_is_moved_by_the_speed_that_is_expected() -> None:
    model = model_of()
    memory = started(model)
    turning = memory.belief.estimate._replace(vx=0.05, vy=-0.02)
    for entry in range(memory.newest + 1):
        keep_belief(memory.history, entry, Belief(turning, memory.belief.covariance))
    speed = elbow_speed(model.filter, turning, model.elbow)
    assert abs(speed) > 0.1
    for made in (3.0, 2.75):
        placed = with_elbow(model, memory, made, 0.5)
        kept = placed.memory.history.late[row_of(placed.memory.history, placed.start), PASSIVE, VALUE]
        assert kept == pytest.approx(0.5 - model.elbow_zero + (3.0 - made) / RATE_HZ * speed, abs=1e-12)


def test_two_rates_of_one_update_count_by_their_mean() -> None:
    model = model_of(TIGHT._replace(gyro_bias=0.0, gyro_noise=1.0, gyro_bias_rate=0.0))
    memory = started(model)
    for made, off in ((3.0, 3.0), (4.0, 1.0)):
        placed = with_rate(model, memory, made, turn_rate(model.filter, memory.belief.estimate) + off)
    assert next_update(model, placed.memory, 3).squared.gyro == pytest.approx(5.0, rel=0.02)


def expect_same(found: Belief, wanted: Belief) -> None:
    np.testing.assert_allclose(as_vector(found.estimate), as_vector(wanted.estimate), rtol=1e-12, atol=1e-15)
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
    np.testing.assert_allclose(as_vector(found.predicted), as_vector(belief.estimate), rtol=1e-12, atol=1e-15)
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
    expect_same(found, seen_at(plain, *place, (made - 4.0) / RATE_HZ, counted, CAMERA_GATE).belief)
    assert found.estimate.x != plain.estimate.x


def test_the_motors_misfit_is_the_mean_of_both() -> None:
    """Readings that are both three deviations off: 1e-6 rad is all that is not known of exact encoders at rest."""
    model = model_of(TIGHT._replace(acceleration_noise=1e-6, disturbance_rate=0.0, disturbance_initial=0.0))
    memory = first_update(model, 1, ANGLES.q11, ANGLES.q21)
    exact = Belief(memory.belief.estimate, 1e-30 * np.eye(len(memory.belief.covariance)))
    memory.history.covariances[0] = exact.covariance.reshape(-1)
    there = advanced(model.filter, memory.belief.estimate, 0.0, 0.0)
    q = inverse_geometry(ROBOT, MODES, there.x, there.y)
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
    assert found.trip == NO_FAULT


@pytest.mark.parametrize("sensor", range(4))
def test_one_sensor_beyond_the_limit_is_enough(sensor: int) -> None:
    model = model_of(TIGHT._replace(misfit_limit=30.0))
    for misfit, inconsistent in ((30.0, False), (30.001, True)):
        means = [1.0, 1.0, 1.0, 1.0]
        means[sensor] = misfit
        memory = started(model)._replace(misfit=Misfit(*means))
        assert prediction(model, memory, [], 0).trip == (ESTIMATE_INCONSISTENT if inconsistent else NO_FAULT)


def test_a_place_out_of_reach_is_lost() -> None:
    model, memory = model_of(), started(model_of())
    far = Belief(memory.belief.estimate._replace(y=0.5), memory.belief.covariance)
    found = prediction(model, memory._replace(belief=far, near=7), [], 0)
    assert found.lost
    assert (found.memory.near, found.ambiguity) == (7, (7, math.inf, False))
    assert found.trip == ESTIMATE_LOST


def trend(sign: float, size: float) -> Trend:
    return Trend(sign * size, size)


def pattern_of(
    encoders: float = 0.0,
    gyro: float = 0.0,
    size: float = 6.0,
    jump: float = 0.0,
    error: float = 0.0,
    bias: float = 0.0,
) -> Pattern:
    """Return a pattern whose innovations have one sign so far (-1 to 1)."""
    return Pattern(trend(encoders, size), trend(encoders, 0.5 * size), trend(gyro, size), jump, 2, error, bias)


def test_the_reason_names_every_sensor_that_is_far_off_the_furthest_first() -> None:
    model = model_of(TIGHT._replace(misfit_limit=36.0))
    reason = inconsistency_reason(model, Misfit(100.0, 9.1, 9.0, 1.0), pattern_of())
    assert reason.startswith(
        "the motor encoders differ from the predictions by 10.0 standard deviations, the gyroscope differs by 3.0,"
        " limit 6.0; most likely first: "
    )
    assert inconsistency_reason(model, Misfit(1.0, 9.1, 49.0, 1.0), pattern_of()).startswith(
        "the passive joint's encoder differs from the predictions by 7.0 standard deviations, the gyroscope differs"
    )


@pytest.mark.parametrize(
    ("misfit", "pattern", "first"),
    [
        (Misfit(50.0, 1.0, 0.0, 1.0), pattern_of(0.1, 0.1), "elasticity or play of the transmissions"),
        (Misfit(50.0, 1.0, 0.0, 1.0), pattern_of(1.0, 0.0), "lengths or zeros beyond"),
        (Misfit(50.0, 1.0, 0.0, 1.0), pattern_of(1.0, 0.0, jump=30.0), "the encoder of q21, which slips"),
        (Misfit(1.0, 50.0, 0.0, 1.0), pattern_of(0.0, -1.0), "the gyroscope's bias"),
        (Misfit(1.0, 1.0, 60.0, 1.0), pattern_of(), "the passive joint's encoder"),
    ],
)
def test_how_the_innovations_came_tells_the_likeliest_cause(misfit: Misfit, pattern: Pattern, first: str) -> None:
    causes = causes_of(model_of(), misfit, pattern)
    assert causes[0].words.startswith(first)
    assert len(causes) == 5
    assert any("fivebar identify --resonance" in cause.words for cause in causes)


@pytest.mark.parametrize(
    ("limits", "words"),
    [
        ({"jump_limit": 9.0}, "the encoder of q21 jumped by 10.0 standard deviations from its prediction, limit 9.0;"),
        ({"offset_limit": 2.0}, "the gyroscope differs from its predictions to one side by 3.0 standard deviations"),
        ({"error_limit": 1.5}, "a length, a zero or the gyroscope's sensitivity comes out at 1.8 times its tolerance"),
        # each is at three quarters of its limit
        (
            {"offset_limit": 4.0, "error_limit": 2.4},
            "the gyroscope differs from its predictions to one side by 3.0 standard deviations on average, limit 4.0"
            " and a length, a zero or the gyroscope's sensitivity comes out at 1.8 times its tolerance, limit 2.4;",
        ),
        ({"jump_limit": 11.0, "offset_limit": 6.0, "error_limit": 2.4}, ""),
    ],
)
def test_a_jump_an_offset_and_an_error_have_limits_of_their_own(limits: dict[str, float], words: str) -> None:
    model = model_of(TIGHT._replace(**limits))
    memory = started(model)._replace(pattern=pattern_of(0.1, 1.0, 3.0, 10.0, 1.8))
    assert (prediction(model, memory, [], 0).trip == ESTIMATE_INCONSISTENT) is (words != "")
    if words:
        assert inconsistency_reason(model, memory.misfit, memory.pattern).startswith(words)


@pytest.mark.parametrize("play", [0.0, 1e-3])
def test_what_the_innovations_show_is_shared_out_among_the_causes(play: float) -> None:
    """A quarter of the encoders' squares came at once, a sixteenth of the rest is one-sided."""
    model = model_of()._replace(play=play)
    jump = math.sqrt(0.25 * 40.0 / (0.5 * model.misfit_share))
    half = Trend(math.sqrt(0.5), 1.0)
    pattern = Pattern(Trend(1.0, 4.0), Trend(2.0, 2.5), half, jump, 2, 0.0, 0.0)
    causes = causes_of(model, Misfit(40.0, 8.0, 4.0, 1.0), pattern)
    weights = {" ".join(cause.words.split()[:2]): cause.weight for cause in causes}
    encoders, gyro, elbow = 40.0 / 52.0, 8.0 / 52.0, 4.0 / 52.0
    swinging = 0.75 * 15.0 / 16.0 * encoders + 0.5 * gyro
    assert weights == pytest.approx(
        {
            "elasticity or": (2.0 if play == 0.0 else 1.0) * swinging,
            "lengths or": 0.75 / 16.0 * encoders,
            "the encoder": 0.25 * encoders,
            "the gyroscope's": 0.5 * gyro,
            "the passive": elbow,
        }
    )


def test_an_error_beyond_its_limit_is_explained_by_lengths_or_zeros_first() -> None:
    model, pattern = model_of(TIGHT._replace(error_limit=1.5)), pattern_of(0.1, 0.0, 0.0, 0.0, 1.8)
    assert causes_of(model, Misfit(0.5, 0.5, 0.5, 1.0), pattern)[0].words.startswith("lengths or zeros beyond")
    swinging = causes_of(model, Misfit(0.5, 0.5, 0.5, 1.0), pattern._replace(error=0.0))
    assert swinging[0].words.startswith("elasticity or play")


def test_a_bias_beyond_its_limit_is_a_fault_that_names_the_gyroscope() -> None:
    model = model_of(TIGHT)
    memory = started(model)._replace(pattern=pattern_of(0.1, 0.0, 0.1, 0.0, 0.0, 5.9))
    assert prediction(model, memory, [], 0).trip == NO_FAULT
    memory = memory._replace(pattern=memory.pattern._replace(bias=6.5))
    assert prediction(model, memory, [], 0).trip == ESTIMATE_INCONSISTENT
    reason = inconsistency_reason(model, memory.misfit, memory.pattern)
    assert reason.startswith("the gyroscope's bias comes out at 6.5 standard deviations of `gyro_bias`")
    assert "limit 6.0; most likely first: the gyroscope's bias" in reason


def test_what_is_further_off_than_its_limit_is_named_before_an_offset() -> None:
    model, one_sided = model_of(TIGHT._replace(misfit_limit=36.0, offset_limit=2.0)), pattern_of(0.1, 1.0, 3.0)
    assert inconsistency_reason(model, Misfit(49.0, 1.0, 1.0, 1.0), one_sided).startswith("the motor encoders differ")
    assert inconsistency_reason(model, Misfit(25.0, 1.0, 1.0, 1.0), one_sided).startswith(
        "the gyroscope differs from its"
    )
    within = inconsistency_reason(model, Misfit(25.0, 1.0, 1.0, 1.0), pattern_of(0.1, 0.1, 3.0))
    assert within.startswith("the motor encoders differ")


def test_a_jump_does_not_hide_that_another_sensor_is_far_off() -> None:
    """Such as a gyroscope with a wrong clock, which takes the estimate away from what the encoders read."""
    model = model_of(TIGHT._replace(jump_limit=9.0, misfit_limit=36.0))
    reason = inconsistency_reason(model, Misfit(30.0, 16.0, 1.0, 1.0), pattern_of(jump=10.0))
    assert reason.startswith(
        "the encoder of q21 jumped by 10.0 standard deviations from its prediction, the gyroscope differs by 4.0, limit"
    )
