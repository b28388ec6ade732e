# SPDX-License-Identifier: Apache-2.0
"""Subcommand that makes and checks robot files: robot."""

from __future__ import annotations

import json
import shlex
import sys
from enum import StrEnum
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
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
    urdf: Annotated[
        Path | None, typer.Option("--urdf", metavar="FILE", help="With `new`: read the robot from a URDF, ask nothing.")
    ] = None,
    motors: Annotated[
        str | None, typer.Option("--motors", metavar="A,B", help="Joints of its motors, left and right.")
    ] = None,
    passive: Annotated[str | None, typer.Option("--passive", metavar="A,B", help="Its passive joints.")] = None,
    tips: Annotated[
        str | None, typer.Option("--tips", metavar="A,B", help="Links or frames at the ends of both legs, which meet.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Make a robot file from answers, or check one.

    `new` asks for lengths, masses, drives, encoders, transmissions, sensors and tolerances. An empty line is the usual
    answer, which is shown in brackets, and `<` goes back a question; what cannot be is refused and asked again. Answers
    may also come from a file, a line each. Nothing is written before the last answer, and what is written passes
    `check`.

    `new --urdf` reads lengths, masses, inertias, limits and the zeros of the joints from a URDF, and says what a URDF
    does not tell. Its loop is given by names: those of `fivebar model`, `motor_1`, `passive_1`, `tip_1` and so on, or
    by options.

    Example: `fivebar robot new my_robot.yaml`

    Example: `fivebar robot new bench.yaml --urdf bench.urdf --tips coupler_1_end,coupler_2_end`

    Example: `fivebar robot check my_robot.yaml`
    """
    with input_errors(), keyboard_interrupts():
        if action is RobotAction.CHECK:
            options = {
                "--overwrite": overwrite,
                "--urdf": urdf,
                "--motors": motors,
                "--passive": passive,
                "--tips": tips,
            }
            for option in (name for name, value in options.items() if value):
                raise InputError(f"{option}: expected with `new` only")
            name = check_file(file)
            words = f"{file}: robot {name}: a valid robot file"
        else:
            shown = sys.stderr if as_json else sys.stdout
            names = {"motors": motors, "passive": passive, "tips": tips}
            name = _new(file, overwrite, shown, urdf, {key: _pair(key, value) for key, value in names.items() if value})
            words = f"wrote {file}: {shlex.join(('fivebar', 'assess', str(file)))} says what it can do"
    if as_json:
        print(json.dumps({"file": str(file), "robot": name}, indent=2))
    else:
        say(words)
    raise typer.Exit(COMPLETED)


def check_file(file: Path) -> str:
    """Return the name of the robot of a file, which can be mapped, and simulated by a scenario."""
    from fivebar_bringup.map.map import read_mappable_robot
    from fivebar_bringup.robots.check import check_simulated

    robot_file = read_mappable_robot(str(file))
    check_simulated(str(file))
    return robot_file.name


def _pair(option: str, text: str) -> tuple[str, str]:
    parts = text.split(",")
    if len(parts) != 2 or not all(parts) or parts[0] == parts[1]:
        raise InputError(f"--{option}: {text!r}: expected two different names, such as left,right")
    return parts[0], parts[1]


def _new(file: Path, overwrite: bool, shown: TextIO, urdf: Path | None, names: dict[str, tuple[str, str]]) -> str:
    """Ask, or read a URDF, write the file, and return the name of its robot."""
    from fivebar_bringup.robots.new_robot import default_name, new_robot
    from fivebar_description.files import is_yaml_path, write_file

    if not is_yaml_path(str(file)):
        raise InputError(f"{file}: expected a name that ends in .yaml")
    if file.exists() and not overwrite:
        raise InputError(f"{file}: is there already: expected another name, or --overwrite")
    if not file.resolve().parent.is_dir():
        raise InputError(f"{file}: there is no such directory")
    name = default_name(file)
    if urdf is not None:
        # here, because it loads Pinocchio
        from fivebar_bringup.robots.from_urdf import robot_from_urdf
        from fivebar_description.files import read_text

        described = robot_from_urdf(read_text(urdf), str(urdf), name, names)
        check_text(file.name, described.text)
        write_file(file, described.text)
        for line in described.untold:
            print(f"not in the URDF: {line}", file=shown)
        return name
    for option in names:
        raise InputError(f"--{option}: expected with --urdf")
    print("an empty line is the answer in brackets, < goes back a question", file=shown)
    write_file(file, new_robot(name, partial(_ask, shown), complain, partial(check_text, file.name)))
    return name


def check_text(name: str, text: str) -> None:
    """Check the text of a robot file that is to have a name, before it is written.

    Raises:
        InputError: `robot check` would refuse it.
    """
    with TemporaryDirectory() as directory:
        path = Path(directory, name)
        path.write_text(text, encoding="utf-8")
        try:
            check_file(path)
        except InputError as error:
            raise InputError(str(error).removeprefix(f"{path}: ")) from error


def _ask(shown: TextIO, question: str) -> str:
    """Show a question and return the line that answers it; where nobody types, the answer is shown as well."""
    print(question, end="", file=shown, flush=True)
    line = sys.stdin.readline()
    if not sys.stdin.isatty():
        print(line.rstrip("\n"), file=shown)
    if not line:
        raise EOFError
    return line
