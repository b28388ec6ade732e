"""Subcommand that writes scenarios, robot files and programs in the newest format."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer

from fivebar_bringup.cli.app import command, input_errors
from fivebar_description.errors import InputError


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
    from fivebar_description.strict_yaml import read_text

    for path in files:
        with input_errors():
            text = read_text(path)
            migrated = migrated_file(text, str(path), number)
            if migrated.text == text:
                print(f"{path}: is in format {NEWEST}")
                continue
            _replace(path, migrated.text)
            print("\n  ".join((f"{path}: now in format {NEWEST}", *migrated.changes)))


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
