# SPDX-License-Identifier: Apache-2.0
"""Checks that a robot file goes with all that a scenario derives from it."""

from __future__ import annotations

import math

from fivebar_bringup.scenario import Scenario
from fivebar_control.model.geometry import inverse_geometry
from fivebar_control.scenario.sensors import check_sensors
from fivebar_description.errors import InputError
from fivebar_description.robot_file import HOME_MODE, read_robot
from fivebar_description.strict_yaml import validate
from fivebar_sim.effects.mechanism import mechanism_of

FOLLOWS_FROM = {
    "plant.links.l_": "tolerances.length",
    "plant.links.base": "tolerances.base",
    "errors.push": "loads.push",
    "errors.tilt": "loads.tilt",
    "errors.passive": "loads.passive",
    "plant.friction.viscous": "friction.f_s11, friction.f_s21",
    "plant.motors": "drives.torque_limit",
    "force_deviation": "loads",
}
"""Keys of a robot file by the settings of a scenario or a rig that follow from them."""


def check_simulated(robot: str) -> None:
    """Check that a robot, by name or path, can be simulated with its sensors.

    Raises:
        InputError: its file does not describe a robot, or a section does not fit; begins with `robot`.
    """
    home = read_robot(robot).home_m
    content = {"name": "check", "robot": robot, "controller": "unified", "waypoints": (home, home)}
    try:
        scenario = validate(content, Scenario, robot)
        if not all(map(math.isfinite, inverse_geometry(scenario.five_bar(), HOME_MODE, *home))):
            raise InputError(f"home_m: [{home[0]:g}, {home[1]:g}]: is out of reach: expected where both legs reach")
        check_sensors(scenario)
        mechanism_of(scenario.five_bar(), scenario.plant, scenario.rate_hz)
    except InputError as error:
        problem = str(error).removeprefix(f"{robot}: ")
        named = problem.startswith("home_m")
        raise InputError(f"{robot}: {problem if named else by_keys_of_file(problem)}") from error


def by_keys_of_file(problem: str) -> str:
    """Return what is wrong with a robot by the keys of its file, from which that follows."""
    place = next(
        (keys for part, keys in FOLLOWS_FROM.items() if part in problem), "drives, inertias_kg_m2, mass_kg, loads"
    )
    return f"{place}: such a robot cannot be simulated: what follows from it, {problem}"
