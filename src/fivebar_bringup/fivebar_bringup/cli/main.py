"""The `fivebar` command: every module of this package adds its subcommands when it is imported."""

from __future__ import annotations

import os
import sys
from contextlib import suppress
from importlib import import_module

from typer.models import CommandInfo

from fivebar_bringup.cli.app import BAD_INPUT, FAILED, Group, app
from fivebar_bringup.cli.exhaustion import exhaustion
from fivebar_bringup.cli.printing import accept_any_character, complain, flush, open_closed_streams

MODULES = (
    *("running", "goto", "program", "viewing", "status", "play"),
    *("studies", "robot", "assess", "calibrate", "identify", "estimate"),
    *("odds", "commission", "posture", "guide", "camera"),
    *("compare", "sweep", "robustness", "benchmark", "results", "lecture"),
    *("settings", "urdf"),
)
"""Modules that declare commands, in the order in which the help lists these within their groups."""


def _place(declared: CommandInfo) -> tuple[int, int]:
    """Return where the help lists a command: its group, and its module."""
    assert declared.callback is not None
    module = declared.callback.__module__.rpartition(".")[2]
    return [*Group].index(Group(str(declared.rich_help_panel))), MODULES.index(module)


for module in MODULES:
    import_module(f"{__package__}.{module}")
app.registered_commands.sort(key=_place)


def main() -> None:
    """Run the command; what the operating system refuses, such as a full disk, is one line and exit status 2."""
    open_closed_streams()
    accept_any_character()
    try:
        try:
            app()
        finally:
            flush(sys.stdout)
    except BrokenPipeError:
        _discard_output()
        sys.exit(FAILED)
    except OSError as error:
        _discard_output()
        exhausted = exhaustion(error)
        if exhausted is not None:
            complain(exhausted)
            sys.exit(BAD_INPUT)
        place = (
            f"{os.fsdecode(error.filename)}: "
            if isinstance(error.filename, str | bytes)
            else "a file or the output cannot be written: "
        )
        complain(f"{place}{error.strerror or error}")
        sys.exit(BAD_INPUT)
    except (MemoryError, ImportError, RuntimeError) as error:
        exhausted = exhaustion(error)
        if exhausted is None:
            raise
        complain(exhausted)
        sys.stderr.flush()
        # at once: at the exit of an interpreter without memory, libraries may end in a segmentation fault
        os._exit(BAD_INPUT)


def _discard_output() -> None:
    """Keep the interpreter from writing at its exit what could not be written."""
    # where no more files can be opened, nothing more is written either
    with suppress(OSError), open(os.devnull, "wb") as nowhere:
        os.dup2(nowhere.fileno(), 1)


if __name__ == "__main__":
    main()
