# SPDX-License-Identifier: Apache-2.0
"""Adds to exact versions the digests of the files that pip would install, and writes requirements.hashed.lock.

Those for x86-64 Linux and some versions of Python, by pip's own account; nothing is installed.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections import defaultdict
from collections.abc import Iterable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
PINS = ROOT / "requirements.lock"
PYTHONS = ("3.11", "3.12", "3.13")
HEAD = "# Made by `make lock`, for pip install --no-deps --require-hashes -r.\n"


def report(pins: Path, python: str, folder: Path) -> dict[str, Any]:
    """Return pip's report of what it would install for a version of Python."""
    path = folder / f"{python}.json"
    subprocess.run(
        [sys.executable, "-m", "pip", "install", "--quiet", "--dry-run", "--ignore-installed", "--no-deps",
         "--report", path, "--target", folder / python, "--python-version", python, "-r", pins],
        check=True,
    )  # fmt: skip
    return json.loads(path.read_text(encoding="utf-8"))


def hashed(reports: Iterable[dict[str, Any]]) -> str:
    """Return the text of the lock file."""
    digests: dict[str, set[str]] = defaultdict(set)
    for content in reports:
        for one in content["install"]:
            name = one["metadata"]["name"].lower().replace("_", "-").replace(".", "-")
            digests[f"{name}=={one['metadata']['version']}"].add(
                one["download_info"]["archive_info"]["hashes"]["sha256"]
            )
    parts = (
        " \\\n".join([pin, *(f"    --hash=sha256:{digest}" for digest in sorted(found))])
        for pin, found in sorted(digests.items())
    )
    return HEAD + "\n".join(parts) + "\n"


def hashed_lock(pins: str, pythons: Iterable[str]) -> str:
    """Return a lock file of pins, one a line, for some versions of Python."""
    with TemporaryDirectory() as folder:
        path = Path(folder, "pins.lock")
        path.write_text(pins, encoding="utf-8")
        return hashed([report(path, python, Path(folder)) for python in pythons])


def write_hashes() -> None:
    """Write the digests of what requirements.lock names."""
    text = hashed_lock(PINS.read_text(encoding="utf-8"), PYTHONS)
    (ROOT / "requirements.hashed.lock").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    write_hashes()
