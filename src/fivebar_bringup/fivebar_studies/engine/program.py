# SPDX-License-Identifier: Apache-2.0
"""Digest of the program that determines the rows of a study, which must not be resumed with another one."""

from __future__ import annotations

import hashlib
import inspect
from collections.abc import Collection, Iterable
from importlib import import_module
from pathlib import Path

import fivebar_bringup
import fivebar_control
import fivebar_description
import fivebar_sim
import fivebar_studies
from fivebar_bringup.scenario import Scenario
from fivebar_control.compiling import digest
from fivebar_control.laws.law import Law
from fivebar_control.laws.registry import CONTROLLERS, find_controller
from fivebar_description.modules import load_part
from fivebar_description.optional import SENSORS, registered
from fivebar_description.robot_file import read_robot
from fivebar_studies.rigs.named import find_rig

DECIDING = {
    fivebar_description: ("*.py",),
    fivebar_sim: ("*.py", "effects/*.py"),
    fivebar_control: (
        "compiling.py",
        "fault.py",
        "private_folder.py",
        "root_search.py",
        "controller/*.py",
        "estimation/*.py",
        "laws/*.py",
        "loop/*.py",
        "model/*.py",
        "planning/*.py",
        "safety/*.py",
        "scenario/*.py",
        "trajectory/*.py",
    ),
    fivebar_bringup: (
        "attributes.py",
        "units.py",
        "odds/*.py",
        "extras.py",
        "simulation/*.py",
        "scenario.py",
        "robots/check.py",
        "scenarios/*.py",
    ),
    fivebar_studies: ("rigs/*.py", "engine/table.py", "engine/turns.py"),
}
"""Files that decide the rows of every study, and not only how they are shown: patterns by package.

So do all files of installed packages with sensors.
"""


def program_digest(
    deciding: Collection[str],
    robots: Iterable[str] = (),
    rigs: Iterable[str] = (),
    controllers: Iterable[str] = (),
    scenarios: Iterable[Scenario] = (),
    modules: Iterable[str] = (),
) -> str:
    """Return a digest of the source files, robots, rigs, laws from elsewhere and scenarios that decide rows.

    The place of installation does not enter it.

    Args:
        deciding: patterns of files besides those of `DECIDING`, as PACKAGE/PATTERN.
        robots, rigs, controllers: by name.
        scenarios: as they were read.
        modules: names of those from elsewhere whose file decides rows.

    Raises:
        InputError: a law or a module from elsewhere cannot be loaded.
    """
    total = hashlib.sha256()
    for robot in sorted({*robots, *(find_rig(rig).robot for rig in rigs)}):
        total.update(repr(read_robot(robot)).encode())
    for rig in sorted(set(rigs)):
        total.update(repr(find_rig(rig)).encode())
    for scenario in scenarios:
        total.update(repr(scenario.model_dump()).encode())
    for name in sorted(set(controllers) - set(CONTROLLERS)):
        total.update(f"{name} {_law_digest(find_controller(name).nominal)}\n".encode())
    for name in modules:
        file = getattr(load_part(name), "__file__", None)
        total.update(name.encode() + (b"" if file is None else Path(file).read_bytes()))
    for name, path in deciding_files(deciding).items():
        total.update(f"{name}\n".encode())
        total.update(path.read_bytes())
    return total.hexdigest()[:16]


def _law_digest(law: Law) -> str:
    """Return a digest of a law: of its step and all that it calls, or of its file where the step is no function."""
    try:
        return digest(law.step)
    except TypeError:
        return hashlib.sha256(inspect.getsource(inspect.getmodule(law.settings) or law.step).encode()).hexdigest()


def deciding_files(deciding: Collection[str]) -> dict[str, Path]:
    """Return the source files that decide the rows of a study, by PACKAGE/PATH."""
    files = {}
    of_sensors = {import_module(entry.module.partition(".")[0]): ("*.py",) for entry in registered(SENSORS)}
    for package, patterns in (DECIDING | of_sensors).items():
        assert package.__file__ is not None
        root = Path(package.__file__).parent
        within = f"{package.__name__}/"
        more = (pattern.removeprefix(within) for pattern in deciding if pattern.startswith(within))
        for path in sorted(path for pattern in (*patterns, *more) for path in matching(root, pattern)):
            files[f"{package.__name__}/{path.relative_to(root).as_posix()}"] = path
    return files


def matching(root: Path, pattern: str) -> list[Path]:
    """Return the files of a pattern.

    Raises:
        FileNotFoundError: there are none, as after a folder was renamed; the digest would silently leave them out.
    """
    files = list(root.glob(pattern))
    if not files:
        raise FileNotFoundError(f"{root / pattern}: decides the rows of a study, but there is no such file")
    return files
