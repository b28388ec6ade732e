# SPDX-License-Identifier: Apache-2.0
"""The start: a declared posture that is possible and that the encoders confirm, or none."""

from __future__ import annotations

import math
from contextlib import nullcontext

import pytest
from scipy.optimize import brentq

from fivebar_control.estimation.ekf import NO_ERRORS, Estimate, FilterModel, advanced, filter_model
from fivebar_control.estimation.estimator import StateEstimator
from fivebar_control.estimation.homing import MIN_HOMING_KAPPA, Homing, HomingContradicted, homing_at
from fivebar_control.estimation.readings import LONGEST_GAP
from fivebar_control.estimation.settings import Drives, EkfSettings, Sensing
from fivebar_control.model.geometry import inverse_geometry
from fivebar_control.model.kinematics import state_from_platform
from fivebar_control.model.singularity import inverse_condition
from fivebar_description.parameters import FiveBar
from fivebar_description.robot_file import load_robot
from fivebar_description.strict_yaml import InputError

RATE_HZ = 500
HOME = homing_at(load_robot(), (1, -1), 0.0, 0.15)


def estimator(
    robot: FiveBar,
    homing: Homing = HOME,
    drives: Drives | None = None,
    misfit_limit: float = EkfSettings().misfit_limit,
) -> StateEstimator:
    settings = EkfSettings(misfit_limit=misfit_limit)
    return StateEstimator(robot, homing, Sensing(RATE_HZ, drives if drives is not None else Drives(), settings))


def believed(robot: FiveBar) -> FilterModel:
    """Return the model that the estimators of these tests predict with."""
    return filter_model(robot, HOME.mode, RATE_HZ, EkfSettings())


def test_home_is_in_the_assembly_mode_of_its_place(dextar: FiveBar) -> None:
    assert HOME.assembly == 1
    assert homing_at(dextar, (1, -1), 0.0, 0.02).assembly == -1


@pytest.mark.parametrize(
    ("homing", "what"),
    [
        (HOME._replace(assembly=-1), "the assembly mode is 1, declared is -1"),
        (HOME._replace(y=0.3), "is out of reach"),
        (HOME._replace(x=math.nan), "is out of reach"),
        (HOME._replace(y=0.0845), "the assembly mode is ambiguous"),
        (HOME._replace(y=0.02), "the assembly mode is -1, declared is 1"),
    ],
)
def test_a_posture_that_contradicts_itself_is_refused(dextar: FiveBar, homing: Homing, what: str) -> None:
    with pytest.raises(InputError, match=r"^homing_contradicted: ") as refused:
        estimator(dextar, homing)
    assert what in str(refused.value)


@pytest.mark.parametrize("motor", [0, 1])
@pytest.mark.parametrize("off", [0.021, -0.3, 1.5])
def test_encoders_that_contradict_the_posture_are_believed(dextar: FiveBar, motor: int, off: float) -> None:
    q = inverse_geometry(dextar, (1, -1), 0.0, 0.15)
    angles = [q.q11, q.q21]
    angles[motor] += off
    with pytest.raises(HomingContradicted, match=rf"^homing_contradicted: {('q11', 'q21')[motor]} reads"):
        estimator(dextar).take(0, angles[0], angles[1], 0.0, 0.0)


@pytest.mark.parametrize(("part", "refused"), [(0.999, True), (1.001, False)])
def test_a_posture_is_taken_from_the_least_kappa_on(dextar: FiveBar, part: float, refused: bool) -> None:
    def kappa(y: float) -> float:
        return inverse_condition(state_from_platform(dextar, (1, -1), 0.0, y, 0.0, 0.0))

    y = brentq(lambda y: kappa(y) - part * MIN_HOMING_KAPPA, 0.085, 0.13)
    with pytest.raises(HomingContradicted, match="is ambiguous") if refused else nullcontext():
        estimator(dextar, homing_at(dextar, (1, -1), 0.0, y))


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("motor", [0, 1])
def test_a_robot_within_the_tolerance_is_not_refused_for_what_its_encoder_rounds(
    dextar: FiveBar, motor: int, side: float
) -> None:
    """Wherever the count's edges are: 100 counts per revolution, three times the tolerance. Two of them are too far."""
    counts, drives = 100, Drives(encoder_counts=100)
    count = 2.0 * math.pi / counts
    tolerance = EkfSettings().homing_tolerance
    q = inverse_geometry(dextar, (1, -1), 0.0, 0.15)
    declared = (q.q11, q.q21)
    for part in range(20):
        # a homing posture that is anywhere within a count, declared exactly
        shift = part / 20 * count
        readings = [math.floor((angle + shift) / count) * count - shift for angle in declared]
        readings[motor] = math.floor((declared[motor] + side * tolerance + shift) / count) * count - shift
        assert estimator(dextar, drives=drives).take(0, *readings, 0.0, 0.0).effort == (0.0, 0.0, 0.0, 0.0)
        readings[motor] += side * 2.0 * count
        with pytest.raises(HomingContradicted, match=("q11", "q21")[motor]):
            estimator(dextar, drives=drives).take(0, *readings, 0.0, 0.0)


@pytest.mark.parametrize("turns", [0, 1, -3])
def test_a_posture_near_the_declared_one_is_taken_from_the_encoders(dextar: FiveBar, turns: int) -> None:
    q = inverse_geometry(dextar, (1, -1), 0.001, 0.1495)
    whole = 2.0 * math.pi * turns
    started = estimator(dextar)
    answer = started.take(0, q.q11 + whole, q.q21 - whole, 0.0, 0.0)
    assert started.belief is not None
    assert started.belief.estimate[:2] == pytest.approx((0.001, 0.1495), abs=1e-12)
    assert started.belief.estimate[2:] == (*(0.0,) * 9, NO_ERRORS)
    assert answer.position == pytest.approx(tuple(q), abs=1e-9)
    assert answer.velocity == pytest.approx((0.0,) * 4, abs=1e-12)
    assert started.fault is None


def test_an_answer_is_predicted_with_the_torques_on_their_way(dextar: FiveBar) -> None:
    """With two samples of delay, sample k is answered with the state at k + 2 under the commands of k - 2 and k - 1."""
    q = inverse_geometry(dextar, (1, -1), 0.0, 0.15)
    late = estimator(dextar, drives=Drives(delay_samples=2, torque_limit=1.0))
    late.take(0, q.q11, q.q21, 0.0, 0.0)
    assert not late.awaits(0)
    assert late.awaits(1)
    late.commanded(0, 0.9, -0.9)
    # of two commands for one sample the first counts
    late.commanded(0, 0.0, 0.0)
    assert not late.awaits(1)
    late.take(1, q.q11, q.q21, 0.0, 0.0)
    late.commanded(1, 3.0, -3.0)
    answer = late.take(2, q.q11, q.q21, 0.0, 0.0)
    belief = late.belief
    assert belief is not None
    model = believed(dextar)
    expected = advanced(model, advanced(model, belief.estimate, 0.9, -0.9), 1.0, -1.0)
    found = inverse_geometry(dextar, (1, -1), expected.x, expected.y)
    assert answer.position == pytest.approx(tuple(found), abs=1e-12)
    assert math.hypot(expected.x - belief.estimate.x, expected.y - belief.estimate.y) > 1e-6


def test_a_missing_command_is_taken_for_the_one_before_it(dextar: FiveBar) -> None:
    q = inverse_geometry(dextar, (1, -1), 0.0, 0.15)
    told, untold = (estimator(dextar, drives=Drives(delay_samples=1)) for _ in range(2))
    answers = []
    for one in (told, untold):
        one.take(0, q.q11, q.q21, 0.0, 0.0)
        one.commanded(0, 0.6, -0.6)
        one.take(1, q.q11, q.q21, 0.0, 0.0)
        if one is told:
            one.commanded(1, 0.6, -0.6)
        answers.append(one.take(2, q.q11, q.q21, 0.6, -0.6))
    assert answers[0] == answers[1]


def test_a_reading_that_is_left_out_costs_no_time(dextar: FiveBar) -> None:
    """Motor readings of a platform at constant torque, some of them missing: the estimate is where the platform is."""
    started = estimator(dextar)
    model, truth = believed(dextar), Estimate(0.0, 0.15, 0.0, 0.0, 0.0, 0.0)
    for sample in range(60):
        q = inverse_geometry(dextar, (1, -1), truth.x, truth.y)
        if sample % 7 not in (3, 4, 5):
            started.take(sample, q.q11, q.q21, 0.7, -0.6)
            assert started.belief is not None
            assert started.belief.estimate[:4] == pytest.approx(truth[:4], abs=1e-4)
        truth = advanced(model, truth, 0.7, -0.6)
    assert truth.vy < -0.1
    assert started.fault is None


@pytest.mark.parametrize("left_out", [False, True])
def test_over_a_gap_an_encoder_that_reads_the_same_is_not_taken_for_a_frozen_one(
    dextar: FiveBar, left_out: bool
) -> None:
    """Where readings are missing the prediction is a guess. Without gaps the same readings are a fault."""
    started = estimator(dextar)
    model, truth = believed(dextar), Estimate(0.0, 0.15, 0.0, 0.0, 0.0, 0.0)
    stays = math.nan
    for sample in range(50):
        q = inverse_geometry(dextar, (1, -1), truth.x, truth.y)
        if sample <= 30:
            stays = q.q11
        if sample <= 30 or sample % 2 == 0 or not left_out:
            started.take(sample, stays, q.q21, 0.7, -0.6)
        truth = advanced(model, truth, 0.7, -0.6)
    frozen = started.fault is not None and started.fault.name == "encoder_frozen"
    assert frozen != left_out


def test_after_a_long_gap_the_estimate_is_lost(dextar: FiveBar) -> None:
    q = inverse_geometry(dextar, (1, -1), 0.0, 0.15)
    started = estimator(dextar)
    started.take(0, q.q11, q.q21, 0.0, 0.0)
    started.take(LONGEST_GAP, q.q11, q.q21, 0.0, 0.0)
    assert started.fault is None
    started.take(1_000_000, q.q11, q.q21, 0.0, 0.0)
    assert str(started.fault) == f"estimate_lost: no motor readings from sample {LONGEST_GAP + 1} to 999999"


def test_the_first_fault_is_kept(dextar: FiveBar) -> None:
    """What follows from a loss is not its cause."""
    q = inverse_geometry(dextar, (1, -1), 0.0, 0.15)
    started = estimator(dextar)
    started.take(0, q.q11, q.q21, 0.0, 0.0)
    for sample in (30, 60):
        started.take(sample, q.q11, q.q21, 0.0, 0.0)
        assert str(started.fault) == "estimate_lost: no motor readings from sample 1 to 29"


@pytest.mark.parametrize("watched", [True, False])
def test_an_estimate_that_leaves_the_reach_is_lost_and_the_last_one_stays(dextar: FiveBar, watched: bool) -> None:
    """What drives it away contradicts the model, which is the fault that is seen first where it is watched for."""
    q = inverse_geometry(dextar, (1, -1), 0.0, 0.15)
    started = estimator(dextar) if watched else estimator(dextar, misfit_limit=1e9)
    answer = started.take(0, q.q11, q.q21, 0.0, 0.0)
    for sample in range(1, 400):
        answer = started.take(sample, q.q11 - 0.02 * sample, q.q21 + 0.02 * sample, -10.0, 10.0)
        assert all(map(math.isfinite, (*answer.position, *answer.velocity)))
        if started.fault is not None:
            break
    assert started.fault is not None
    if watched:
        assert started.fault.name == "estimate_inconsistent"
        assert started.fault.detail.startswith("at sample 1 the motor encoders differ from the predictions by ")
    else:
        assert started.fault.name in ("estimate_lost", "estimate_ambiguous")
