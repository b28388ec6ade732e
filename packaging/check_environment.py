# SPDX-License-Identifier: Apache-2.0
"""Checks that this interpreter finds every package that the workspace needs, in a version that is not too old.

Exit status: 0 if it does, 2 with one line for each that is missing or too old. Only the standard library is used here.
"""

from __future__ import annotations

import importlib
import re
import sys
from importlib.metadata import PackageNotFoundError, version

from requirements import ROSDEP_KEYS, applies, lowest_of, name_of, section

NO_DISTRIBUTION = {"pin": "pinocchio"}
"""The module of what ROS installs without the metadata of a Python distribution."""


def numbers(text: str) -> tuple[int, ...]:
    """Return the leading numbers of a version."""
    found = re.match(r"\d+(\.\d+)*", text)
    return tuple(int(part) for part in found[0].split(".")) if found else ()


def found_version(name: str) -> str:
    """Return the version of a distribution here, "" if there is none."""
    try:
        return version(name)
    except PackageNotFoundError:
        if name not in NO_DISTRIBUTION:
            return ""
    try:
        return str(importlib.import_module(NO_DISTRIBUTION[name]).__version__)
    except ImportError:
        return ""


def complaint(requirement: str) -> str | None:
    """Return what is wrong with a requirement here, None if it is met."""
    name, lowest = name_of(requirement), lowest_of(requirement)
    found = found_version(name)
    if not applies(requirement) or (found and numbers(found) >= numbers(lowest)):
        return None
    key = ROSDEP_KEYS.get(name)
    where = f"rosdep install --from-paths src --ignore-src -y (key {key})" if key else "packaging/jazzy.lock"
    return f"{name}: expected {lowest} or later, found {found or 'none'}; it comes from {where}"


if __name__ == "__main__":
    complaints = [line for line in map(complaint, section("runtime")) if line is not None]
    for line in complaints:
        print(f"environment: {line}", file=sys.stderr)
    sys.exit(2 if complaints else 0)
