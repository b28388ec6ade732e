# SPDX-License-Identifier: Apache-2.0
"""Crossings of MuJoCo's robot against those of the plant that this project has otherwise."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from engine_agreement import changed
from typer.testing import CliRunner

from fivebar_bringup.cli.main import app
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.case import case_of
from fivebar_bringup.simulation.offline import simulate
from fivebar_control.model.kinematics import state_from_joints
from fivebar_description.settings import sections
from fivebar_description.strict_yaml import InputError
from fivebar_sim.effects.settings import MUJOCO, PINOCCHIO, PlantSettings
from fivebar_studies.compare.cases import AS_GIVEN, COMPARED_RIGS, on_rig

EFFECTS: dict[str, dict[str, Any]] = {
    "links": {"l_11": 2e-5, "l_12": -1e-5, "l_21": -1e-5, "l_22": 2e-5, "base_2": 1e-5, "distal_inertia": -7e-5}
    | {"distal_mass": 0.02, "base_rise": 1e-5, "base_height": 1e-3},
    "friction": {"stribeck": 1.3, "viscous": 0.02, "passive": 0.005},
    "heating": {"change": -0.6, "work": 0.3},
    "supply": {"half_power": 100.0},
    "motors": {"constant_1": 0.05, "constant_2": -0.05, "ripple": 0.05, "cogging": 0.05, "current_loop_hz": 300.0},
    "transmission": {"frequency": 80.0},
    "platform_joint": {"stiffness": 3e5},
    "encoders": {"zero_1": 5e-5, "zero_2": -5e-5, "eccentricity": 2e-4},
    "tilt": {"angle": 0.03, "heading": 1.0, "leg_moment": 0.03},
    "vibration": {"amplitude": 5e-5},
    "cable": {"force": 0.2, "stiffness": 5.0, "length": 0.2},
    "push": {"force": 0.7, "heading": 0.7, "along": "locus", "start": 0.2, "length": 0.05},
    "bus": {"lost_commands": 40, "lost_within": 0.4},
    "timing": {"command_delay": 5e-4, "command_jitter": 1e-3, "reading_age": 3e-4, "reading_jitter": 3e-4},
}


class Crossing(NamedTuple):
    """Platform (m) and commanded torques (Nm) of each sample, both [samples, 2], and the IMU's readings."""

    path: Any
    torque: Any
    imu: Any


def crossing(scenario: Scenario) -> Crossing:
    run, robot = simulate(scenario), scenario.actual_robot()
    assert run.faults == []
    states = [state_from_joints(robot, *sample.exact.position, *sample.exact.velocity) for sample in run.samples]
    readings = [sample.imu[0].reading for sample in run.samples]
    return Crossing(
        np.array([(state.x, state.y) for state in states]),
        np.array([sample.command for sample in run.samples]),
        np.array([(*one.acceleration, *one.angular_velocity) for one in readings]),
    )


def apart(one: Any, other: Any) -> float:
    return float(np.abs(one - other).max())


def short(engine: str, effects: dict[str, Any]) -> Scenario:
    """One segment, through the locus."""
    common: dict[str, Any] = {"controller": "unified", "segment_duration": 0.4, "waypoints": [[0.0, 0.15], [0.0, 0.02]]}
    return changed("middle", {"engine": engine, **effects, "seed": 5}, **common)


@cache
def ideal() -> Crossing:
    return crossing(short(PINOCCHIO, {}))


@pytest.mark.extra
def test_the_middle_crossing_is_that_of_pinocchio() -> None:
    ours, other = (crossing(changed("middle", {"engine": engine})) for engine in (PINOCCHIO, MUJOCO))
    assert 0.0 < apart(ours.path, other.path) < 1.3e-6
    assert apart(ours.torque, other.torque) < 1e-3
    assert apart(ours.imu, other.imu) < 0.05


@pytest.mark.parametrize("name", ["motkin_middle", "motkin_vertical"])
def test_residual_inertias_and_weight_of_links_are_those_of_pinocchio(name: str) -> None:
    exact = {"encoder_counts": None, "delay_samples": 0}
    bench: dict[str, Any] = {"estimator": "none", "segment_duration": 0.3, "waypoints": [[0.0, 0.12], [0.0, 0.0]]}
    ours, other = (crossing(changed(name, {"engine": engine, **exact}, **bench)) for engine in (PINOCCHIO, MUJOCO))
    assert 0.0 < apart(ours.path, other.path) < 5e-6
    assert apart(ours.torque, other.torque) < 5e-4


def test_a_path_across_the_uncontrollable_direction_is_crossed_there_too() -> None:
    """Its normal is t_s there, by which the blended laws cannot hold it; the robot is 3 % heavier than believed."""
    motion: dict[str, Any] = {
        "controller": "unified",
        "working_mode": (-1, 1),
        "waypoints": [[0.0153, 0.0703], [0.0006, -0.0286]],
        "segment_duration": 0.6,
    }
    scenario = changed("middle", {"engine": MUJOCO, "mass_scale": 1.03}, **motion)
    (met,) = scenario.plan().crossings
    assert met.authority < 0.06
    run = crossing(scenario)
    planned = [scenario.plan().path.at(number / scenario.rate_hz)[:2] for number in range(len(run.path))]
    assert 1e-6 < apart(run.path, np.array(planned)) < 5e-4


def test_every_effect_is_here() -> None:
    """But the gyroscope's faults, which move no robot."""
    assert EFFECTS.keys() | {"gyroscope"} == sections(PlantSettings).keys()


@pytest.mark.extra
@pytest.mark.parametrize("effect", EFFECTS)
def test_each_effect_has_the_size_that_it_has_there(effect: str) -> None:
    ours, other = (crossing(short(engine, {effect: EFFECTS[effect]})) for engine in (PINOCCHIO, MUJOCO))
    size, torque = apart(ours.path, ideal().path), apart(ours.torque, ideal().torque)
    assert size > 5e-6
    assert apart(ours.path, other.path) < 0.05 * size
    assert apart(ours.torque, other.torque) < 0.05 * torque


def test_the_compiled_engine_refuses_it() -> None:
    with pytest.raises(InputError, match=r"middle: plant\.engine: mujoco cannot be compiled: expected pinocchio here"):
        case_of(changed("middle", {"engine": MUJOCO}))


def test_a_comparison_keeps_it_on_every_rig() -> None:
    scenario = changed("middle", {"engine": MUJOCO})
    assert {on_rig(scenario, name, "unified")["plant"]["engine"] for name in (*COMPARED_RIGS, AS_GIVEN)} == {MUJOCO}


def test_a_scenario_with_what_it_lacks_is_refused_in_one_line(tmp_path: Path) -> None:
    file = tmp_path / "mine.yaml"
    file.write_text(short(MUJOCO, {"friction": {"presliding": 1e-3}}).to_yaml(), encoding="utf-8")
    done = CliRunner().invoke(app, ["simulate", str(file), "--out", str(tmp_path / "out")])
    assert done.exit_code == 2
    assert "plant.friction.presliding: 0.001: MuJoCo's robot does not have this: expected 0.0" in done.stderr
    assert not (tmp_path / "out").exists()
