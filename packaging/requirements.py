# SPDX-License-Identifier: Apache-2.0
"""The sections of requirements.in, and what of it Ubuntu and Debian have."""

from __future__ import annotations

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]

ROSDEP_KEYS = {
    "numpy": "python3-numpy",
    "scipy": "python3-scipy",
    "numba": "python3-numba",
    "pin": "pinocchio",
    "pyyaml": "python3-yaml",
    "ruamel.yaml": "python3-ruamel.yaml",
    "jinja2": "python3-jinja2",
    "python-can": "python3-can",
    "msgpack": "python3-msgpack",
    "rich": "python3-rich",
    "matplotlib": "python3-matplotlib",
    "pillow": "python3-pil",
    "tornado": "python3-tornado",
    "pytest": "python3-pytest",
    "pytest-timeout": "python3-pytest-timeout",
    "hypothesis": "python3-hypothesis",
}
"""The key of rosdep for each requirement that apt meets on Ubuntu 24.04, in a version that is not too old.

Others have keys too, but for pip outside of an environment (which Ubuntu refuses) or for a version that is too old
(typer 0.9, pydantic 1.10, OpenCV 4.6): `packaging/jazzy.lock` has them.
"""


def section(name: str) -> list[str]:
    """Return the requirements of a section of requirements.in, such as "runtime", as they stand there."""
    text = (ROOT / "requirements.in").read_text(encoding="utf-8")
    found = re.search(rf"^# --- {name}\b.*?$(.*?)(?=^# ---|\Z)", text, re.MULTILINE | re.DOTALL)
    if found is None:
        raise ValueError(f"requirements.in: has no section {name!r}")
    lines = (line.partition("#")[0].strip() for line in found[1].splitlines())
    return [line for line in lines if line]


def name_of(requirement: str) -> str:
    """Return the name of the distribution that a requirement asks for."""
    return re.split(r"[\[<>=~! ]", requirement, maxsplit=1)[0]


def applies(requirement: str, python: tuple[int, ...] = sys.version_info[:2]) -> bool:
    """Return whether a requirement is one for a version of Python; some are for later ones only."""
    found = re.search(r'; *python_version *>= *"(\d+)\.(\d+)"', requirement)
    return found is None or python >= (int(found[1]), int(found[2]))


def lowest_of(requirement: str) -> str:
    """Return the lowest version that a requirement admits, "" if it says none."""
    found = re.search(r"[>=~]=([\w.]+)", requirement)
    return found[1] if found else ""
