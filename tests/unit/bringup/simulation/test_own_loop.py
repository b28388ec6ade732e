# SPDX-License-Identifier: Apache-2.0
"""A loop of one's own over controller and plant gives the torques of `fivebar simulate`, to the last bit."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fivebar
from fivebar_bringup.bag.reader import read_bag
from fivebar_bringup.runs.offline import run_offline
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_description.interface import TORQUE_COMMAND
from fivebar_description.scenario_file import shipped_scenarios

QUICK = ("middle_robot", "multi_model_criterion")
"""Those that take less than a second: motors' encoders with a delay, and all joints."""

COMPILED = ("unified_middle", "middle", "gyro_middle", "type1_working_mode")
"""One of each kind: a single law, two laws, an estimator with late readings, and a plan in the motors' angles."""


def stepped(name: str) -> list[tuple[float, float]]:
    """The torques of the loop that a user writes, up to where the robot can be moved no further."""
    control, plant = fivebar.Controller(name), fivebar.Plant(name)
    readings, torques = plant.reset(), []
    while not control.finished:
        command = control.step(readings)
        torques.append(tuple(command.torque))
        try:
            readings = plant.step(command.torque)
        except fivebar.PlantDiverged:
            break
    return torques


def marked(name: str) -> Any:
    return pytest.param(name, marks=[] if name in QUICK else [pytest.mark.extra])


@pytest.mark.parametrize("name", [marked(name) for name in shipped_scenarios()])
def test_the_loop_has_the_torques_of_the_bag(name: str, tmp_path: Path) -> None:
    run, _ = run_offline(load_scenario(name), tmp_path / "run", lambda done, total: None, with_page=False)
    # the last message is the zero torque of a blender that is stopped
    recorded = read_bag(run.bag).field(TORQUE_COMMAND, "effort")[:-1]
    torques = np.array(stepped(name))
    assert torques.shape == recorded.shape and torques.tobytes() == recorded.tobytes()


def test_a_plant_that_is_reset_repeats_its_readings_and_another_seed_gives_others() -> None:
    plant = fivebar.Plant("gyro_middle")
    first = [plant.reset(), *(plant.step((0.1, -0.1)) for _ in range(20))]
    assert [plant.reset(), *(plant.step((0.1, -0.1)) for _ in range(20))] == first
    other = fivebar.Plant("gyro_middle", seed=load_scenario("gyro_middle").plant.seed + 1)
    assert [other.reset(), *(other.step((0.1, -0.1)) for _ in range(20))] != first


def test_mujoco_moves_the_same_robot_by_nearly_the_same_way() -> None:
    pytest.importorskip("mujoco")
    plants = fivebar.Plant("unified_middle"), fivebar.Plant("unified_middle", engine="mujoco")
    ends = []
    for plant in plants:
        plant.reset()
        for _ in range(50):
            plant.step((0.3, 0.1))
        ends.append(plant.truth.position)
    assert ends[0] != ends[1] and ends[1] == pytest.approx(ends[0], abs=1e-5)
    assert abs(ends[0][0] - plants[0].reset().joint_angles[0]) > 1e-3


def numbers_of(value: Any) -> Any:
    """An answer with its numbers to the last bit, whatever their types."""
    if isinstance(value, tuple):
        return [numbers_of(one) for one in value]
    return float(value).hex() if isinstance(value, float) else value


@pytest.mark.extra
@pytest.mark.parametrize("name", COMPILED)
def test_machine_code_answers_as_plain_python_does_to_the_last_bit(name: str) -> None:
    """Also lost samples, a fault of the guard, its clearing, and a further motion."""
    plain, fast, plant = fivebar.Controller(name), fivebar.Controller(name, compiled=True), fivebar.Plant(name)
    readings = plant.reset()
    while not plain.finished:
        answers = [control.step(readings) for control in (plain, fast)]
        assert numbers_of(answers[0]) == numbers_of(answers[1])
        readings = plant.step(answers[0].torque)
    if name != "unified_middle":
        return
    for control in (plain, fast):
        control.goto((0.02, 0.12))
    number = 0
    while not plain.finished:
        number += 1
        lost = 10 <= number < 14
        answers = [control.step(None if lost else readings) for control in (plain, fast)]
        assert numbers_of(answers[0]) == numbers_of(answers[1])
        readings = plant.step(answers[0].torque)
    turning = readings._replace(joint_velocities=(60.0, 0.0, 0.0, 0.0), time=None)
    for given in (turning, turning._replace(joint_velocities=(0.0,) * 4)):
        answers = [control.step(given) for control in (plain, fast)]
        assert numbers_of(answers[0]) == numbers_of(answers[1]) and str(plain.fault).startswith("over_speed")
    for control in (plain, fast):
        control.clear()
    still = readings._replace(joint_velocities=(0.0,) * 4, time=None)
    answers = [control.step(still) for control in (plain, fast)]
    assert numbers_of(answers[0]) == numbers_of(answers[1]) and answers[0].fault is None


@pytest.mark.extra
def test_the_filter_as_machine_code_puts_a_fault_into_the_same_words() -> None:
    """An encoder that reads what it read at the start."""
    controls = [fivebar.Controller("gyro_middle", compiled=one) for one in (False, True)]
    plant = fivebar.Plant("gyro_middle")
    readings = plant.reset()
    assert readings.motor_angles is not None
    first = readings.motor_angles[0]
    while controls[0].fault is None:
        assert readings.motor_angles is not None
        stuck = readings._replace(motor_angles=(first, readings.motor_angles[1]))
        answers = [control.step(stuck) for control in controls]
        assert numbers_of(answers[0]) == numbers_of(answers[1])
        readings = plant.step(answers[0].torque)
    assert "at sample" in str(controls[0].fault) and str(controls[0].fault) == str(controls[1].fault)


def test_a_law_that_numba_does_not_compile_is_refused() -> None:
    with pytest.raises(fivebar.InputError, match=r"compiled: controller mpc cannot be compiled: expected False"):
        fivebar.Controller("mpc_middle", compiled=True)
