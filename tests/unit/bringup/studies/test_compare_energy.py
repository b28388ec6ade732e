# SPDX-License-Identifier: Apache-2.0
"""The motors' work against the balance of energy: what is not left in the robot, friction has taken."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import trapezoid

from fivebar_bringup.recorded.series import read_series
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_bringup.simulation.offline import simulate
from fivebar_bringup.simulation.run_in_memory import RunInMemory
from fivebar_control.model.geometry import inverse_geometry
from fivebar_description.parameters import FiveBar, LegParameters
from fivebar_description.robot_file import load_robot
from fivebar_sim.plant import Plant
from fivebar_studies.compare.cases import ComparisonCase
from fivebar_studies.compare.results import motor_work


def test_work_by_hand() -> None:
    angles = np.array([[0.0, 0.0], [0.5, 0.0], [0.25, -1.0]])
    torques = np.array([[9.0, 9.0], [2.0, 1.0], [2.0, 3.0]])
    work = motor_work(angles, torques)
    assert work.spent == pytest.approx(2.0 * 0.5 + 2.0 * 0.25 + 3.0 * 1.0)
    assert work.net == pytest.approx(2.0 * 0.5 - 2.0 * 0.25 - 3.0 * 1.0)


def friction(leg: LegParameters, speed: float) -> float:
    """Power (W) that friction takes from a motor joint."""
    return (leg.coulomb * math.tanh(speed / leg.width) + leg.offset) * speed


def lost(robot: FiveBar, speeds: list[tuple[float, float]], period: float) -> float:
    """Energy (J) that friction takes, by the trapezoidal rule."""
    power = [friction(robot.leg1, one) + friction(robot.leg2, two) for one, two in speeds]
    return float(trapezoid(power, dx=period))


def test_work_is_kinetic_energy_and_friction() -> None:
    """Torques that swing the robot without plan; it is left moving."""
    robot, rate_hz = load_robot("dextar"), 2000
    plant = Plant(robot, inverse_geometry(robot, (1, -1), 0.0, 0.13), rate_hz)
    angles, speeds, torques = [], [], [(0.0, 0.0)]
    for number in range(281):
        q, v = plant.joints, plant.joint_velocities
        angles.append((float(q[0]), float(q[2])))
        speeds.append((float(v[0]), float(v[2])))
        if number < 280:
            t = number / rate_hz
            torques.append((0.9 * math.cos(20.0 * t), 0.8 * math.cos(20.0 * t) + 0.1 * math.sin(15.0 * t)))
            plant.advance(torques[-1])
    work = motor_work(np.array(angles), np.array(torques))
    kinetic, taken = plant.kinetic_energy(), lost(robot, speeds, 1.0 / rate_hz)
    assert kinetic > 0.005 and taken > 0.05
    assert work.net == pytest.approx(kinetic + taken, rel=1e-4)
    assert work.spent > work.net


def test_a_crossing_that_ends_at_rest_gives_all_to_friction() -> None:
    scenario = ComparisonCase(load_scenario("middle"), "unified", 0.5, "realistic").scenario()
    series = read_series(RunInMemory(simulate(scenario), scenario), scenario)
    work = motor_work(series.joint_position[:, [0, 2]], series.torque_applied)
    robot = load_robot("dextar")
    # friction x 0.8
    speeds = [(one, two) for one, two in series.joint_velocity[:, [0, 2]].tolist()]
    taken = 0.8 * lost(robot, speeds, 1.0 / scenario.rate_hz)
    assert work.net == pytest.approx(taken, rel=2e-3)
    assert work.spent > 1.05 * work.net
