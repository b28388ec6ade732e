"""The stated intervals hold the true values about as often as they say, over robots drawn at random.

Bags come from the compiled loop with the shipped motion, encoders and torque steps in the loop; white noise on the
recorded torques besides, which is what the intervals are for: rounding alone is nearly the same in every run.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_bringup.simulation.case import case_of, sampled
from fivebar_bringup.simulation.engine import traced_crossing
from fivebar_bringup.simulation.outcome import TraceRow
from fivebar_control.identification.equations import Record
from fivebar_control.identification.identification import identify, parameter_values
from fivebar_description.parameters import FiveBar, LegParameters
from fivebar_description.robot_file import load_robot

pytestmark = pytest.mark.extra

Array = NDArray[np.float64]

ROBOTS = 24
TORQUE_NOISE = 0.02
"""Nm."""


class Trials(NamedTuple):
    """[robots, 7] each: errors, and half widths of the intervals, without and with noise on the torques."""

    errors: Array
    half_widths: Array
    noisy_errors: Array
    noisy_half_widths: Array
    true: Array


def drawn(random: np.random.Generator) -> FiveBar:
    robot = load_robot("dextar")

    def leg(one: LegParameters) -> LegParameters:
        inertia, coulomb = random.uniform(0.7, 1.3, 2).tolist()
        offset = float(random.uniform(-0.1, 0.1))
        return one._replace(inertia=one.inertia * inertia, coulomb=one.coulomb * coulomb, offset=offset)

    return FiveBar(leg(robot.leg1), leg(robot.leg2), robot.mass * float(random.uniform(0.7, 1.3)))


@pytest.fixture(scope="module")
def trials() -> Trials:
    scenario = load_scenario("excitation_encoders")
    believed = scenario.five_bar()
    plan = sampled(believed, scenario.plan(), scenario.rate_hz)
    count = 2.0 * math.pi / (scenario.plant.encoder_counts or math.inf)
    columns = [TraceRow._fields.index(name) for name in ("q11", "q21", "applied1", "applied2")]
    random = np.random.default_rng(2024)
    rows: list[tuple[Array, ...]] = []
    for _ in range(ROBOTS):
        actual = drawn(random)
        outcome, trace = traced_crossing(case_of(scenario, actual), plan)
        assert outcome.fault == 0
        angles, torques = trace[:, columns[:2]], trace[:, columns[2:]]
        record = Record(scenario.rate_hz, np.floor(angles / count) * count, torques, np.ones(len(trace)))
        noise = TORQUE_NOISE * random.normal(size=torques.shape)
        quiet, noisy = (identify(believed, record._replace(torques=seen)).fit for seen in (torques, torques + noise))
        true = np.array(parameter_values(actual))
        rows.append((quiet.values - true, quiet.half_widths, noisy.values - true, noisy.half_widths, true))
    return Trials(*(np.array(part) for part in zip(*rows, strict=True)))


def test_no_robot_is_further_off_than_three_percent(trials: Trials) -> None:
    relative = np.abs(trials.errors[:, :5] / trials.true[:, :5])
    assert np.max(relative) < 0.03
    assert np.max(np.abs(trials.errors[:, 5:])) < 0.003
    # what it comes to
    assert np.max(relative) < 0.005


def test_intervals_hold_the_truth_as_often_as_they_say(trials: Trials) -> None:
    """168 intervals: 95 % of them within four of their standard deviations, and none of them vacuous."""
    held = np.abs(trials.noisy_errors) <= trials.noisy_half_widths
    assert 0.88 <= np.mean(held) <= 0.995
    assert np.mean(np.abs(trials.noisy_errors) <= trials.noisy_half_widths / 3.0) < 0.75
    assert np.mean(np.abs(trials.errors) <= trials.half_widths) >= 0.88


def test_intervals_are_as_wide_as_the_errors(trials: Trials) -> None:
    """Their half widths against the errors' own spread, which normally distributed ones have at 1.96 deviations."""
    spread = np.sqrt(np.mean(trials.noisy_errors**2, axis=0))
    assert np.all(trials.noisy_half_widths.mean(axis=0) / spread > 1.4)
    assert np.all(trials.noisy_half_widths.mean(axis=0) / spread < 3.0)
