# SPDX-License-Identifier: Apache-2.0
"""Whether `tests/mutants/selection.toml` names every module whose mutants the unit tests are to notice."""

from __future__ import annotations

from pathlib import Path

CORE = Path(__file__).resolve().parents[2] / "src" / "fivebar_control" / "fivebar_control"


def unmatched(selection: dict[str, dict[str, list[str]]]) -> list[str]:
    """Return the modules with functions that the selection lacks in its folders, and those in it that do not exist."""
    found = []
    for folder, section in selection.items():
        if folder not in ("run", "excluded"):
            paths = {path.stem: path for path in (CORE / folder).glob("*.py")}
            functions = {name for name, path in paths.items() if "def " in path.read_text(encoding="utf-8")}
            functions -= {name for name in functions if f"{folder}/{name}" in selection["excluded"]}
            found += [f"{folder}/{name}" for name in sorted(functions - set(section) | set(section) - set(paths))]
    return found
