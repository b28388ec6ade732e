# SPDX-License-Identifier: Apache-2.0
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

from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_bringup.simulation.case import case_of
from fivebar_bringup.simulation.engine import traced_crossing
from fivebar_bringup.simulation.engine_table import TraceRow
from fivebar_control.identification.equations import Record
from fivebar_control.identification.identification import identify, parameter_values
from fivebar_control.loop.sampled_plan import sampled
from fivebar_description.parameters import FiveBar, LegParameters
from fivebar_description.robot_file import load_robot
from fivebar_description.strict_yaml import validate

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
        rows.append(
            (quiet.values[:7] - true, quiet.half_widths[:7], noisy.values[:7] - true, noisy.half_widths[:7], true)
        )
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


UNMODELLED = 60
"""Robots with what the model of the controllers lacks."""


def unmodelled(number: int) -> Scenario:
    """Elastic transmissions, torque constants off by 5 %, viscous friction, friction in the passive joints."""
    random = np.random.default_rng((7, number))
    constants, frequency = (
        random.uniform(-0.05, 0.05, 2).tolist(),
        math.exp(random.uniform(math.log(60), math.log(250))),
    )
    share, passive, *scales = random.uniform((0.3, 0.0, 0.8, 0.8, 0.8), (0.85, 0.006, 1.2, 1.2, 1.2)).tolist()
    plant = {
        **dict(zip(("mass_scale", "inertia_scale", "friction_scale"), scales, strict=True)),
        "seed": number,
        "friction": {"viscous": 0.01, "passive": passive},
        "motors": {"constant_1": constants[0], "constant_2": constants[1]},
        "transmission": {"frequency": frequency, "damping": 0.04, "rotor_share": share},
    }
    # by the rule for elastic transmissions, from an estimate
    width = min(40.0, 2.0 * math.pi * frequency / 12.0)
    control = {"gains": {"kp": width**2, "kd": 2.0 * width}, "tracking_error_limit": 0.3, "estimator": "ekf"}
    content = load_scenario("excitation_encoders").model_dump()
    content |= {**control, "ekf": {"disturbance_rate": 0.1}, "plant": {**content["plant"], **plant}}
    return validate(content, Scenario, "unmodelled")


def test_intervals_hold_the_truth_of_robots_that_are_more_than_the_model() -> None:
    """In units of the command."""
    believed = load_robot("dextar")
    held, errors = [], []
    for number in range(UNMODELLED):
        scenario = unmodelled(number)
        plan = sampled(believed, scenario.plan(), scenario.rate_hz, scenario.lead_samples)
        outcome, trace = traced_crossing(case_of(scenario), plan)
        assert outcome.fault == 0
        columns = [TraceRow._fields.index(name) for name in ("q11", "q21", "applied1", "applied2")]
        count = 2.0 * math.pi / 20_000
        angles, torques = trace[:, columns[:2]], trace[:, columns[2:]]
        found = identify(
            believed, Record(scenario.rate_hz, np.floor(angles / count) * count, torques, np.ones(len(trace)))
        )
        plant, actual = scenario.plant, scenario.actual_robot()
        one, two = 1.0 + plant.motors.constant_1, 1.0 + plant.motors.constant_2
        zz_1, zz_2, mass, f_s1, f_s2, off_1, off_2 = parameter_values(actual)
        mean = 0.5 * (1.0 / one + 1.0 / two)
        friction = f_s1 / one, f_s2 / two, off_1 / one, off_2 / two
        viscous = plant.friction.viscous / one, plant.friction.viscous / two
        true = np.array([zz_1 / one, zz_2 / two, mass * mean, *friction, *viscous, plant.friction.passive * mean])
        error = np.abs(found.fit.values[:10] - true)
        held.append(error <= found.fit.half_widths[:10])
        errors.append(error[:5] / true[:5])
    print("held, each parameter", np.mean(held, axis=0), "all", np.mean(held), "largest error", np.max(errors, axis=0))
    assert 0.9 <= np.mean(held) <= 0.99
    assert np.min(np.mean(held, axis=0)) >= 0.85
    assert np.max(errors) < 0.005
