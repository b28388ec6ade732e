# SPDX-License-Identifier: Apache-2.0
"""No walk through the code has become longer than docs/architecture.md says; `make walks` counts them."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from walking import WALKS, walked

PAGE = Path(__file__).parents[2] / "docs" / "architecture.md"


def stated() -> dict[str, tuple[int, int]]:
    """Files and functions of each walk, as the page has them."""
    rows = re.findall(r"^\| `(\w+)`: .* \| (\d+) \| (\d+) \|$", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    return {name: (int(files), int(functions)) for name, files, functions in rows}


@pytest.mark.extra
@pytest.mark.parametrize("name", WALKS)
def test_a_walk_is_no_longer_than_the_page_says(name: str) -> None:
    files, functions = stated()[name]
    found = walked(name)
    assert (len(found.files), len(found.functions)) <= (files, functions), "\n".join(found.functions)
    assert len(found.files) <= files
    # a page that states more than there is would let the walk grow again
    assert len(found.functions) >= 0.9 * functions, f"{len(found.functions)} functions now: say so on the page"
