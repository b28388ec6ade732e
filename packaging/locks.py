# SPDX-License-Identifier: Apache-2.0
"""Writes the lock files: exact versions, with the digests of the files that pip would install for x86-64 Linux.

    locks.py UV [--upgrade] [NAME ...]    # all of them, or some of newest, runtime, lowest, jazzy

| file | what is in it |
|---|---|
| requirements.lock | the newest versions of all of requirements.in; requirements.hashed.lock has the digests |
| packaging/runtime.lock | what of it runs, without tests and tools |
| packaging/lowest-*.lock | the lowest versions that the requirements admit, for one version of Python each |
| packaging/jazzy.lock | what a virtual environment needs beside the packages of Ubuntu 24.04 and ROS 2 Jazzy |

Nothing is installed. UV is the program of that name.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path
from tempfile import TemporaryDirectory

from hashes import PYTHONS, hashed_lock, write_hashes
from requirements import ROOT, ROSDEP_KEYS, name_of, section

PLATFORM = "x86_64-manylinux_2_28"
LOCKS = ROOT / "packaging"
OLDEST = "3.11"
"""The oldest supported Python decides on the newest versions: what it can install, later ones can too."""

LOWEST = {
    # of what is not asked for by name, versions of the same time: uv takes the newest
    "3.11": ("click==8.2.1", "contourpy==1.0.7", "numba<0.58", "scipy<1.11"),
    "3.12": ("click==8.2.1", "contourpy<1.3"),
}
"""The versions of Python that lowest versions are locked for, with further limits."""

LOWEST_NUMPY = {"3.11": "1.24.0", "3.12": "1.26.0"}
"""Overrides what the wheels of Pinocchio ask for, numpy 2: what is compiled with it runs with numpy 1 too."""

JAZZY = ("3.11", "3.12")
"""The versions of Python that packaging/jazzy.lock is for: Debian's 3.11 and Ubuntu's 3.12."""

SOURCES_ONLY = ("empy", "notify2")
RENEWED = {"typing-extensions"}
"""What apt has, but too old for pydantic."""

NOT_NEEDED = {"narwhals", "pandas", "pytz", "python-dateutil", "tzdata", "xyzservices"}
"""What bokeh's Python code asks for; its scripts for pages are all that is used."""


def compiler(uv: str, python: str) -> list[str]:
    """Return the words of uv that resolve requirements for a version of Python."""
    words = ["--quiet", "--no-python-downloads", "--python-version", python, "--python-platform", PLATFORM]
    return [uv, "pip", "compile", *words]


def resolved(
    uv: str,
    python: str,
    requirements: Iterable[str],
    limits: Iterable[str] = (),
    numpy: str = "",
    options: Iterable[str] = (),
) -> str:
    """Return the pins that meet requirements."""
    with TemporaryDirectory() as folder:
        asked, limiting = Path(folder, "asked.in"), Path(folder, "limits.txt")
        asked.write_text("\n".join(requirements), encoding="utf-8")
        limiting.write_text("\n".join(limits), encoding="utf-8")
        overriding = Path(folder, "overrides.txt")
        overriding.write_text(f"numpy=={numpy}" if numpy else "", encoding="utf-8")
        sources = [word for name in SOURCES_ONLY for word in ("--no-binary", name)]
        return subprocess.run(
            [*compiler(uv, python),
             "--only-binary", ":all:", *sources, "--no-header", "--no-annotate", "--constraint", limiting,
             "--override", overriding, *options, asked],
            check=True, text=True, stdout=subprocess.PIPE,
        ).stdout  # fmt: skip


def lock_newest(uv: str, upgrade: bool) -> None:
    """Write requirements.lock, and the digests of what it names."""
    options = ["--upgrade"] if upgrade else []
    subprocess.run(
        [*compiler(uv, OLDEST), *options,
         "--custom-compile-command", "make lock", "--output-file", "requirements.lock", "requirements.in"],
        cwd=ROOT, check=True, stdout=subprocess.DEVNULL,
    )  # fmt: skip
    write_hashes()


def lock_runtime(uv: str, upgrade: bool) -> None:
    """Write the lock of what runs, with the versions of requirements.lock."""
    locked = [line for line in (ROOT / "requirements.lock").read_text(encoding="utf-8").splitlines() if "==" in line]
    pins = resolved(uv, OLDEST, [*section("ROS 2"), *section("runtime")], locked)
    (LOCKS / "runtime.lock").write_text(hashed_lock(pins, PYTHONS), encoding="utf-8")


def lock_lowest(uv: str, upgrade: bool) -> None:
    """Write the locks of the lowest versions."""
    asked = [*section("ROS 2"), *section("runtime"), *section("tests")]
    for python, limits in LOWEST.items():
        pins = resolved(uv, python, asked, limits, LOWEST_NUMPY[python], ("--resolution", "lowest-direct"))
        (LOCKS / f"lowest-{python}.lock").write_text(hashed_lock(pins, (python,)), encoding="utf-8")


def lock_jazzy(uv: str, upgrade: bool) -> None:
    """Write the lock of what apt and ROS do not have; all of it agrees with the oldest versions that they have."""
    asked = [one for one in section("runtime") if name_of(one) != "pin"]
    from_apt = [one for one in asked if name_of(one) in ROSDEP_KEYS]
    lowest = resolved(uv, OLDEST, from_apt, LOWEST[OLDEST], LOWEST_NUMPY[OLDEST], ("--resolution", "lowest-direct"))
    limits = [pin for pin in lowest.split() if name_of(pin) in ROSDEP_KEYS]
    given = {name_of(pin) for pin in lowest.split()} - RENEWED
    pins = resolved(uv, OLDEST, asked, limits).split()
    text = "\n".join(sorted(pin for pin in pins if name_of(pin) not in given | NOT_NEEDED))
    (LOCKS / "jazzy.lock").write_text(hashed_lock(text, JAZZY), encoding="utf-8")


LOCKERS = {"newest": lock_newest, "runtime": lock_runtime, "lowest": lock_lowest, "jazzy": lock_jazzy}

if __name__ == "__main__":
    program, *words = sys.argv[1:]
    chosen = [word for word in words if word != "--upgrade"] or list(LOCKERS)
    for name in chosen:
        LOCKERS[name](program, "--upgrade" in words)
