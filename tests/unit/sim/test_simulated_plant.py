# SPDX-License-Identifier: Apache-2.0
"""The simulated robot with its sensors, stepped by its user."""

from __future__ import annotations

import math

import pytest

from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_bringup.simulation.offline import plant_parts
from fivebar_sim.simulated_plant import SimulatedPlant


def plant(name: str) -> SimulatedPlant:
    return SimulatedPlant(*plant_parts(load_scenario(name)))


def test_a_step_needs_a_reset_and_a_torque_that_is_a_number() -> None:
    made = plant("gyro_middle")
    with pytest.raises(ValueError, match="expected reset before"):
        made.step((0.0, 0.0))
    made.reset()
    with pytest.raises(ValueError, match="not a number"):
        made.step((math.nan, 0.0))


def test_readings_are_those_of_the_scenarios_sensors() -> None:
    """All joints where nothing estimates; else the motors' angles, and late readings with the time they were made."""
    readings = plant("middle").reset()
    assert readings.joint_angles is not None and readings.joint_velocities == (0.0,) * 4
    scenario = load_scenario("gyro_middle")
    robot = SimulatedPlant(*plant_parts(scenario))
    latency = scenario.imu.schedule(scenario.rate_hz).latency
    made = [robot.reset(), *(robot.step((0.0, 0.0)) for _ in range(50))]
    assert {one.joint_angles for one in made} == {None}
    assert [one.time for one in made] == [number / scenario.rate_hz for number in range(51)]
    late = [(round((one.time or 0.0) * scenario.rate_hz), turn.time) for one in made for turn in one.imu]
    assert len(late) > 10
    assert {number - round(time * scenario.rate_hz) for number, time in late} == {latency}
