"""Writes requirements.hashed.lock: the pins of requirements.lock with the digests of the files that pip would install.

Those for x86-64 Linux and every supported Python, by pip's own account; nothing is installed.
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
HEAD = "# Made by `make hashes` from requirements.lock, for pip install --no-deps --require-hashes -r.\n"


def report(python: str, folder: Path) -> dict[str, Any]:
    """Return pip's report of what it would install for a version of Python."""
    path = folder / f"{python}.json"
    subprocess.run(
        [sys.executable, "-m", "pip", "install", "--quiet", "--dry-run", "--ignore-installed", "--no-deps",
         "--report", path, "--target", folder / python, "--python-version", python, "-r", PINS],
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


if __name__ == "__main__":
    with TemporaryDirectory() as folder:
        text = hashed([report(python, Path(folder)) for python in PYTHONS])
    (ROOT / "requirements.hashed.lock").write_text(text, encoding="utf-8")
