# SPDX-License-Identifier: Apache-2.0
"""What the estimator publishes, and what it does around the filter: gaps, commands, warming up, latched faults."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest

from fivebar_control.estimation.compiled_estimator import CompiledEstimator
from fivebar_control.estimation.estimator import JointEstimate, StateEstimator
from fivebar_control.estimation.homing import homing_at
from fivebar_control.estimation.late_reading import CAMERA, GYROSCOPE, PASSIVE, LateReading
from fivebar_control.estimation.settings import Drives, EkfSettings, Sensing
from fivebar_control.model.geometry import inverse_geometry
from fivebar_description.robot_file import load_robot
from fivebar_description.sensors import PassiveEncoder
from fivebar_description.tolerances import Tolerances

ROBOT, PLACE = load_robot(), (0.0, 0.15)
Q = inverse_geometry(ROBOT, (1, -1), *PLACE)


def estimator(settings: EkfSettings | None = None, drives: Drives | None = None, rate_hz: int = 500) -> StateEstimator:
    homing = homing_at(ROBOT, (1, -1), *PLACE)
    return StateEstimator(ROBOT, homing, Sensing(rate_hz, drives or Drives(), settings or EkfSettings()))


def taken(one: StateEstimator, sample: int, readings: Sequence[LateReading] = ()) -> JointEstimate:
    """Return the answer to readings of the robot at rest, with torques of their own."""
    return one.take(sample, Q.q11, Q.q21, 0.2, -0.1, readings)


def test_deviations_and_disturbances_of_an_answer_are_those_of_the_belief() -> None:
    one = estimator()
    for sample in range(4):
        answer = taken(one, sample)
        assert one.belief is not None
        estimate, covariance = one.belief
        assert answer.effort == (0.2, 0.0, -0.1, 0.0)
        assert answer.disturbance == (estimate.d1, estimate.d2)
        assert np.square(answer.deviations) == pytest.approx(np.diag(covariance)[:6], rel=1e-12)
    assert 0.0 not in answer.disturbance


@pytest.mark.parametrize(("rate_hz", "longest"), [(100, 10), (500, 10), (1000, 20), (2000, 40)])
def test_over_ten_samples_or_as_long_as_drives_hold_their_torque_the_filter_predicts(
    rate_hz: int, longest: int
) -> None:
    for gap in (longest, longest + 1):
        one = estimator(EkfSettings(misfit_limit=1e9), rate_hz=rate_hz)
        for sample in (0, 1, 1 + gap):
            taken(one, sample)
        lost = f"estimate_lost: no motor readings from sample 2 to {gap}"
        assert (None if one.fault is None else str(one.fault)) == (None if gap == longest else lost)


def test_a_lost_robot_is_predicted_over_the_longest_gap_only() -> None:
    """However long the gap was: what it does in it is not known, and the time to work it out is not there."""
    beliefs = []
    for gap in (10, 1_000_000):
        one = estimator()
        for sample in (0, 1, 1 + gap):
            taken(one, sample)
        beliefs.append(one.belief)
    assert beliefs[0] is not None
    assert beliefs[1] is not None
    assert beliefs[0].estimate == beliefs[1].estimate


@pytest.mark.parametrize("turns", [-1, 2])
def test_readings_that_are_offset_or_wrapped_by_whole_turns_give_the_same_estimate(turns: int) -> None:
    plain, shifted = estimator(), estimator()
    for sample in range(20):
        angle = 1e-4 * sample
        expected = plain.take(sample, Q.q11 + angle, Q.q21 - angle, 0.0, 0.0)
        # offset throughout on one motor, wrapped on the way on the other
        q21 = Q.q21 - angle + (math.tau if sample > 9 else 0.0)
        found = shifted.take(sample, Q.q11 + angle + turns * math.tau, q21, 0.0, 0.0)
        assert found.position == pytest.approx(expected.position, abs=1e-9)
        assert found.velocity == pytest.approx(expected.velocity, abs=1e-6)
        assert (plain.turns, shifted.turns) == ((0, 0), (turns, int(sample > 9)))
    assert shifted.fault is None


def test_a_sample_that_comes_twice_is_one_period_later_at_least() -> None:
    one, two = estimator(), estimator()
    for sample in (0, 1, 1):
        taken(one, sample)
    for sample in (0, 1, 2):
        taken(two, sample)
    assert one.belief is not None
    assert two.belief is not None
    assert one.belief.estimate == two.belief.estimate


def test_warming_up_changes_nothing() -> None:
    cold, warm = (estimator(drives=Drives(delay_samples=2)) for _ in range(2))
    for _ in range(2):
        warm.warm_up()
        assert warm.belief is None
        assert warm.fault is None
        assert taken(warm, 0) == taken(cold, 0)
        cold, warm = (estimator(drives=Drives(delay_samples=2)) for _ in range(2))


def test_only_a_command_that_is_on_its_way_is_waited_for() -> None:
    direct, late = estimator(), estimator(drives=Drives(delay_samples=3))
    for one in (direct, late):
        # before sample 0 nothing was commanded, which is known
        assert not one.awaits(0)
        taken(one, 0)
    assert not direct.awaits(1)
    assert late.awaits(1)
    # where the readings of sample 1 were lost, nothing answers it
    assert not late.awaits(2)


def test_after_samples_without_any_command_none_acts() -> None:
    answers = []
    for known in (False, True):
        one = estimator(drives=Drives(delay_samples=1))
        taken(one, 0)
        if known:
            one.commanded(4, 0.0, 0.0)
        answers.append(taken(one, 5))
    assert answers[0] == answers[1]


@pytest.mark.parametrize("delay", [1, 2])
def test_over_a_gap_the_drives_hold_the_last_command(delay: int) -> None:
    answers = []
    for torque in (None, (0.3, -0.2), (0.0, 0.0)):
        one = estimator(drives=Drives(delay_samples=delay))
        taken(one, 0)
        one.commanded(0, 0.3, -0.2)
        for sample in range(1, 5):
            if torque is not None:
                one.commanded(sample, *torque)
        answers.append(taken(one, 5))
    assert answers[0] == answers[1] != answers[2]


def test_readings_are_compared_with_the_prediction_in_units_of_its_deviations() -> None:
    one = estimator()
    assert all(map(math.isnan, one.squared))
    taken(one, 0)
    assert all(map(math.isnan, one.squared))
    one.take(1, Q.q11, Q.q21, 0.0, 0.0)
    assert 0.0 <= one.squared.encoders < 1.0
    assert math.isnan(one.squared.gyro)
    one.take(2, Q.q11 + 1e-4, Q.q21, 0.0, 0.0)
    assert one.squared.encoders > 1.0


@pytest.mark.parametrize("camera", [True, False])
def test_positions_count_for_an_estimator_with_a_camera_only(camera: bool) -> None:
    seen, unseen = (estimator(EkfSettings(camera=camera)) for _ in range(2))
    for sample in range(6):
        fixes = [LateReading(CAMERA, float(sample), PLACE[0] + 1e-5, PLACE[1], 1e-5)] if sample == 3 else []
        taken(seen, sample, fixes)
        taken(unseen, sample)
    assert seen.belief is not None
    assert unseen.belief is not None
    assert (seen.belief.estimate != unseen.belief.estimate) == camera


def test_a_position_is_as_uncertain_as_it_says_of_itself() -> None:
    """Motors with play leave the place about as unsure as the first position is, and the second is ten times that."""
    moved = []
    for deviation in (1e-4, 1e-3):
        one = estimator(EkfSettings(camera=True, play=0.01))
        for sample in range(3):
            fixes = [LateReading(CAMERA, 2.0, PLACE[0] + 1e-4, PLACE[1], deviation)] if sample == 2 else []
            one.take(sample, Q.q11, Q.q21, 0.0, 0.0, fixes)
        assert one.belief is not None
        moved.append(one.belief.estimate.x)
    assert 0.5 * moved[0] > moved[1] > 0.0


def test_the_camera_decides_at_the_start_with_the_first_picture_that_shows_the_platform() -> None:
    one = estimator(EkfSettings(camera=True, seen_start=True))
    fixes = [
        LateReading(CAMERA, 0.0, math.nan, 0.1, 1e-5),
        LateReading(CAMERA, 0.0, *PLACE, 1e-5),
        LateReading(CAMERA, 0.0, 9.0, 9.0, 1e-5),
    ]
    answer = taken(one, 0, fixes)
    assert answer.position == pytest.approx(tuple(Q), abs=1e-9)
    assert one.fault is None


def test_an_estimate_that_could_be_the_other_assembly_mode_is_a_fault() -> None:
    """The platform stops near the locus for longer than the limit; the answers go on."""
    one = estimator(EkfSettings(dwell_limit=0.01, misfit_limit=1e9))
    for sample in range(1, 80):
        y = max(0.15 - 1e-3 * sample, 0.0867)
        q = inverse_geometry(ROBOT, (1, -1), 0.0, y)
        answer = one.take(sample - 1, q.q11, q.q21, 0.0, 0.0)
        if one.fault is not None:
            break
    assert one.fault is not None
    assert one.fault.name == "estimate_ambiguous"
    assert one.fault.detail.startswith(f"at sample {sample - 1}: ")
    assert all(map(math.isfinite, answer.position))


@pytest.mark.parametrize(
    "kind", [StateEstimator, pytest.param(CompiledEstimator, marks=pytest.mark.extra)], ids=["plain", "compiled"]
)
def test_a_robot_that_is_lost_for_good_is_answered_whatever_its_sensors_still_read(
    kind: type[StateEstimator],
) -> None:
    """A stopped robot falls through Type 1, where the filter has no numbers left, and its late sensors go on."""
    settings = EkfSettings(gyro=True, camera=True, misfit_limit=1e9)
    homing, encoder = homing_at(ROBOT, (1, -1), *PLACE), PassiveEncoder(2, None)
    instruments = Sensing(500, Drives(), settings, Tolerances(length=2e-4), encoder)
    one = kind(ROBOT, homing, instruments)
    for sample in range(300):
        read_before = max(0, sample - 2)
        readings = [
            LateReading(GYROSCOPE, read_before, 30.0),
            LateReading(PASSIVE, read_before, 0.1),
            LateReading(CAMERA, read_before, 0.0, 0.1, 1e-3),
        ]
        answer = one.take(sample, Q.q11 - 0.02 * sample, Q.q21 + 0.02 * sample, 0.0, 0.0, readings)
        assert all(map(math.isfinite, (*answer.position, *answer.velocity)))
    assert one.fault is not None
    assert one.belief is not None
    assert math.isnan(one.belief.estimate.clock)


def test_readings_of_a_passive_joint_are_used_in_the_turn_of_the_one_before() -> None:
    def answers(turns: float, read: bool) -> list[JointEstimate]:
        homing = homing_at(ROBOT, (1, -1), *PLACE)
        one = StateEstimator(
            ROBOT, homing, Sensing(500, Drives(), EkfSettings(), Tolerances(), PassiveEncoder(2, 20000))
        )
        found = []
        for sample in range(12):
            # it comes round by whole turns, as after a restart of its electronics
            elbow = Q.q22 + 0.002 * sample + (2.0 * math.pi * turns if sample > 5 else 0.0)
            found.append(
                one.take(sample, Q.q11, Q.q21, 0.0, 0.0, [LateReading(PASSIVE, float(sample), elbow)] if read else [])
            )
        return found

    with_it, turned, without = answers(0.0, True), answers(-3.0, True), answers(0.0, False)
    for one, other in zip(with_it, turned, strict=True):
        assert one.position == pytest.approx(other.position, abs=1e-9)
    assert abs(with_it[-1].position[3] - without[-1].position[3]) > 5e-5
