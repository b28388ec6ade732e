# SPDX-License-Identifier: Apache-2.0
"""The printed settings say something of every key of a scenario, and pages link to sections that they have."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from fivebar_bringup.reference.settings_page import LAWS, settings_page
from fivebar_bringup.scenario import Scenario
from fivebar_control.laws.registry import own_laws
from fivebar_description.settings import Keys

DOCS = Path(__file__).parents[2] / "docs"


def test_pages_link_to_sections_that_there_are() -> None:
    sections = set(re.findall(r"^## `(\w+)`$", settings_page(), re.MULTILINE))
    linked = {
        found
        for page in DOCS.rglob("*.md")
        for found in re.findall(r"\]\((?:[./]|reference/)*settings\.md#([\w-]+)\)", page.read_text(encoding="utf-8"))
    }
    assert {"plant", "risk"} <= linked
    assert not linked - sections


def test_every_key_has_a_row() -> None:
    parts = settings_page().split("\n## ")
    values = Scenario(name="any", waypoints=((0.0, 0.15), (0.0, 0.02))).model_dump()
    assert not [name for name in Scenario.model_fields if not _has_rows(name, values[name], parts)]


@pytest.mark.parametrize("name", LAWS)
def test_every_setting_of_a_law_has_a_row(name: str) -> None:
    (part,) = (part for part in settings_page().split("\n## ") if part.startswith(f"Section `law` of `{name}`\n"))
    assert re.findall(r"^\| `(\w+)` \| ", part, re.MULTILINE) == list(own_laws()[name].settings._fields)


def _has_rows(name: str, content: Any, parts: list[str]) -> bool:
    """Whether a key, or each key of its section and of the sections within, has one row."""
    if any(isinstance(one, Keys) for one in Scenario.model_fields[name].metadata):
        (table,) = (part for part in parts if part.startswith(f"`{name}`"))
        inner = {key: value for key, value in content.items() if table.count(f"# `{name}.{key}`\n")}
        keys = [*(content.keys() - inner.keys()), *(key for section in inner.values() for key in section)]
        return all(f"\n| `{key}` | " in table for key in keys) and table.count("\n| `") == len(keys)
    return f"\n| `{name}` | " in parts[1]
