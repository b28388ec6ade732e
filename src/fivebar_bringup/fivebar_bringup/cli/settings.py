# SPDX-License-Identifier: Apache-2.0
"""Subcommand that documents the settings of a scenario."""

from __future__ import annotations

from typing import Annotated

import typer

from fivebar_bringup.cli.app import Group, SetOption, command, input_errors
from fivebar_description.errors import InputError


@command(Group.FILES)
def settings(
    scenario: Annotated[
        str, typer.Argument(metavar="[SCENARIO]", help="A YAML file, or a shipped scenario: {scenarios}.")
    ] = "",
    changes: SetOption = None,
) -> None:
    """Print all settings with their ranges, or a scenario's.

    The list is in Markdown. With SCENARIO it is the scenario as it is run, a YAML file with every default and with what
    follows from its robot.

    Example: `fivebar settings > settings.md`

    Example: `fivebar settings middle --set gains.kp=900`
    """
    from fivebar_bringup.reference.settings_page import settings_page
    from fivebar_bringup.scenarios.changes import read_changes
    from fivebar_bringup.scenarios.scenario_files import load_scenario

    with input_errors():
        if not scenario and changes:
            raise InputError("--set: expected with SCENARIO, whose keys it changes")
        text = load_scenario(scenario, changes=read_changes(changes)).to_yaml() if scenario else settings_page()
    print(text, end="")
