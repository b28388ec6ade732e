# SPDX-License-Identifier: Apache-2.0
"""Scenario files: found by name or path, read, and checked as a whole before anything starts."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fivebar_bringup.scenario import SEEN, Scenario
from fivebar_bringup.scenarios.changes import changed_scenario
from fivebar_bringup.scenarios.without_effect import is_written_out, refuse_without_effect
from fivebar_control.estimation.homing import check_declared
from fivebar_control.scenario.parameters import parameters_in
from fivebar_control.scenario.sensors import check_sensors, homing_of
from fivebar_control.scenario.start import initial_joints
from fivebar_description.scenario_file import read_content, scenario_path
from fivebar_description.settings import with_keys
from fivebar_description.strict_yaml import InputError, validate
from fivebar_sim.engines import check_engine, check_plant

NONE: Mapping[str, Any] = {}


def read_scenario(name_or_path: str) -> Scenario:
    """Read a scenario by the name of a shipped one or by path; one with `start: seen` begins where the camera sees it.

    Raises:
        InputError: there is no such scenario, it is malformed, or the camera does not see where the robot stands.
    """
    return _read(scenario_path(name_or_path))


def _read(
    path: Path, parameters: Mapping[str, Any] = NONE, changes: Mapping[str, Any] = NONE, any_law: bool = False
) -> Scenario:
    content = read_content(path)
    scenario = validate(content, Scenario, str(path))
    # a run's file has all keys
    if not is_written_out(content):
        try:
            refuse_without_effect(content, scenario, any_law)
        except InputError as error:
            raise InputError(f"{path}: {error}") from error
    if changes:
        scenario = changed_scenario(content, changes)
        content = with_keys(content, changes)
    # the controller first, because it decides about the keys of the section `law`
    for chosen in ({name: parameters[name] for name in parameters if name == "controller"}, parameters):
        if chosen:
            scenario = validate(with_keys(content, parameters_in(scenario, chosen)), Scenario, str(path))
    if scenario.start != SEEN:
        return scenario
    # OpenCV and the plant take time to load, which other scenarios need not
    from fivebar_bringup.simulation.seen_start import as_seen

    try:
        check_engine(scenario.five_bar(), scenario.plant, scenario.rate_hz)
        return as_seen(scenario)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def load_scenario(
    name_or_path: str,
    parameters: Mapping[str, Any] = NONE,
    changes: Mapping[str, Any] = NONE,
    any_law: bool = False,
) -> Scenario:
    """Read a scenario as `read_scenario` does, and check that its motion can be made.

    Args:
        name_or_path: of the scenario.
        parameters: of nodes; those that are keys of a scenario take the place of the file's, as they do in a node.
        changes: values of keys, by their names with dots, that take the place of the file's.
        any_law: whether the file may have settings of other laws than its own, which are to be run as well.

    Raises:
        InputError: there is no such scenario, it is malformed, has a key without effect, or its motion is refused.
    """
    path = scenario_path(name_or_path)
    scenario = _read(path, parameters, changes, any_law)
    try:
        scenario.plan()
        if scenario.estimated:
            check_declared(scenario.five_bar(), homing_of(scenario))
        check_sensors(scenario)
        check_plant(scenario.five_bar(), scenario.plant, scenario.rate_hz, initial_joints(scenario))
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    return scenario
