# SPDX-License-Identifier: Apache-2.0
"""Subcommand that compares all controllers: compare."""

from __future__ import annotations

import math
from typing import Annotated

import typer
from rich.text import Text

from fivebar_bringup.cli.app import BAD_INPUT, Group, JobsOption, JsonOption, SetOption, command, input_errors
from fivebar_description.errors import InputError
from fivebar_description.interrupts import keyboard_interrupts
from fivebar_studies.cli.study_options import (
    Machines,
    SchedulerFileOption,
    SchedulerOption,
    StudyOutOption,
    StudyRobotOption,
    chosen_controllers,
    controllers_option,
    run_command,
    show_study,
)

LONGEST = 60.0
"""Duration of a segment (s) above which a typing error is more likely."""

COLOURS = {True: "green", False: "red", None: "yellow"}
WORDS = {True: "met", False: "not met", None: "not known"}


@command(Group.STUDY, former={"--controller": "--controllers", "--rigs": "--rig"})
def compare(
    scenarios: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[SCENARIO]...",
            help="YAML files or shipped scenarios, whose motions are run"
            " [default: middle multiple; middle with --robot]",
        ),
    ] = None,
    controllers: Annotated[str | None, controllers_option("all but path")] = None,
    durations: Annotated[
        str | None, typer.Option("--durations", help="Of every segment, in seconds [default: 0.5,1,2,3]")
    ] = None,
    rig: Annotated[
        str | None,
        typer.Option(
            "--rig",
            help="Some of {rigs}, paths of rig files, or as_given; without the errors that a sweep draws [default:"
            " ideal,wrong,encoders,realistic, the robot as its file declares it, and as_given where a scenario's plant"
            " is none of them]",
        ),
    ] = None,
    robot: StudyRobotOption = None,
    changes: SetOption = None,
    quick: Annotated[
        bool, typer.Option("--quick", help="By default only middle, 1 s, and the rigs ideal and realistic.")
    ] = False,
    out: StudyOutOption = None,
    jobs: JobsOption = None,
    scheduler: SchedulerOption = None,
    scheduler_file: SchedulerFileOption = None,
    as_json: JsonOption = False,
) -> None:
    """Run the same motions with every controller, side by side.

    It runs without ROS, and shows success, errors, torques, margins and energy. With `--robot` another robot makes the
    motions in proportion to its size, and is judged by its own torque and size. The exit status is 2 where a run could
    not be made with its controller.

    Example: `fivebar compare middle --durations 0.5,1 --rig ideal,realistic --out runs/compared`

    Example: `fivebar compare --robot my_robot.yaml --controllers unified,mpc`
    """
    from fivebar_bringup.recorded.outcome import RunOutcome
    from fivebar_bringup.scenarios.changes import (
        OF_STUDY,
        read_changes,
        refuse_changes_without_effect,
        refuse_decided,
    )
    from fivebar_studies.compare.cases import scenario_on
    from fivebar_studies.compare.compare import COMPARISON, cases_of
    from fivebar_studies.rigs.declared import robot_name

    with input_errors(), keyboard_interrupts():
        names = scenarios or (["middle"] if quick or robot else None)
        wanted = _durations(durations) if durations is not None else (1.0,) if quick else None
        own = "" if robot is None else robot_name(robot)
        settings = {
            "scenarios": None if names is None else tuple(names),
            "controllers": chosen_controllers(controllers),
            "durations": wanted,
            "rigs": _rigs(rig, quick),
            "robot": own or None,
            "changes": tuple(changes) if changes else None,
        }
        _refuse_namesakes([scenario_on(name, own).name for name in names or ()])
        if changes:
            decided = {**OF_STUDY, "segment_duration": "--durations"}
            refuse_decided(read_changes(changes), decided)
            cases = cases_of(COMPARISON.settings_with(settings)).asked
            refuse_changes_without_effect(read_changes(changes), (case.scenario() for case in cases))
        finished = run_command(COMPARISON.place, settings, out, Machines(jobs, scheduler, scheduler_file), as_json)
    verdicts, overview = finished.shown
    lines = [
        Text.assemble((WORDS[verdict.met], COLOURS[verdict.met]), f": {verdict.title}: {verdict.measured}")
        for verdict in verdicts
    ]
    stuck = [row for row in finished.rows if row.outcome == RunOutcome.COULD_NOT_RUN]
    reasons = {(row.controller, row.why_not): f"could not run: {row.controller}: {row.why_not}" for row in stuck}
    columns = ("rig", "controller", "succeeded", "refused", "could not run", "error", "applied", "saturated")
    show_study(finished, as_json, overview, columns, [*reasons.values(), *lines])
    if stuck:
        raise typer.Exit(BAD_INPUT)


def _rigs(text: str | None, quick: bool) -> tuple[str, ...] | None:
    """Return the rigs, None for the default ones.

    Raises:
        InputError: one of them is not known, or its file does not describe one.
    """
    from fivebar_studies.compare.cases import AS_GIVEN
    from fivebar_studies.rigs.named import named_rigs

    if text is None:
        return ("ideal", "realistic") if quick else None
    return named_rigs("--rig", text, (AS_GIVEN,))


def _durations(text: str) -> tuple[float, ...]:
    """Return durations (s) in order, each once.

    Raises:
        InputError: one of them is no duration.
    """
    durations = set()
    for part in text.split(","):
        try:
            duration = float(part)
        except ValueError:
            duration = math.nan
        if not 0.0 < duration <= LONGEST:
            raise InputError(
                f"--durations: {part.strip()!r}: expected seconds above 0 and up to {LONGEST:g}, separated by commas"
            )
        durations.add(duration)
    return tuple(sorted(durations))


def _refuse_namesakes(names: list[str]) -> None:
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"scenario {name!r}: is given more than once: expected scenarios with names of their own")
