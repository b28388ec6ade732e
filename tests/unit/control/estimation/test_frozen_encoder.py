"""A frozen encoder is noticed within a few samples wherever its motor turns, and never where none is frozen."""

from __future__ import annotations

import math

import pytest
from estimate_replay import OFF_MODEL, encoder_scenario

from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.offline import OfflineRun, simulate
from fivebar_control.estimation.ekf import EkfSettings, Estimate, filter_model
from fivebar_control.estimation.estimator import StateEstimator
from fivebar_control.estimation.frozen import ANGLE, COUNTS, DEVIATIONS, FEWEST, LONGEST, FrozenWatch
from fivebar_control.model.geometry import direct_geometry, inverse_geometry
from fivebar_description.parameters import FiveBar
from fivebar_description.tolerances import Tolerances


def at_100_hz() -> Scenario:
    return encoder_scenario("middle", 1.0, (400.0, 40.0), rate_hz=100)


@pytest.fixture(scope="module")
def crossing() -> tuple[Scenario, OfflineRun]:
    scenario = at_100_hz()
    return scenario, simulate(scenario)


FarOff = tuple[FrozenWatch, tuple[float, float], Estimate]


@pytest.fixture
def far_off(dextar: FiveBar) -> FarOff:
    """A watch of fine encoders, readings of which that of motor 1 is half a radian off, and the prediction."""
    q = inverse_geometry(dextar, 1, -1, 0.01, 0.13)
    watch = FrozenWatch(filter_model(dextar, 1, -1, 100, EkfSettings()), 1e-7)
    return watch, (q.q11 + 0.5, q.q21), Estimate(0.01, 0.13, 0.0, 0.0, 0.0, 0.0)


def test_three_equal_readings_are_the_fewest_for_a_fault_and_two_for_a_suspicion(far_off: FarOff) -> None:
    watch, readings, expected = far_off
    answers = []
    for number in range(1, LONGEST + 2):
        answers.append(watch.check(readings, expected, False))
        assert (watch.suspected() is not None) == (2 <= number <= LONGEST)
    assert [answer is not None for answer in answers] == [FEWEST <= number <= LONGEST for number in range(1, 12)]
    # each of the repetitions is off by as much
    assert (answers[2] or "").startswith("q11 has read the same 3 times, while the motion is 0.5000 rad away from it")
    assert (answers[9] or "").startswith("q11 has read the same 10 times, while the motion is 0.5000 rad away from it")


@pytest.mark.parametrize("gap", [True, False])
def test_a_gap_or_another_reading_begins_again(far_off: FarOff, gap: bool) -> None:
    watch, readings, expected = far_off
    other = readings if gap else (readings[0] + 1e-6, readings[1])
    for _ in range(2):
        assert watch.check(readings, expected, False) is None
    assert watch.check(other, expected, gap) is None
    assert watch.suspected() is None
    assert watch.check(other, expected, False) is None
    found = watch.check(other, expected, False) or ""
    assert found.startswith("q11 has read the same 3 times, while the motion is 0.5000 rad away from it")


def test_what_the_tolerances_explain_is_no_difference(dextar: FiveBar) -> None:
    """Three standard deviations of the encoder's zero alone, which shifts a reading by as much."""
    zero = 0.01 / math.sqrt(3.0)
    tolerances = Tolerances(length=0.0, base=0.0, zero=0.01, gyro_scale=0.0)
    q = inverse_geometry(dextar, 1, -1, 0.01, 0.13)
    for beyond in (-2e-3, 2e-3):
        watch = FrozenWatch(filter_model(dextar, 1, -1, 100, EkfSettings(), tolerances), 0.0)
        readings = (q.q11, q.q21 - (DEVIATIONS * zero + beyond))
        answers = [watch.check(readings, Estimate(0.01, 0.13, 0.0, 0.0, 0.0, 0.0), False) for _ in range(3)]
        assert (answers[2] is not None) == (beyond > 0.0)
        if answers[2] is not None:
            assert "q21 has read the same 3 times, while the motion is 0.0020 rad away from it" in answers[2]


def test_what_was_explained_before_excuses_nothing_later(dextar: FiveBar) -> None:
    """A reading that stays, at first where the motion is, and then by a little more than the tolerance away from it."""
    zero, place = 0.01 / math.sqrt(3.0), (0.01, 0.13)
    tolerances = Tolerances(length=0.0, base=0.0, zero=0.01, gyro_scale=0.0)
    watch = FrozenWatch(filter_model(dextar, 1, -1, 100, EkfSettings(), tolerances), 0.0)
    q = inverse_geometry(dextar, 1, -1, *place)
    away = direct_geometry(dextar, 1, q.q11, q.q21 + DEVIATIONS * zero + 2.0 * ANGLE)
    for _ in range(2):
        assert watch.check((q.q11, q.q21), Estimate(*place, 0.0, 0.0, 0.0, 0.0), False) is None
    found = watch.check((q.q11, q.q21), Estimate(*away, 0.0, 0.0, 0.0, 0.0), False)
    assert (found or "").startswith("q21 has read the same 3 times")


def test_no_crossing_has_a_frozen_encoder(crossing: tuple[Scenario, OfflineRun]) -> None:
    assert crossing[1].faults == []
    for scenario in (
        encoder_scenario("middle", 0.5, plant=OFF_MODEL),
        encoder_scenario("middle", 2.0, plant={"encoder_counts": 262_144}),
        encoder_scenario("middle", 1.0, (100.0, 20.0), rate_hz=50),
    ):
        assert simulate(scenario).faults == []


@pytest.mark.parametrize("motor", [0, 1])
@pytest.mark.parametrize("first", [25, 35, 45, 50, 55, 65, 80])
def test_a_frozen_reading_is_noticed(crossing: tuple[Scenario, OfflineRun], first: int, motor: int) -> None:
    """The reference is on the locus at sample 50, where the motors turn round."""
    scenario, run = crossing
    estimator = StateEstimator(
        scenario.five_bar(), scenario.homing(), scenario.rate_hz, scenario.drives(), scenario.ekf
    )
    frozen = None
    for sample in run.samples:
        assert sample.estimated is not None
        angles, torques = list(sample.estimated.motors[0]), sample.estimated.motors[1]
        if sample.number == first:
            frozen = angles[motor]
        if frozen is not None:
            angles[motor] = frozen
        estimator.take(sample.number, angles[0], angles[1], *torques)
        estimator.commanded(sample.number, *sample.command)
        if estimator.fault is not None:
            break
    assert estimator.fault is not None
    assert estimator.fault.name == "encoder_frozen"
    assert f"q{motor + 1}1 has read the same" in estimator.fault.detail
    assert 1 <= sample.number - first <= 9


@pytest.mark.parametrize("coasting", [False, True])
def test_the_commanded_torque_decides(crossing: tuple[Scenario, OfflineRun], coasting: bool) -> None:
    """Two readings that stay from a sample on are of a robot at rest if the guard has taken the torque before."""
    scenario, run = crossing
    estimator = StateEstimator(
        scenario.five_bar(), scenario.homing(), scenario.rate_hz, scenario.drives(), scenario.ekf
    )
    stands = 35
    for sample in run.samples[: stands + FEWEST + 2]:
        assert sample.estimated is not None
        still = sample.number >= stands
        motors, torques = run.samples[min(sample.number, stands)].estimated.motors
        estimator.take(sample.number, *motors, *((0.0, 0.0) if still and coasting else torques))
        estimator.commanded(sample.number, *((0.0, 0.0) if still and coasting else sample.command))
    found = None if estimator.fault is None else estimator.fault.name
    assert (found == "encoder_frozen") is not coasting


@pytest.mark.parametrize("turning", [False, True])
def test_motors_that_stand_still_without_torque_are_no_frozen_encoders(dextar: FiveBar, turning: bool) -> None:
    """Drives that were stopped let friction hold the links at once, where the prediction still moves on."""
    watch, place = FrozenWatch(filter_model(dextar, 1, -1, 100, EkfSettings()), 0.0), (0.01, 0.13)
    q = inverse_geometry(dextar, 1, -1, *place)
    moves_on = Estimate(place[0], place[1] + 0.002, 0.0, 0.0, 0.0, 0.0)
    readings = [(q.q11, q.q21 + 0.001 * number * turning) for number in range(LONGEST)]
    answers = [watch.check(one, moves_on, False, coasts=True) for one in readings]
    assert any(answer is not None and answer.startswith("q11") for answer in answers) is turning
    # under torque one would have moved them
    assert any(watch.check(readings[-1], moves_on, False) for _ in range(LONGEST))


@pytest.mark.parametrize("motor", [0, 1])
@pytest.mark.parametrize(("part", "noticed"), [(0.99, False), (1.01, True)])
def test_a_robot_at_rest_may_be_a_little_off_for_ever(dextar: FiveBar, motor: int, part: float, noticed: bool) -> None:
    """What ten readings in a row add up to decides, nine of them repetitions; after them nothing is added."""
    count = 2.0 * math.pi / 20_000
    watch, place = FrozenWatch(filter_model(dextar, 1, -1, 100, EkfSettings()), count), (0.01, 0.13)
    q = inverse_geometry(dextar, 1, -1, *place)
    readings = [q.q11, q.q21]
    readings[motor] += part * (COUNTS * count + ANGLE) / (LONGEST - 1)
    at_rest = Estimate(*place, 0.0, 0.0, 0.0, 0.0)
    answers = [watch.check((readings[0], readings[1]), at_rest, False) for _ in range(100)]
    found = [number for number, answer in enumerate(answers, start=1) if answer is not None]
    assert found[:1] == ([LONGEST] if noticed else [])
