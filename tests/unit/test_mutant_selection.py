# SPDX-License-Identifier: Apache-2.0
"""`make mutants` knows every module of the core."""

from __future__ import annotations

import tomllib
from pathlib import Path

from mutant_selection import unmatched

TESTS = Path(__file__).parents[1]


def test_the_tests_of_every_module_are_named_and_exist() -> None:
    selection = tomllib.loads((TESTS / "mutants" / "selection.toml").read_text(encoding="utf-8"))
    assert unmatched(selection) == []
    sections = [part for folder, part in selection.items() if folder not in ("run", "excluded")]
    files = {file for part in sections for named in part.values() for file in named}
    assert [file for file in sorted(files) if not (TESTS / "unit" / file).is_file()] == []
    gone = {"laws": {"no_such_module": []}}
    assert "laws/no_such_module" in unmatched({**gone, "excluded": {}})
    assert "laws/unified" in unmatched({**gone, "excluded": {}})
