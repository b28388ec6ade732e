# SPDX-License-Identifier: Apache-2.0
"""The parameters that a trajectory generator has in the run of a scenario, made without the node."""

from __future__ import annotations

from operator import attrgetter
from typing import Any

from fivebar_control.scenario.keys import GOALS, parameters_of
from fivebar_control.scenario.law_settings import section_law
from fivebar_control.scenario.scenario import ControlScenario
from fivebar_description.settings import section_keys


def generator_parameters(scenario: ControlScenario) -> dict[str, Any]:
    values = parameters_of(scenario, GOALS)
    for section, settings in section_law(scenario).items():
        for key in section_keys(type(settings), f"{section}."):
            values[key.name] = key.to_parameter(attrgetter(key.name.partition(".")[2])(settings))
    return values
