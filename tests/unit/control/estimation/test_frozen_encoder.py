# SPDX-License-Identifier: Apache-2.0
"""A frozen encoder is noticed within a few samples wherever its motor turns, and never where none is frozen."""

from __future__ import annotations

import math

import pytest
from estimate_replay import OFF_MODEL, encoder_scenario

from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.offline import OfflineRun, simulate
from fivebar_control.estimation.constants import estimator_model
from fivebar_control.estimation.ekf import Estimate
from fivebar_control.estimation.estimator import StateEstimator
from fivebar_control.estimation.fault_numbers import (
    ENCODER_FROZEN,
    ESTIMATE_INCONSISTENT,
    GYROSCOPE_EARLY,
    GYROSCOPE_FROZEN,
    GYROSCOPE_LATE,
    GYROSCOPE_MISSING,
)
from fivebar_control.estimation.frozen import (
    AWAY,
    FEWEST,
    SURE,
    EncoderStay,
    FrozenMemory,
    after_readings,
    hardest_braking,
    longest_held,
    named_fault,
    named_motor,
    nothing_read,
)
from fivebar_control.estimation.gyro_watch import not_used, unheard, used, waited
from fivebar_control.estimation.settings import Drives, EkfSettings, Sensing
from fivebar_control.model.geometry import inverse_geometry
from fivebar_control.safety.stages import NO_FAULT
from fivebar_control.scenario.sensors import homing_of
from fivebar_description.parameters import FiveBar
from fivebar_description.tolerances import EXACT, Tolerances


def at_100_hz() -> Scenario:
    return encoder_scenario("middle", 1.0, (400.0, 40.0), rate_hz=100)


@pytest.fixture(scope="module")
def crossing() -> tuple[Scenario, OfflineRun]:
    scenario = at_100_hz()
    return scenario, simulate(scenario)


COUNT = math.tau / 20_000


class Watch:
    """The watch of a robot whose encoders have counts of a size (rad), sample by sample."""

    def __init__(self, robot: FiveBar, count: float = COUNT, tolerances: Tolerances = EXACT, play: float = 0.0) -> None:
        drives, settings = Drives(round(math.tau / count)), EkfSettings(play=play)
        self.model = estimator_model(robot, (1, -1), Sensing(100, drives, settings, tolerances))
        self.memory = nothing_read()

    def named(self, readings: tuple[float, float], x: float, y: float, gap: bool = False, coasts: bool = False) -> int:
        """Return which motor's encoder is frozen after readings, with the platform predicted at (x, y) m."""
        expected = Estimate(x, y, 0.0, 0.0, 0.0, 0.0)
        self.memory = after_readings(self.model, self.memory, *readings, expected, gap, coasts)
        return named_motor(self.model, self.memory, inconsistent=False)


def along(number: float) -> tuple[float, float]:
    """Return where a platform is that goes straight on from sample to sample."""
    return 0.01, 0.13 + 0.001 * number


def motors_at(robot: FiveBar, x: float, y: float) -> tuple[float, float]:
    q = inverse_geometry(robot, (1, -1), x, y)
    return q.q11, q.q21


@pytest.mark.parametrize("motor", [0, 1])
def test_a_reading_that_stops_dead_on_the_way_is_frozen_at_the_third(dextar: FiveBar, motor: int) -> None:
    watch, found = Watch(dextar), []
    for number in range(12):
        readings = list(motors_at(dextar, *along(number)))
        readings[motor] = motors_at(dextar, *along(min(number, 5)))[motor]
        found.append(watch.named((readings[0], readings[1]), *along(number)))
    assert found[:8] == [0] * 7 + [motor + 1]
    assert set(found[8:]) == {motor + 1}


def test_a_reading_that_never_moved_is_frozen_once_the_robot_has_gone_away_from_it(dextar: FiveBar) -> None:
    watch, start = Watch(dextar), motors_at(dextar, *along(0))
    found = [watch.named((start[0], motors_at(dextar, *along(0.1 * n))[1]), *along(0.1 * n)) for n in range(40)]
    away = [abs(motors_at(dextar, *along(0.1 * n))[0] - start[0]) > AWAY * COUNT for n in range(40)]
    assert found[-1] == 1
    assert found.index(1) >= away.index(True)


@pytest.mark.parametrize("gap", [True, False])
def test_a_gap_or_another_reading_begins_again(dextar: FiveBar, gap: bool) -> None:
    watch = Watch(dextar)
    stays = motors_at(dextar, *along(0))
    for number in range(2):
        assert watch.named(stays, *along(5 * number)) == 0
    other = stays if gap else (stays[0] + 1e-6, stays[1])
    assert watch.named(other, *along(10), gap) == 0
    turns = other[0], motors_at(dextar, *along(15))[1]
    assert watch.named(turns, *along(15)) == 0
    assert watch.named((other[0], motors_at(dextar, *along(20))[1]), *along(20)) == 1


def test_a_robot_at_rest_or_on_a_slow_motion_is_never_called_frozen(dextar: FiveBar) -> None:
    """Whatever the estimate is off by; and where counts last for several samples."""
    watch, rest = Watch(dextar), motors_at(dextar, *along(0))
    assert not any(watch.named(rest, *along(20)) for _ in range(200))
    watch = Watch(dextar)
    for number in range(400):
        exact = motors_at(dextar, *along(0.02 * number))
        read = math.floor(exact[0] / COUNT) * COUNT, math.floor(exact[1] / COUNT) * COUNT
        assert watch.named(read, *along(0.02 * number + 4.0)) == 0


@pytest.mark.parametrize(("play", "named"), [(0.0, True), (0.02, False)])
def test_what_play_and_tolerances_explain_is_no_difference(dextar: FiveBar, play: float, named: bool) -> None:
    for keys in ({"play": play}, {"tolerances": Tolerances(0.0, 0.0, play * math.sqrt(3.0))}):
        watch, start = Watch(dextar, **keys), motors_at(dextar, *along(0))  # type: ignore[arg-type]
        readings = [(start[0], motors_at(dextar, *along(0.4 * n))[1]) for n in range(11)]
        assert any(watch.named(one, *along(0.4 * n)) for n, one in enumerate(readings)) is named


def test_a_motor_that_comes_to_rest_slowly_and_stays_is_never_called_frozen(dextar: FiveBar) -> None:
    """However long it stays, and whatever the estimate is off by."""
    watch = Watch(dextar)
    for number in range(400):
        place = along(min(0.03 * number, 3.0))
        read = [math.floor(one / COUNT) * COUNT for one in motors_at(dextar, *place)]
        assert watch.named((read[0], read[1]), *along(min(0.03 * number, 3.0) + 3.0)) == 0


def stays(number: int, speed: float) -> FrozenMemory:
    """Return the watch after readings of motor 1 that are the same, at 100 Hz, after a speed (rad/s)."""
    pace = speed / 100
    stay = EncoderStay(1.0, number, 1.0, pace, pace, 1.0, 0.01, 1.0, 0.0, 0.0)
    return FrozenMemory(stay, EncoderStay(1.0, 1, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0))


def test_an_inconsistent_estimate_waits_while_a_reading_is_repeated(dextar: FiveBar) -> None:
    """A motor that is turned back at once, as by a law that follows a wrong estimate, may read the same again."""
    model, heard = Watch(dextar).model, unheard()
    found = named_fault(model, ESTIMATE_INCONSISTENT, stays(2, 0.4), heard)
    assert (found.trip, found.memory.held) == (NO_FAULT, 1)
    assert named_fault(model, ESTIMATE_INCONSISTENT, stays(FEWEST, 0.4), heard).trip == ENCODER_FROZEN
    # the innovations are small again
    assert named_fault(model, NO_FAULT, stays(1, 0.4)._replace(held=1), heard).trip == ESTIMATE_INCONSISTENT
    # the reading has changed; its motor was slow; it has waited long enough
    for memory in (stays(1, 0.4), stays(2, 0.2), stays(2, 0.4)._replace(held=longest_held(100))):
        assert named_fault(model, ESTIMATE_INCONSISTENT, memory, heard).trip == ESTIMATE_INCONSISTENT


@pytest.mark.parametrize(("torque", "named"), [(None, True), (2.0, True), (8.0, False)])
def test_a_motor_with_strong_drives_may_have_stopped(dextar: FiveBar, torque: float | None, named: bool) -> None:
    model = estimator_model(dextar, (1, -1), Sensing(100, Drives(20000, 1, torque), EkfSettings()))
    assert (named_motor(model, stays(FEWEST, 0.4), inconsistent=True) == 1) is named
    assert named_motor(model, stays(SURE, 0.4), inconsistent=True) == 1


def test_how_hard_a_motor_may_be_braked_follows_from_its_own_leg(dextar: FiveBar) -> None:
    legs = dextar.leg1._replace(inertia=2e-3, coulomb=0.1), dextar.leg2._replace(inertia=4e-3, coulomb=0.3)
    robot = dextar._replace(leg1=legs[0], leg2=legs[1])
    model = estimator_model(robot, (1, -1), Sensing(100, Drives(20000, 1, 8.0), EkfSettings()))
    assert hardest_braking(model, 1, FEWEST) == pytest.approx(8.1 / 2e-3)
    assert hardest_braking(model, 2, FEWEST) == pytest.approx(8.3 / 4e-3)


def test_what_keeps_the_gyroscope_from_being_used_comes_before_what_follows_from_it(dextar: FiveBar) -> None:
    model = estimator_model(dextar, (1, -1), Sensing(100, Drives(20000), EkfSettings(gyro=True)))
    repeated = unheard()
    for rate in (0.1, 0.2, 0.35):
        assert named_fault(model, ESTIMATE_INCONSISTENT, nothing_read(), repeated).trip in (
            NO_FAULT if repeated.same == 2 else ESTIMATE_INCONSISTENT,
        )
        repeated = used(repeated, 0.1, rate)
    assert named_fault(model, ESTIMATE_INCONSISTENT, nothing_read(), repeated).trip == GYROSCOPE_FROZEN
    assert named_fault(model, NO_FAULT, nothing_read(), repeated).trip == NO_FAULT
    for cause, heard in (
        (GYROSCOPE_MISSING, waited(unheard(), 4)),
        (GYROSCOPE_LATE, not_used(waited(unheard(), 4), 0.1, False)),
        (GYROSCOPE_EARLY, not_used(waited(unheard(), 4), 0.1, True)),
    ):
        assert named_fault(model, ESTIMATE_INCONSISTENT, nothing_read(), heard).trip == cause
    assert named_fault(model, ESTIMATE_INCONSISTENT, nothing_read(), waited(unheard(), 2)).trip == ESTIMATE_INCONSISTENT


@pytest.mark.extra
def test_no_crossing_has_a_frozen_encoder(crossing: tuple[Scenario, OfflineRun]) -> None:
    assert crossing[1].faults == []
    for scenario in (
        encoder_scenario("middle", 0.5, plant=OFF_MODEL),
        encoder_scenario("middle", 2.0, plant={"encoder_counts": 262_144}),
        encoder_scenario("middle", 1.0, (100.0, 20.0), rate_hz=50),
    ):
        assert simulate(scenario).faults == []


@pytest.mark.parametrize("motor", [0, 1])
@pytest.mark.parametrize("first", [25, 35, 45, 55, 65, 80])
def test_a_frozen_reading_is_noticed(crossing: tuple[Scenario, OfflineRun], first: int, motor: int) -> None:
    """The reference is on the locus at sample 50, where the motors turn round; they move on both sides of it."""
    scenario, run = crossing
    estimator = StateEstimator(
        scenario.five_bar(), homing_of(scenario), Sensing(scenario.rate_hz, scenario.drives(), scenario.ekf)
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


@pytest.mark.parametrize("motor", [1, 2])
@pytest.mark.parametrize("first", [48, 50])
def test_a_reading_that_freezes_where_its_motor_turns_back_stops_the_robot_later(first: int, motor: int) -> None:
    """Its pace tells nothing there. Either the prediction has gone away in the end, or the robot has left its path."""
    errors = {"frozen_motor": motor, "frozen_from": first / 100}
    (fault,) = simulate(encoder_scenario("middle", 1.0, (400.0, 40.0), {"encoders": errors}, rate_hz=100)).faults
    name, _, words = fault.partition(": at sample ")
    assert name in ("encoder_frozen", "tracking_lost")
    assert first + 9 < int(words.split()[0].rstrip(":")) < first + 40


@pytest.mark.parametrize("coasting", [False, True])
def test_the_commanded_torque_decides(crossing: tuple[Scenario, OfflineRun], coasting: bool) -> None:
    """Two readings that stay from a sample on are of a robot at rest if the guard has taken the torque before."""
    scenario, run = crossing
    estimator = StateEstimator(
        scenario.five_bar(), homing_of(scenario), Sensing(scenario.rate_hz, scenario.drives(), scenario.ekf)
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
    watch, (q11, q21) = Watch(dextar), motors_at(dextar, *along(0))
    readings = [(q11, q21 + 0.001 * number * turning) for number in range(20)]
    answers = [watch.named(one, *along(number), coasts=True) for number, one in enumerate(readings)]
    assert (1 in answers) is turning
