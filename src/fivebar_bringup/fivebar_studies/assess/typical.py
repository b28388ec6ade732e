# SPDX-License-Identifier: Apache-2.0
"""Typical motions of a robot: from where it rests to places that follow from its geometry."""

from __future__ import annotations

from functools import lru_cache
from shlex import quote
from typing import NamedTuple

import numpy as np

from fivebar_bringup.motions.request import Request, within_drives
from fivebar_bringup.motions.start import HOME_MODE, Start
from fivebar_bringup.scenario import Scenario
from fivebar_control.model.geometry import workspace_bounds
from fivebar_control.planning.postures import Place, place_at
from fivebar_control.planning.timing import Speed
from fivebar_description.robot_file import read_robot
from fivebar_description.strict_yaml import validate
from fivebar_studies.rigs.declared import DECLARED, rig_of
from fivebar_studies.rigs.named import find_rig

RATE_HZ = 500

PLACES = 40
"""Places along each side of the workspace among which goals are chosen."""

CALM, FREE = 0.3, 0.3
"""Least 1/cond(A) and least |sin q_i2| of a goal."""


PLACES_OF_GOAL = 4
"""Decimals of a goal (m)."""


class Typical(NamedTuple):
    """A typical motion: what it is, and its goal with the assembly mode there."""

    name: str
    goal: tuple[float, float]
    assembly: str

    def command(self, robot: str) -> str:
        """Return the command that makes it."""
        x, y = self.goal
        return f"fivebar goto --robot {quote(robot)} --mode {self.assembly} -- {x:g} {y:g}"


def variant_scenario(robot: str, controller: str, variant: str = DECLARED) -> Scenario:
    """Return a scenario of a robot as it is declared or of a variant of it, at home; its motion is a placeholder.

    Raises:
        InputError: the robot's file does not fit.
    """
    rig, home = find_rig(rig_of(robot, variant)), read_robot(robot).home_m
    common = {
        "name": "assess",
        "robot": robot,
        "rate_hz": RATE_HZ,
        "working_mode": HOME_MODE,
        "waypoints": (home, home),
        "plant": {"torque_limit": within_drives(robot, None, None)[0]},
    }
    scenario = validate(common, Scenario, robot)
    return validate(rig.content(scenario, controller), Scenario, robot)


def request_for(motion: Typical, robot: str, controller: str, variant: str | None = DECLARED) -> Request:
    """Return the request for a typical motion of a variant of a robot; of None as `fivebar goto` makes it."""
    home = read_robot(robot).home_m
    before = None if variant is None else variant_scenario(robot, controller, variant)
    torque, speed = within_drives(robot, None, None)
    return Request(
        *motion.goal,
        assembly=motion.assembly,
        working_mode=HOME_MODE,
        start=Start(*home, HOME_MODE, before),
        controller=controller,
        robot=robot,
        torque_limit=torque,
        motor_speed=speed,
        rate_hz=RATE_HZ,
        duration=Speed.COMFORTABLE,
    )


@lru_cache(maxsize=4)
def typical_motions(robot: str) -> tuple[Typical, ...]:
    """Return the typical motions of a robot; fewer where it has not the places for them."""
    five_bar, home = read_robot(robot).five_bar(), read_robot(robot).home_m
    here = place_at(five_bar, HOME_MODE, *home)
    left, right, bottom, top = workspace_bounds(five_bar)
    across, along = (np.linspace(*ends, PLACES).round(PLACES_OF_GOAL) for ends in ((left, right), (bottom, top)))
    grid = [(float(x), float(y)) for x in across for y in along]
    places = [place_at(five_bar, HOME_MODE, *point) for point in grid]
    calm = [place for place in places if place.kappa >= CALM and place.serial >= FREE]
    other = [place for place in calm if place.assembly == -here.assembly]
    beside = [place for place in calm if place.assembly == here.assembly]

    def distance(place: Place) -> float:
        return float(np.hypot(place.x - home[0], place.y - home[1]))

    goals = []
    if other:
        goals += [
            ("to the nearest place across the locus", min(other, key=distance)),
            ("to the farthest place across the locus", max(other, key=distance)),
            ("to the best conditioned place across the locus", max(other, key=lambda place: place.kappa)),
        ]
    if beside:
        goals.append(("to the farthest place without crossing", max(beside, key=distance)))
    return tuple(Typical(name, (goal.x, goal.y), "+" if goal.assembly > 0 else "-") for name, goal in goals)
