"""Subcommand that makes and checks robot files: robot."""

from __future__ import annotations

import json
import shlex
import sys
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import Annotated, TextIO

import typer

from fivebar_bringup.cli.app import COMPLETED, Group, JsonOption, command, input_errors
from fivebar_bringup.cli.printing import complain, say
from fivebar_description.errors import InputError
from fivebar_description.interrupts import keyboard_interrupts


class RobotAction(StrEnum):
    """An action on a robot file."""

    NEW = "new"
    CHECK = "check"


@command(Group.ROBOT)
def robot(
    action: Annotated[RobotAction, typer.Argument(help="Make a new file, or check one.")],
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The robot file, ending in .yaml.")],
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace a file that is there.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Make a robot file from answers, or check one.

    `new` asks for lengths, masses, drives, encoders, transmissions, sensors and tolerances. An empty line is the usual
    answer, which is shown in brackets; what cannot be is refused and asked again. Answers may also come from a file, a
    line each. Nothing is written before the last answer.

    Example: `fivebar robot new my_robot.yaml`

    Example: `fivebar robot check my_robot.yaml`
    """
    with input_errors(), keyboard_interrupts():
        if action is RobotAction.CHECK:
            if overwrite:
                raise InputError("--overwrite: expected with `new` only")
            name = _check(file)
            words = f"{file}: robot {name}: a valid robot file"
        else:
            name = _new(file, overwrite, sys.stderr if as_json else sys.stdout)
            words = f"wrote {file}: {shlex.join(('fivebar', 'assess', str(file)))} says what it can do"
    if as_json:
        print(json.dumps({"file": str(file), "robot": name}, indent=2))
    else:
        say(words)
    raise typer.Exit(COMPLETED)


def _check(file: Path) -> str:
    """Return the name of the robot of a file, which a study can be made of."""
    from fivebar_bringup.studies.map.map import read_mappable_robot
    from fivebar_bringup.studies.rigs.named import find_rig
    from fivebar_bringup.studies.rigs.rig import OF_ROBOT

    found = read_mappable_robot(str(file))
    find_rig(f"{OF_ROBOT}{file}")
    return found.name


def _new(file: Path, overwrite: bool, shown: TextIO) -> str:
    """Ask, write the file, and return the name of its robot."""
    from fivebar_bringup.robots.new_robot import asked, default_name, robot_text
    from fivebar_description.files import is_yaml_path, write_file

    if not is_yaml_path(str(file)):
        raise InputError(f"{file}: expected a name that ends in .yaml")
    if file.exists() and not overwrite:
        raise InputError(f"{file}: is there already: expected another name, or --overwrite")
    if not file.resolve().parent.is_dir():
        raise InputError(f"{file}: there is no such directory")
    name = default_name(file)
    text = robot_text(name, asked(partial(_ask, shown), complain))
    write_file(file, text)
    return name


def _ask(shown: TextIO, question: str) -> str:
    """Show a question and return the line that answers it; where nobody types, the answer is shown as well."""
    print(question, end="", file=shown, flush=True)
    line = sys.stdin.readline()
    if not sys.stdin.isatty():
        print(line.rstrip("\n"), file=shown)
    if not line:
        raise EOFError
    return line
