# SPDX-License-Identifier: Apache-2.0
"""Subcommand: odds."""

from __future__ import annotations

import json
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated

import typer

from fivebar_bringup.cli.app import COMPLETED, Group, JsonOption, ScenarioArgument, SetOption, command, input_errors
from fivebar_bringup.cli.printing import Printer
from fivebar_bringup.cli.progress import progress_bar
from fivebar_description.errors import InputError
from fivebar_description.interrupts import keyboard_interrupts

if TYPE_CHECKING:
    from fivebar_bringup.odds.robot_errors import RobotErrors
    from fivebar_bringup.scenario import Scenario


class Distribution(StrEnum):
    """Distributions of errors, as in `RobotErrors`."""

    UNIFORM = "uniform"
    NORMAL = "normal"


@command(Group.ROBOT)
def odds(
    scenario: ScenarioArgument,
    changes: SetOption = None,
    robots: Annotated[int, typer.Option(min=1, max=10_000, help="How many robots are drawn.")] = 100,
    limits: Annotated[
        bool,
        typer.Option(
            "--limits",
            help="Derive the limits of the estimator's watch: what sound robots exceed once in 10 000 crossings.",
        ),
    ] = False,
    distribution: Annotated[
        Distribution,
        typer.Option(
            help="How errors are distributed: evenly within their bounds, or normally, with standard deviations of half"
            " the bounds; loads are drawn evenly."
        ),
    ] = Distribution.UNIFORM,
    as_json: JsonOption = False,
) -> None:
    """Tell how likely a scenario is to succeed on drawn robots.

    Robots are drawn within the tolerances and loads of the robot's file, or of the scenario, by default each error
    uniform within its bound, and the motion is simulated on each. What the file declares no tolerance of is assumed.
    Then each uncertainty is taken away in turn, on the same robots.

    With `--limits` the robots make the motion without the limits of the estimator's watch, and a tail is fitted to the
    largest innovations of those that succeed: limits for the section `ekf` that a sound robot exceeds in less than one
    of 10 000 crossings.

    Example: `fivebar odds my_scenario.yaml --robots 200`
    """
    from fivebar_bringup.odds.relief import reliefs
    from fivebar_bringup.odds.robot_errors import assumed_words, declared_errors, not_drawn
    from fivebar_bringup.odds.trials import SEED, declared_odds, stated
    from fivebar_bringup.scenarios.changes import read_changes
    from fivebar_bringup.scenarios.scenario_files import load_scenario

    with input_errors(), keyboard_interrupts():
        loaded = load_scenario(scenario, changes=read_changes(changes))
        reason = not_drawn(loaded)
        if reason:
            raise InputError(f"{scenario}: {reason}")
        errors = declared_errors(loaded)._replace(distribution=distribution.value)
        if limits:
            _show_limits(loaded, errors, robots, as_json)
            raise typer.Exit(COMPLETED)
        with progress_bar("odds", as_json):
            declared = declared_odds(loaded, robots, distribution.value)
            better = reliefs(loaded, errors, SEED, stated(robots))
    if as_json:
        with_less = [{"with": relief.words, **relief.odds.as_dict()} for relief in better]
        drawn = {name: bound for name, bound in errors._asdict().items() if bound}
        print(json.dumps({"odds": declared.as_dict(), "bounds": drawn, "reliefs": with_less}, indent=2))
    else:
        lines = [
            str(declared),
            *(f"with {relief.words}: {relief.odds.successes} of {relief.odds.robots}" for relief in better),
        ]
        if not loaded.declares_errors:
            lines.insert(0, f"{loaded.robot} declares no errors; assumed: {assumed_words()}")
        Printer(soft_wrap=True).print("\n".join(lines), highlight=False)
    raise typer.Exit(COMPLETED)


def _show_limits(scenario: Scenario, errors: RobotErrors, robots: int, as_json: bool) -> None:
    from fivebar_bringup.odds.misfit_limits import FEWEST, as_settings, fitted_limits, sound_maxima
    from fivebar_bringup.odds.trials import SEED

    if not scenario.estimated:
        raise InputError(f"{scenario.name}: estimator: none has no watch: expected estimator: ekf")
    with progress_bar("odds --limits", as_json):
        maxima = sound_maxima(scenario, errors, SEED, range(robots))
    if len(maxima) < FEWEST:
        raise InputError(
            f"{scenario.name}: {len(maxima)} of {robots} drawn robots make the motion: expected at least {FEWEST}, to"
            " fit a tail to: more --robots, or a motion that more of them make"
        )
    limits = fitted_limits(maxima)
    settings = as_settings(limits)
    if as_json:
        print(
            json.dumps({"ekf": settings, "fits": {name: limit._asdict() for name, limit in limits.items()}}, indent=2)
        )
        return
    words = ", ".join(f"{name}: {value:g}" for name, value in settings.items())
    reached = ", ".join(f"{name} {limit.largest:.3g}" for name, limit in limits.items())
    lines = [f"ekf: {{{words}}}", f"largest of {len(maxima)} sound robots: {reached}"]
    Printer(soft_wrap=True).print("\n".join(lines), highlight=False)
