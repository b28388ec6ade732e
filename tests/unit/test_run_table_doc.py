# SPDX-License-Identifier: Apache-2.0
"""docs/reference/run_table.md is what the declared quantities say."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

from fivebar_bringup.recorded.series import DERIVED, UNITS
from fivebar_bringup.reference.table_page import table_page
from fivebar_description.run_quantities import QUANTITIES

PAGE = Path(__file__).parents[2] / "docs/reference/run_table.md"


def test_the_page_is_up_to_date() -> None:
    renew = "python -m fivebar_bringup.reference.table_page > docs/reference/run_table.md"
    assert PAGE.read_text(encoding="utf-8") == table_page(), f"stale: {renew}"


def test_a_column_has_one_meaning() -> None:
    """Two columns may share a name only where one is derived from the other without a change: sigma and 1/cond(A)."""
    recorded = Counter(name for one in QUANTITIES for name in one.columns if name)
    assert max(recorded.values()) == 1
    derived = {name for one in DERIVED.values() for name in one.columns}
    assert derived & recorded.keys() == {"sigma", "inverse_condition"}
    assert UNITS.keys() == derived | recorded.keys()
