# SPDX-License-Identifier: Apache-2.0
"""Parts of the project that a robot does not need to cross: found by entry points, and refused by name where missing.

Each is an import package beside this one. Nothing of the core imports them; they register what they add.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from importlib.util import find_spec
from typing import Any, NamedTuple

from fivebar_description.errors import InputError


class OptionalPart(NamedTuple):
    """A part that an optional package registers: group and name of the entry point, and the package."""

    group: str
    name: str
    package: str


COMMANDS = "fivebar.commands"
"""Group of the modules that declare further subcommands."""

PYTHON = "fivebar.python"
"""Group of what the Python interface `fivebar` has besides its own."""

LIVE_PAGE = OptionalPart("fivebar.live_page", "live_page", "fivebar_live")

MUJOCO_PLANT = OptionalPart("fivebar.plants", "mujoco", "fivebar_mujoco")
MUJOCO_CHECK = OptionalPart("fivebar.plant_checks", "mujoco", "fivebar_mujoco")
MUJOCO_MODEL = OptionalPart("fivebar.models", "mujoco", "fivebar_mujoco")
"""A mechanism that MuJoCo moves, what checks the settings of one, and what writes a robot as a file for MuJoCo."""

SENSORS = "fivebar.sensors"
"""Group of what runs, reports and the plant need of sensors that come with packages of their own."""

CAMERA_NODES = OptionalPart(SENSORS, "camera_nodes", "fivebar_camera_runs")
CAMERA_SIMULATION = OptionalPart(SENSORS, "camera_simulation", "fivebar_camera_runs")
CAMERA_SERIES = OptionalPart(SENSORS, "camera_series", "fivebar_camera_runs")
CAMERA_FIGURE = OptionalPart(SENSORS, "camera_figure", "fivebar_camera_runs")
CAMERA_ACCURACY = OptionalPart(SENSORS, "camera_accuracy", "fivebar_camera_runs")
CAMERA_FRAMES = OptionalPart(SENSORS, "camera_frames", "fivebar_camera")
CAMERA_SIGHTS = OptionalPart(SENSORS, "camera_sights", "fivebar_camera")
CAMERA_OPTICS = OptionalPart(SENSORS, "camera_optics", "fivebar_vision")
CAMERA_MODEL = OptionalPart(SENSORS, "camera_model", "fivebar_optics")
"""The nodes of a camera, a simulated one without ROS, its series and figure in reports, how exactly it finds the
platform, when it exposes, what a sample waits for, its calibration, and the model of its lens."""

CAMERA_PARTS = (CAMERA_NODES, CAMERA_FRAMES, CAMERA_OPTICS, CAMERA_MODEL)
"""One part of each package that a camera needs."""

CAMERA_ON = "camera: {on: true}"
"""The setting that asks for a camera, in messages."""

STUDIES = ("assess", "benchmark", "compare", "estimate", "reproduce", "robustness", "sweep")

OWN = "fivebar_"
"""Beginning of the names of this project's import packages."""

PACKAGE_OF = {
    **dict.fromkeys(STUDIES, "fivebar_studies"),
    "camera-calibrate": "fivebar_camera_runs",
    "commission": "fivebar_commission",
    "play": "fivebar_play",
    "view": "fivebar_live",
}
"""The package that each further subcommand comes with."""


@cache
def registered(group: str) -> list[EntryPoint]:
    """Return what is registered in a group, by name, of packages that are there.

    One distribution registers all of them, also where a package of it was left out.
    """
    there = (entry for entry in entry_points(group=group) if find_spec(entry.module.partition(".")[0]) is not None)
    return sorted(there, key=lambda entry: entry.name)


def optional_part(part: OptionalPart, asked: str) -> Any:
    """Return what an optional package registers.

    Args:
        part: that is wanted.
        asked: the option or command that wants it, for the message.

    Raises:
        InputError: its package is not installed.
    """
    for entry in registered(part.group):
        if entry.name == part.name:
            return entry.load()
    raise InputError(f"{asked}: {missing(part.package)}")


def first_missing(parts: Iterable[OptionalPart]) -> str | None:
    """Return what to say of the first of some parts whose package is not installed; None where all are there."""
    for part in parts:
        if all(entry.name != part.name for entry in registered(part.group)):
            return missing(part.package)
    return None


def confirm_package(place: str, asked: str) -> None:
    """Confirm that the optional package of a part, named as MODULE:NAME, is installed.

    Raises:
        InputError: it is one of this project's, and is not; the text begins with what asks for it.
    """
    package = place.partition(":")[0].partition(".")[0]
    if package.startswith(OWN) and find_spec(package) is None:
        raise InputError(f"{asked}: {missing(package)}")


def missing(package: str) -> str:
    """Return that a package is not installed, and how to install it."""
    return f"needs the package {package}, which is not installed: pip install fivebar, or make setup in a clone"
