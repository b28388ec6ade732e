# SPDX-License-Identifier: Apache-2.0
"""Samples and commands that a bus loses or delays contradict no model; an encoder that has slipped does."""

from __future__ import annotations

from typing import NamedTuple

import pytest

from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_bringup.simulation.offline import simulate
from fivebar_control.estimation.compiled_estimator import CompiledEstimator
from fivebar_control.estimation.estimator import StateEstimator
from fivebar_control.estimation.settings import Sensing
from fivebar_control.scenario.sensors import homing_of

EVERY = 8
"""Samples from one that is missing to the next."""


class Reading(NamedTuple):
    """Motor angles (rad), torques (Nm) that acted before, and the command (Nm) that answers."""

    angles: tuple[float, float]
    torques: tuple[float, float]
    command: tuple[float, float]


@pytest.fixture(scope="module")
def crossing() -> tuple[Scenario, list[Reading]]:
    """The rehearsal's crossing and return, with 10 commands that never reach the drives."""
    content = load_scenario("middle_robot").model_dump(mode="json")
    content["plant"]["bus"] |= {"lost_commands": 10, "lost_within": 2.0}
    scenario = Scenario.model_validate(content)
    readings = []
    for sample in simulate(scenario).samples:
        assert sample.estimated is not None
        readings.append(Reading(*sample.estimated.motors, tuple(sample.command)))
    return scenario, readings


def fault_of(scenario: Scenario, readings: dict[int, Reading]) -> tuple[int, str]:
    """Return the sample and the name of the estimator's first fault, (-1, "") for none."""
    estimator = StateEstimator(
        scenario.five_bar(), homing_of(scenario), Sensing(scenario.rate_hz, scenario.drives(), scenario.ekf)
    )
    for number, (angles, torques, command) in readings.items():
        estimator.take(number, *angles, *torques)
        estimator.commanded(number, *command)
        if estimator.fault is not None:
            return number, estimator.fault.name
    return -1, ""


def with_missing(complete: list[Reading], phase: int, late: bool) -> dict[int, Reading]:
    """Leave out every eighth sample; where it is late, its reading is taken for that of the sample after it."""
    readings = dict(enumerate(complete))
    for missing in range(EVERY + phase, len(complete) - 1, EVERY):
        lost = readings.pop(missing)
        if late:
            readings[missing + 1] = lost._replace(command=complete[missing + 1].command)
    return readings


@pytest.mark.parametrize(("phase", "late"), [(0, False), (0, True), (3, True), (6, True)])
def test_missing_samples_are_no_contradiction(crossing: tuple[Scenario, list[Reading]], phase: int, late: bool) -> None:
    scenario, complete = crossing
    assert fault_of(scenario, with_missing(complete, phase, late)) == (-1, "")


@pytest.mark.parametrize("slips", [37, 77, 133])
def test_a_slipped_encoder_is_a_contradiction(crossing: tuple[Scenario, list[Reading]], slips: int) -> None:
    """By 0.01 rad, on the same bus."""
    scenario, complete = crossing
    readings = with_missing(complete, 0, late=True)
    for number in readings:
        if number >= slips:
            q11, q21 = readings[number].angles
            readings[number] = readings[number]._replace(angles=(q11 + 0.01, q21))
    number, name = fault_of(scenario, readings)
    assert name == "estimate_inconsistent"
    assert slips <= number <= slips + 3


@pytest.mark.extra
def test_machine_code_estimates_the_same(crossing: tuple[Scenario, list[Reading]]) -> None:
    """Over gaps as well, to the last bit."""
    scenario, complete = crossing
    instruments = Sensing(scenario.rate_hz, scenario.drives(), scenario.ekf)
    readings = with_missing(complete[:60], 0, False)
    told = []
    for kind in (StateEstimator, CompiledEstimator):
        estimator = kind(scenario.five_bar(), homing_of(scenario), instruments)
        estimator.warm_up()
        told.append([estimator.take(number, *one.angles, *one.torques) for number, one in readings.items()])
    assert told[0] == told[1]
