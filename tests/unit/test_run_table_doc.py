# SPDX-License-Identifier: Apache-2.0
"""The printed table of a run has every declared quantity."""

from __future__ import annotations

import re
from collections import Counter

from fivebar_bringup.recorded.series import DERIVED, UNITS
from fivebar_bringup.reference.table_page import table_page
from fivebar_description.run_quantities import QUANTITIES


def test_the_printed_table_has_every_column_with_its_unit() -> None:
    rows = [line.split(" | ") for line in table_page().splitlines() if line.startswith("| `")]
    units = {name: row[1] for row in rows for name in re.findall(r"`(\w+)`", row[0])}
    assert units.keys() == UNITS.keys()
    assert not [name for name, unit in UNITS.items() if (unit or "-") not in units[name]]


def test_a_column_has_one_meaning() -> None:
    """Two columns may share a name only where one is derived from the other without a change: sigma and 1/cond(A)."""
    recorded = Counter(name for one in QUANTITIES for name in one.columns if name)
    assert max(recorded.values()) == 1
    derived = {name for one in DERIVED.values() for name in one.columns}
    assert derived & recorded.keys() == {"sigma", "inverse_condition"}
    assert UNITS.keys() == derived | recorded.keys()
