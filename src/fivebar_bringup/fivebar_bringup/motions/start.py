# SPDX-License-Identifier: Apache-2.0
"""Start of a requested motion: a given position, or the end of an earlier run."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from fivebar_bringup.bag.payloads import recorded_payloads
from fivebar_bringup.bag.reader import read_bag
from fivebar_bringup.recorded.run_directory import RunDirectory
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.scenario_files import read_scenario
from fivebar_control.model.kinematics import state_from_joints, working_mode
from fivebar_control.model.state import WorkingMode
from fivebar_description.interface import ACTIVE_JOINTS, GROUND_TRUTH, JOINT_STATES, JOINTS, MOTOR_STATES
from fivebar_description.modules import modules_unopened
from fivebar_description.robot_file import HOME_MODE as HOME_MODE
from fivebar_description.strict_yaml import InputError

AT_REST = 0.2
"""Motor speed (rad/s) up to which a run counts as ended at rest."""


class Start(NamedTuple):
    """Where the robot rests (m), in which working mode, and the run that took it there, if any."""

    x: float
    y: float
    working_mode: WorkingMode
    scenario: Scenario | None = None


def start_after(directory: Path) -> Start:
    """Return where the robot stood at the last sample of a run.

    Raises:
        InputError: the directory does not hold a run, the robot was still moving, or its platform carries a payload.
        BagError: its bag cannot be read.
    """
    run = RunDirectory(directory)
    scenario = run.read_scenario()
    recording = read_bag(run.bag)
    payloads = recorded_payloads(recording)
    # a scenario cannot say that the robot starts with one
    if payloads and payloads[-1].mass > 0.0:
        raise InputError(
            f"--after: {directory}: the platform still carries a payload of {payloads[-1].mass:g} kg: expected a run"
            " that ended without one: place it in the program, or go on within it"
        )
    topic = GROUND_TRUTH if recording.count(GROUND_TRUTH) else JOINT_STATES
    last = [
        value for field in ("position", "velocity") for value in recording.values(topic, field, JOINTS)[-1].tolist()
    ]
    state = state_from_joints(scenario.five_bar(), *last)
    if not max(abs(state.leg1.dq1), abs(state.leg2.dq1)) <= AT_REST:
        raise InputError(
            f"{directory}: the run ended with motors at {state.leg1.dq1:.2f} and {state.leg2.dq1:.2f} rad/s:"
            " expected a robot at rest"
        )
    return Start(state.x, state.y, working_mode(state), scenario)


def start_seen(name_or_path: str) -> Start:
    """Return where the camera of a scenario with `start: seen` sees the robot.

    Raises:
        InputError: there is no such scenario, or the camera does not see where the robot stands.
    """
    with modules_unopened():
        scenario = read_scenario(name_or_path)
    if scenario.stands is None or not scenario.ekf.seen_start:
        raise InputError(f"--seen: {name_or_path}: expected a scenario with start: seen")
    return Start(*scenario.waypoints[0], scenario.working_mode, scenario)


class Standing(NamedTuple):
    """A robot that has come to rest: motor angles by its encoders (rad), and the scenario that took it there."""

    q11: float
    q21: float
    scenario: Scenario


def standing_after(directory: Path) -> Standing:
    """Return where the motors stood at the last sample of a run.

    Raises:
        InputError: the directory does not hold a run.
        BagError: its bag cannot be read.
    """
    run = RunDirectory(directory)
    recording = read_bag(run.bag)
    topic = MOTOR_STATES if recording.count(MOTOR_STATES) else JOINT_STATES
    q11, q21 = recording.values(topic, "position", ACTIVE_JOINTS)[-1].tolist()
    return Standing(q11, q21, run.read_scenario())
