"""Subcommand that writes scenarios, robot files and programs in the newest format."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from fivebar_bringup.cli.app import app, input_errors
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenario_format import SCENARIO_RULES
from fivebar_control.planning.program import PROGRAM_RULES, Program
from fivebar_description.file_format import NEWEST, UNNAMED, Migrated, Rule, format_in
from fivebar_description.file_format import migrate as migrated_text
from fivebar_description.robot_file import ROBOT_RULES, RobotFile
from fivebar_description.strict_yaml import InputError, StrictModel, parse_yaml, read_text, validate

KINDS: dict[str, tuple[type[StrictModel], Sequence[Sequence[Rule]]]] = {
    "waypoints": (Scenario, SCENARIO_RULES),
    "lengths_m": (RobotFile, ROBOT_RULES),
    "steps": (Program, PROGRAM_RULES),
}
"""Model and rules by a key that only files of that kind have."""


@app.command()
def migrate(
    files: Annotated[
        list[Path], typer.Argument(metavar="FILE...", help="Scenarios, robot files and programs.", show_default=False)
    ],
    number: Annotated[
        int | None,
        typer.Option(
            "--from",
            min=0,
            max=NEWEST,
            help=f"The format of files that do not name theirs  [default: {UNNAMED}]",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Write FILE in the newest format, with its comments and in its place, and say what changed.

    A file that cannot be migrated stays as it is.

    Example: `fivebar migrate my_scenario.yaml --from 0`
    """
    for path in files:
        with input_errors():
            text = read_text(path)
            migrated = migrated_file(text, str(path), number)
            if migrated.text == text:
                print(f"{path}: is in format {NEWEST}")
                continue
            _replace(path, migrated.text)
            print("\n  ".join((f"{path}: now in format {NEWEST}", *migrated.changes)))


def migrated_file(text: str, source: str, number: int | None) -> Migrated:
    """Return a scenario, robot file or program in the newest format; `number` is the format of a file that names none.

    Raises:
        InputError: it is none of them, or not valid in the newest format either.
    """
    content = parse_yaml(text, source)
    kind = next((kind for key, kind in KINDS.items() if isinstance(content, dict) and key in content), None)
    if kind is None:
        raise InputError(
            f"{source}: expected a scenario, which has waypoints, a robot file, which has lengths_m, or a program with"
            " steps"
        )
    model, rules = kind
    named = format_in(content, source)
    if named is None:
        named = UNNAMED if number is None else number
    elif number not in (None, named):
        raise InputError(f"{source}: format: {named}: --from {number} says otherwise")
    migrated = migrated_text(text, source, named, rules)
    validate(parse_yaml(migrated.text, source), model, source)
    return migrated


def _replace(path: Path, text: str) -> None:
    """Write a file so that at every moment the old or the new one is there whole."""
    beside = path.with_name(f".{path.name}.new")
    try:
        beside.write_bytes(text.encode("utf-8"))
        beside.chmod(path.stat().st_mode)
        os.replace(beside, path.resolve())
    except OSError as error:
        beside.unlink(missing_ok=True)
        raise InputError(f"{path}: cannot be written: {error.strerror}") from error
