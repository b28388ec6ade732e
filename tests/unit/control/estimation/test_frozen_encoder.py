"""A frozen encoder is noticed within a few samples wherever its motor turns, and never where none is frozen."""

from __future__ import annotations

import pytest
from estimate_replay import OFF_MODEL, encoder_scenario

from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.offline import OfflineRun, simulate
from fivebar_control.estimation.ekf import EkfSettings, Estimate, filter_model
from fivebar_control.estimation.estimator import StateEstimator
from fivebar_control.estimation.frozen import ANGLE, COUNTS, FEWEST, LONGEST, FrozenWatch
from fivebar_control.model.geometry import inverse_geometry
from fivebar_description.parameters import FiveBar


def at_100_hz() -> Scenario:
    return encoder_scenario("middle", 1.0, (400.0, 40.0), rate_hz=100)


@pytest.fixture(scope="module")
def crossing() -> tuple[Scenario, OfflineRun]:
    scenario = at_100_hz()
    return scenario, simulate(scenario)


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
    count = 2.0 * 3.141592653589793 / 20_000
    watch, place = FrozenWatch(filter_model(dextar, 1, -1, 100, EkfSettings()), count), (0.01, 0.13)
    q = inverse_geometry(dextar, 1, -1, *place)
    readings = [q.q11, q.q21]
    readings[motor] += part * (COUNTS * count + ANGLE) / (LONGEST - 1)
    at_rest = Estimate(*place, 0.0, 0.0, 0.0, 0.0)
    answers = [watch.check((readings[0], readings[1]), at_rest, False) for _ in range(100)]
    found = [number for number, answer in enumerate(answers, start=1) if answer is not None]
    assert found[:1] == ([LONGEST] if noticed else [])
