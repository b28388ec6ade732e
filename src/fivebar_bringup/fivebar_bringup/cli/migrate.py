"""Subcommand that writes scenarios, robot files and programs in the newest format."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fivebar_bringup.cli.app import command, input_errors
from fivebar_bringup.cli.printing import say


@command()
def migrate(
    files: Annotated[
        list[Path], typer.Argument(metavar="FILE...", help="Scenarios, robot files and programs.", show_default=False)
    ],
    number: Annotated[
        int | None,
        typer.Option(
            "--from",
            min=0,
            max=1,
            help="The format of files that do not name theirs  [default: {unnamed_format}]",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Write FILE in the newest format, with its comments and in its place, and say what changed.

    A file that cannot be migrated stays as it is.

    Example: `fivebar migrate my_scenario.yaml --from 0`
    """
    from fivebar_bringup.migration import migrated_file
    from fivebar_description.file_format import NEWEST
    from fivebar_description.text_file import read_text, write_file

    for path in files:
        with input_errors():
            text = read_text(path)
            migrated = migrated_file(text, str(path), number)
            if migrated.text == text:
                say(f"{path}: is in format {NEWEST}")
                continue
            write_file(path, migrated.text)
            say(f"{path}: now in format {NEWEST}")
            for change in migrated.changes:
                say(f"  {change}")
