# SPDX-License-Identifier: Apache-2.0
"""A scenario in the parameters of nodes: which of them are its keys, and the scenario that they hold."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fivebar_control.laws.registry import find_controller
from fivebar_control.scenario.keys import GOALS
from fivebar_control.scenario.law_settings import SECTIONS, section_law
from fivebar_control.scenario.scenario import ControlScenario
from fivebar_description.settings import Declared, keys_of, section_keys, with_keys
from fivebar_description.strict_yaml import validate


def parameters_in(scenario: ControlScenario, values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of a scenario's keys that parameters hold, as its file has them; other parameters are left out.

    Raises:
        InputError: a parameter does not fit its key.
    """
    model = type(scenario)
    keys = {
        key.name: key for key in keys_of(model, [name for name in model.model_fields if name not in ("law", "format")])
    }
    for section, settings in section_law(scenario).items():
        keys |= {key.name: key for key in section_keys(type(settings), f"{section}.")}
    return {name: keys[name].to_file(value) for name, value in values.items() if name in keys}


def scenario_of(values: Mapping[str, Any]) -> ControlScenario:
    """Return the scenario of a node's parameters, which may be among others: those of the trajectory generator hold it.

    Raises:
        InputError: they are not such parameters.
    """
    keys: dict[str, Declared] = {key.name: key for key in keys_of(ControlScenario, GOALS)}
    law = find_controller(str(values.get("controller"))).nominal
    if law.name not in SECTIONS:
        keys |= {key.name: key for key in section_keys(law.settings, "law.")}
    settings = {name: keys[name].to_file(value) for name, value in values.items() if name in keys}
    return validate(with_keys({"name": "parameters"}, settings), ControlScenario, "parameters")
