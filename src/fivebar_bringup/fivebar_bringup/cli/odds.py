"""Subcommand: odds."""

from __future__ import annotations

import json
from typing import Annotated

import typer

from fivebar_bringup.cli.app import COMPLETED, Group, JsonOption, ScenarioArgument, command, input_errors
from fivebar_bringup.cli.printing import Printer
from fivebar_bringup.cli.progress import progress_bar
from fivebar_description.errors import InputError
from fivebar_description.interrupts import keyboard_interrupts


@command(Group.ROBOT)
def odds(
    scenario: ScenarioArgument,
    robots: Annotated[int, typer.Option(min=1, max=10_000, help="How many robots are drawn.")] = 100,
    as_json: JsonOption = False,
) -> None:
    """Tell how likely a scenario is to succeed on drawn robots.

    Robots are drawn within the tolerances and loads of the robot's file, or of the scenario, each error uniform within
    its bound, and the motion is simulated on each. What the file declares no tolerance of is assumed. Then each
    uncertainty is taken away in turn, on the same robots.

    Example: `fivebar odds my_scenario.yaml --robots 200`
    """
    from fivebar_bringup.odds.declared import SEED, declared_odds
    from fivebar_bringup.odds.drawn_robots import declared_errors, has_odds
    from fivebar_bringup.odds.relief import reliefs
    from fivebar_bringup.scenarios.scenario_files import load_scenario

    with input_errors(), keyboard_interrupts():
        loaded = load_scenario(scenario)
        if not has_odds(loaded):
            raise InputError(
                f"{scenario}: expected tolerances or loads, of the scenario or of its robot's file, without"
                " working_modes, stands and plant.engine: mujoco: there is nothing to draw robots from"
            )
        errors = declared_errors(loaded)
        with progress_bar("odds", as_json):
            found = declared_odds(loaded, robots)
            better = reliefs(loaded, errors, SEED, range(robots))
    if as_json:
        with_less = [{"with": one.words, **one.odds.as_dict()} for one in better]
        drawn = {name: bound for name, bound in errors._asdict().items() if bound}
        print(json.dumps({"odds": found.as_dict(), "bounds": drawn, "reliefs": with_less}, indent=2))
    else:
        lines = [str(found), *(f"with {one.words}: {one.odds.successes} of {one.odds.robots}" for one in better)]
        Printer(soft_wrap=True).print("\n".join(lines), highlight=False)
    raise typer.Exit(COMPLETED)
