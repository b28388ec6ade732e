# SPDX-License-Identifier: Apache-2.0
"""No command and no node loads more than docs/architecture.md says; `make reach` counts it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from reach import COMMANDS, NODES, TOGETHER, reach

PAGE = Path(__file__).parents[2] / "docs" / "architecture.md"


def stated() -> dict[str, tuple[int, int, int]]:
    """Files and lines loaded and functions called, of each row of the page."""
    rows = re.findall(
        r"^\| ([`\w, ]+) \| (\d+) \| ([\d,]+) \| (\d+) \|$", PAGE.read_text(encoding="utf-8"), re.MULTILINE
    )
    return {
        name.replace("`", ""): (int(files), int(lines.replace(",", "")), int(functions))
        for name, files, lines, functions in rows
    }


@pytest.mark.extra
@pytest.mark.parametrize("name", [*COMMANDS, TOGETHER, *NODES])
def test_no_more_is_loaded_than_the_page_says(name: str) -> None:
    files, lines, functions = stated()[name]
    found = reach(name)
    # a page that states more than there is would let it grow again; which functions are called depends on timing
    assert 0.95 * files <= len(found.files) <= files, f"{len(found.files)} files: say so on the page"
    assert 0.95 * lines <= found.lines <= lines, f"{found.lines} lines: say so on the page"
    assert 0.9 * functions <= len(found.named) <= 1.05 * functions, f"{len(found.named)} functions: say so on the page"
