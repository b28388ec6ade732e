# SPDX-License-Identifier: Apache-2.0
"""docs/settings.md is what the declarations of the settings say, and they say something of every key of a scenario."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from fivebar_bringup.reference.settings_page import settings_page
from fivebar_bringup.scenario import Scenario
from fivebar_description.settings import Keys

PAGE = Path(__file__).parents[2] / "docs/settings.md"


def test_the_page_is_up_to_date() -> None:
    assert PAGE.read_text(encoding="utf-8") == settings_page(), "stale: fivebar settings > docs/settings.md"


def test_every_key_has_a_row() -> None:
    parts = settings_page().split("\n## ")
    values = Scenario(name="any", waypoints=((0.0, 0.15), (0.0, 0.02))).model_dump()
    assert not [name for name in Scenario.model_fields if not _has_rows(name, values[name], parts)]


def _has_rows(name: str, content: Any, parts: list[str]) -> bool:
    """Whether a key, or each key of its section and of the sections within, has one row."""
    if any(isinstance(one, Keys) for one in Scenario.model_fields[name].metadata):
        (table,) = (part for part in parts if part.startswith(f"`{name}`"))
        inner = {key: value for key, value in content.items() if table.count(f"# `{name}.{key}`\n")}
        keys = [*(content.keys() - inner.keys()), *(key for section in inner.values() for key in section)]
        return all(f"\n| `{key}` | " in table for key in keys) and table.count("\n| `") == len(keys)
    return f"\n| `{name}` | " in parts[1]
