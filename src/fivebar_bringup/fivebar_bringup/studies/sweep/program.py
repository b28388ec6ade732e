"""Digest of the program that determines the rows: a sweep must not be resumed with another one."""

from __future__ import annotations

import hashlib
from pathlib import Path

import fivebar_bringup
import fivebar_control
import fivebar_description
import fivebar_sim
from fivebar_bringup.studies.rigs.rig import find_rig
from fivebar_bringup.studies.sweep.drawing import VARIED, robot_of
from fivebar_description.robot_file import read_robot

DECIDING = {
    fivebar_description: ("*.py",),
    fivebar_sim: ("*.py", "effects/*.py", "vision/*.py"),
    fivebar_control: (
        "compiling.py",
        "machine_code.py",
        "fault.py",
        "root_search.py",
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
        "units.py",
        "odds/*.py",
        "simulation/*.py",
        "scenario.py",
        "studies/rigs/*.py",
        "studies/sweep/drawing.py",
        "studies/sweep/rows.py",
        "studies/sweep/running.py",
    ),
}
"""What decides the rows, and not only how they are shown: patterns of files by package."""


BASES = "ideal", "encoders"
"""Rigs whose settings the cases without a rig have."""


def program_digest(rig: str = VARIED) -> str:
    """Return a digest of the source files, rig and robot that decide the rows; the place of installation does not."""
    total = hashlib.sha256()
    total.update(repr(read_robot(robot_of(rig))).encode())
    for name in BASES if rig == VARIED else (rig,):
        total.update(repr(find_rig(name)).encode())
    for name, path in deciding_files().items():
        total.update(f"{name}\n".encode())
        total.update(path.read_bytes())
    return total.hexdigest()[:16]


def deciding_files() -> dict[str, Path]:
    """Return the source files that decide the rows, by PACKAGE/PATH."""
    files = {}
    for package, patterns in DECIDING.items():
        assert package.__file__ is not None
        root = Path(package.__file__).parent
        for path in sorted(path for pattern in patterns for path in matching(root, pattern)):
            files[f"{package.__name__}/{path.relative_to(root).as_posix()}"] = path
    return files


def matching(root: Path, pattern: str) -> list[Path]:
    """Return the files of a pattern.

    Raises:
        FileNotFoundError: there are none, as after a folder was renamed; the digest would silently leave them out.
    """
    found = list(root.glob(pattern))
    if not found:
        raise FileNotFoundError(f"{root / pattern}: decides the rows of a sweep, but there is no such file")
    return found
