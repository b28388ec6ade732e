# SPDX-License-Identifier: Apache-2.0
"""docs/laws.md has every weight that was tried, and names files and scenarios that exist."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from fivebar_control.laws.gains import UnifiedSettings
from fivebar_description.scenario_file import shipped_scenarios
from unified_sweep import SWEPT

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs" / "laws.md").read_text(encoding="utf-8")


def test_every_weight_of_the_sweep_is_in_the_table() -> None:
    rows = re.findall(r"^\| `(\w+)` ([\d.]+)( \(default\))? \|", TEXT, flags=re.MULTILINE)
    assert [(name, float(value)) for name, value, _ in rows] == [("weight", value) for value in SWEPT["weight"]]
    assert [float(value) for _, value, chosen in rows if chosen] == [UnifiedSettings().weight]


@pytest.mark.parametrize("name", sorted(set(re.findall(r"fivebar simulate (\w+)", TEXT))))
def test_named_scenarios_are_shipped(name: str) -> None:
    assert name in shipped_scenarios()


@pytest.mark.parametrize("name", sorted(set(re.findall(r"`((?:src|tests)/[\w/.]+)`|\((images/\w+\.png)\)", TEXT))))
def test_named_files_exist(name: tuple[str, str]) -> None:
    source, image = name
    assert (ROOT / source).is_file() if source else (ROOT / "docs" / image).is_file()
