# SPDX-License-Identifier: Apache-2.0
"""Files of a run under ros2_control: names of its own, and what the scenario decides of the gains."""

from __future__ import annotations

from pathlib import Path

import pytest
from engine_agreement import changed

from fivebar_bringup.drives.choice import write_drive_files
from fivebar_bringup.drives.ros2_control_files import least_parts
from fivebar_bringup.runs.admission import refuse_unfit
from fivebar_control.hardware.controlled_joints import JointsLink, load_joints
from fivebar_control.hardware.inner_loop import OPEN, MotorSetPoint
from fivebar_control.hardware.motors_file import MotorsFile
from fivebar_control.trajectory.planner import PlanRefused
from fivebar_description.strict_yaml import InputError, load_yaml, validate


def link_of(**keys: object) -> JointsLink:
    return validate({"joints": ["right", "left"], **keys}, JointsLink, "link")


def test_the_bench_s_own_stack_is_rehearsed_with_its_five_values(tmp_path: Path) -> None:
    scenario = changed("motkin_middle", {})
    files = write_drive_files(scenario, tmp_path, "motkin_ros2_control")
    file, link = load_joints(str(files.drives))
    assert (link.takes, link.unit, link.joints) == ("gains", "A", ("motor_1", "motor_2"))
    assert link.commands == f"{link.controller}/commands"
    assert link.controller != "/motkin_forward_command_controller"
    assert (link.inner_loop.robot, link.inner_loop.on) == ("motkin", False)
    assert link.inner_loop.epsilon == max(0.05, *(crossing.epsilon for crossing in scenario.plan().crossings))
    assert file.motors.q11.shaft_torque_limit == pytest.approx(3.0 * 0.062)
    emulated = load_yaml(files.emulation)
    assert isinstance(emulated, dict)
    assert emulated["least_parts"] == 1
    # the boards' loop is quicker than the run
    assert least_parts({"takes": "gains", "inner_loop": {"stiffness": 1.0}}) == 8


def test_a_command_has_all_values_of_all_joints_in_the_controller_s_order() -> None:
    motor = {"counts_per_revolution": 1000, "torque_limit_nm": 1.0, "torque_constant": 0.5}
    content = {
        "name": "m",
        "interface": "ros2_control",
        "motors": {"q11": {**motor, "id": 1}, "q21": {**motor, "id": 0}},
    }
    file = validate(content, MotorsFile, "m")
    point = MotorSetPoint(1.0, 2.0, 3.0, 4.0)
    forward, plain = link_of(takes="gains", unit="A"), link_of()
    assert forward.command(file, (7.0, 8.0), (point, OPEN)) == [0.0, 3.0, 0.0, 4.0, 8.0, 7.0, 0.0, 1.0, 0.0, 2.0]
    assert plain.command(file, (7.0, 8.0), (OPEN, OPEN)) == [8.0, 7.0]
    assert (forward.zero, plain.zero) == ([0.0] * 10, [0.0] * 2)
    assert forward.acting([9.0] * 4 + [0.0] * 6) == [0.0] * 6
    assert forward.acting([1.0] * 2) is None and plain.acting([1.0, 2.0]) == [1.0, 2.0]
    assert forward.effort(file.motors.q11, 0.3) == pytest.approx(0.6)
    assert forward.torque(file.motors.q11, 0.6) == pytest.approx(0.3)
    assert plain.effort(file.motors.q11, 0.3) == 0.3


def test_gains_for_a_controller_that_takes_none_are_refused() -> None:
    with pytest.raises(InputError, match=r"inner_loop: the controller takes no gains: expected takes: gains"):
        link_of(inner_loop={"stiffness": 1.0})


def test_a_rate_that_is_too_low_is_refused_with_one_that_would_do() -> None:
    """The bench's controller manager runs at 100 Hz as shipped."""
    with pytest.raises(PlanRefused, match=r"within the limits .*with rate_hz: (200|500)"):
        refuse_unfit(changed("motkin_middle", {}, rate_hz=100))
    assert refuse_unfit(changed("motkin_middle", {}, rate_hz=200)) is None
