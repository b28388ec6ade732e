# SPDX-License-Identifier: Apache-2.0
"""docs/architecture.md names files and functions of the tree; all of them exist, and the recipes hold."""

from __future__ import annotations

import re
from pathlib import Path
from typing import get_type_hints

from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.case import Numbers
from fivebar_control.laws.law import Law
from fivebar_control.laws.registry import CONTROLLERS
from fivebar_sim import sensors
from fivebar_sim.effects.settings import PlantSettings

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
LINKS = re.findall(r"\]\(([^)#]+)\)", TEXT)
PATHS = sorted(set(re.findall(r"`((?:[\w.]+/)+[\w.]+\.py)`", TEXT)))


def test_links_lead_to_files() -> None:
    assert not [link for link in LINKS if not (ROOT / "docs" / link).resolve().is_file()]


def exists(path: str) -> bool:
    """Whether a file is in the repository, in a package that is named first, or in control or bringup."""
    package, _, rest = path.partition("/")
    places = (
        ROOT / path,
        ROOT / "src" / package / package / rest,
        ROOT / "src" / "fivebar_bringup" / path,
        *(ROOT / "src" / name / name / path for name in ("fivebar_control", "fivebar_bringup")),
    )
    return any(place.is_file() for place in places)


def test_named_files_exist() -> None:
    assert len(PATHS) > 20
    assert not [path for path in PATHS if not exists(path)]


def test_a_law_needs_what_the_recipe_says() -> None:
    assert {"settings", "memory", "step"} <= set(Law._fields)
    assert "law" in Scenario.model_fields
    assert {law.executable for controller in CONTROLLERS.values() for law in controller.laws} <= {
        path.stem for path in (ROOT / "src/fivebar_control/fivebar_control/nodes").glob("*_controller.py")
    }


def test_an_effect_of_the_plant_finds_its_settings_in_the_engine_too() -> None:
    assert Scenario.model_fields["plant"].annotation is PlantSettings
    assert get_type_hints(Numbers)["equipment"] is PlantSettings
    assert sensors.shaped(0.37, 0.25, 10.0) == 0.25
    assert sensors.counted(0.37, 0.25) == 0.25
