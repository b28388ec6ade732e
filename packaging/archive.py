# SPDX-License-Identifier: Apache-2.0
"""Packs a reproduction for a repository of research data such as Zenodo: page, results as CSV, environment, digests.

    archive.py REPRODUCTION_DIRECTORY ARCHIVE.zip

The same directory and environment give the same bytes. Only the standard library is used here.
"""

from __future__ import annotations

import csv
import hashlib
import io
import json
import platform
import re
import sys
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from importlib.metadata import distributions
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
FROM_THE_TREE = (
    "LICENSE",
    "CITATION.cff",
    "requirements.lock",
    "requirements.hashed.lock",
    "docs/reference/summary.schema.json",
    "docs/reference/scenario.schema.json",
    "docs/reference/robot.schema.json",
    "docs/reference/program.schema.json",
    "src/fivebar_bringup/config/benchmark/crossings.csv",
)
STAMP = (1980, 1, 1, 0, 0, 0)
"""Of every file in the archive: the earliest that the format knows, so that archives do not differ by the clock."""

READ_ME = """\
The reproduction of the thesis by fivebar {version}, simulated throughout: nothing of it was measured on a robot.

reproduce.html        the page: every figure and claim of the thesis, what was found, and the verdict by its stated rule
reproduce.json        all of it as data; claims.csv, runs.csv and table-*.csv are its parts
figures/              the figures of the page
crossings.csv         the crossings of the benchmark
*.schema.json         JSON Schemas of scenario, robot file, program and summary
environment.json      machine, Python, and every installed distribution with its version
requirements.lock     what was installed from, and requirements.hashed.lock with digests
SHA256SUMS            digests of all these files: sha256sum -c SHA256SUMS

Again, in a clone of this version on x86-64 Linux: make reproduce
Results agree to the last digit on the same machine and versions, and to rounding elsewhere.
"""


class ArchiveRefused(Exception):
    """The directory is not that of a finished, whole reproduction."""


def contents(directory: Path) -> dict[str, bytes]:
    """Return all files of the archive by name."""
    try:
        result = json.loads((directory / "reproduce.json").read_text(encoding="utf-8"))
        page = (directory / "reproduce.html").read_bytes()
    except (OSError, ValueError) as error:
        raise ArchiveRefused(f"{directory}: expected the directory of a finished reproduction: {error}") from error
    if result["quick"]:
        raise ArchiveRefused(f"{directory}: was made with --quick, which leaves runs out")
    version = cited("version")
    files = {
        "README.txt": READ_ME.format(version=version).encode(),
        ".zenodo.json": as_json(zenodo(version)),
        "environment.json": as_json(environment()),
        "reproduce.html": page,
        "reproduce.json": as_json(result),
        "claims.csv": table([flat(row) for row in result["rows"]]),
        "runs.csv": table([flat(row) for row in result["runs"]]),
        **{f"table-{one['name']}.csv": table([flat(row) for row in one["rows"]]) for one in result["tables"]},
        **{f"figures/{path.name}": path.read_bytes() for path in sorted((directory / "figures").glob("*.png"))},
        **{Path(name).name: (ROOT / name).read_bytes() for name in FROM_THE_TREE},
    }
    sums = "".join(f"{hashlib.sha256(files[name]).hexdigest()}  {name}\n" for name in sorted(files))
    return {**files, "SHA256SUMS": sums.encode()}


def pack(directory: Path, archive: Path) -> None:
    """Write the archive, all files in one folder of its name."""
    files = contents(directory)
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as packed:
        for name in sorted(files):
            packed.writestr(zipfile.ZipInfo(f"{archive.stem}/{name}", STAMP), files[name], zipfile.ZIP_DEFLATED)


def cited(key: str) -> str:
    """Return a plain value of CITATION.cff."""
    found = re.search(rf'^{key}: "?(.*?)"?$', (ROOT / "CITATION.cff").read_text(encoding="utf-8"), re.MULTILINE)
    if found is None:
        raise ArchiveRefused(f"CITATION.cff: {key}: is missing")
    return found[1]


def zenodo(version: str) -> dict[str, Any]:
    """Return the deposit's description, in the fields of Zenodo."""
    text = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    listed = re.search(r"^keywords: \[(.*)\]$", text, re.MULTILINE)
    return {
        "title": f"Reproduction by {cited('title')}, {version}",
        "upload_type": "dataset",
        "description": "Figures and claims of a thesis on crossing Type 2 singularities, reproduced in simulation: the"
        " page with its verdicts, all values as CSV and JSON, and the environment that they came from.",
        "creators": [{"name": name} for name in re.findall(r"^  - name: (.*)$", text, re.MULTILINE)],
        "license": cited("license").lower(),
        "version": version,
        "keywords": listed[1].split(", ") if listed else [],
    }


def environment() -> dict[str, Any]:
    """Return what the results came from, as far as this process sees it."""
    processor = re.search(r"^model name\s*: (.*)$", Path("/proc/cpuinfo").read_text(encoding="utf-8"), re.MULTILINE)
    return {
        "python": platform.python_version(),
        "system": platform.system(),
        "machine": platform.machine(),
        "libc": " ".join(platform.libc_ver()),
        "processor": processor[1] if processor else "",
        "distributions": dict(sorted({one.metadata["Name"]: one.version for one in distributions()}.items())),
    }


def flat(row: Mapping[str, Any]) -> dict[str, Any]:
    """Return a row with the keys of inner mappings after a dot."""

    def pairs(inner: Mapping[str, Any], before: str) -> Iterator[tuple[str, Any]]:
        for key, value in inner.items():
            if isinstance(value, Mapping):
                yield from pairs(value, f"{before}{key}.")
            else:
                yield before + key, json.dumps(value) if isinstance(value, list) else value

    return dict(pairs(row, ""))


def table(rows: Sequence[Mapping[str, Any]]) -> bytes:
    """Return rows as CSV, with every key that any of them has as a column."""
    text = io.StringIO()
    writer = csv.DictWriter(text, list(dict.fromkeys(key for row in rows for key in row)), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue().encode()


def as_json(content: Any) -> bytes:
    """Return a content as JSON."""
    return (json.dumps(content, indent=2, ensure_ascii=False) + "\n").encode()


if __name__ == "__main__":
    try:
        pack(Path(sys.argv[1]), Path(sys.argv[2]))
    except ArchiveRefused as refusal:
        sys.exit(f"archive: {refusal}")
    print(f"archive: {sys.argv[2]}")
