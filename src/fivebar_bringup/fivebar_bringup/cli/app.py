# SPDX-License-Identifier: Apache-2.0
"""Shared by the subcommands: the application, common options, exit statuses, errors and progress.

Modules of this package declare commands and load what these work with in their bodies, so that help, version and a
mistyped option need nothing of it.
"""

from __future__ import annotations

import os
import re
import signal
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from enum import StrEnum
from functools import cache
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup
from typer.main import get_group
from typer.models import CommandInfo

from fivebar_bringup.cli.printing import Printer, complain
from fivebar_bringup.cli.words import filled
from fivebar_bringup.errors import BagError
from fivebar_bringup.recorded.outcome import RunOutcome
from fivebar_description.errors import InputError
from fivebar_description.interrupts import ResumableInterrupt
from fivebar_description.modules import load_part
from fivebar_description.optional import COMMANDS, PACKAGE_OF, confirm_package, registered
from fivebar_description.ros_environment import HIGHEST_DOMAIN
from fivebar_description.suggestion import meant

if TYPE_CHECKING:
    from fivebar_bringup.recorded.run_directory import RunDirectory
    from fivebar_bringup.recorded.summary import Summary

COMPLETED, FAILED, BAD_INPUT = 0, 1, 2


class Group(StrEnum):
    """The groups in which the help lists the commands, in this order."""

    RUN = "Run"
    ROBOT = "My robot"
    STUDY = "Study"
    FILES = "Files"


MODULES = {
    "running": ("run", "simulate", "report", "nodes"),
    "status": ("status",),
    "goto": ("goto", "stand"),
    "program": ("program",),
    "map": ("map",),
    "robot": ("robot",),
    "calibrate": ("calibrate",),
    "identify": ("identify",),
    "odds": ("odds",),
    "posture": ("posture",),
    "guide": ("guide",),
    "settings": ("settings",),
    "urdf": ("urdf", "model"),
}
"""Modules of this folder and the subcommands that each declares when it is imported, in the order of the help."""


class Commands(TyperGroup):
    """All subcommands, those of the core and of optional packages; each is imported where it is asked for."""

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Return a subcommand, None where there is none; one that is not installed is refused."""
        module = next((module for module, names in MODULES.items() if cmd_name in names), None)
        if module is None:
            self._load_all()
        else:
            import_module(f"{__package__}.{module}")
            self.commands = get_group(app).commands
        if cmd_name not in self.commands and cmd_name in PACKAGE_OF:
            with input_errors():
                confirm_package(PACKAGE_OF[cmd_name], cmd_name)
        return super().get_command(ctx, cmd_name)

    def list_commands(self, ctx: Any) -> list[str]:
        """Return the names of all subcommands, as the help lists them."""
        self._load_all()
        return [*self.commands]

    def _load_all(self) -> None:
        """Import all of them; the help has them in the order of their groups, and within these in that of modules."""
        for module in MODULES:
            import_module(f"{__package__}.{module}")
        for entry in registered(COMMANDS):
            _load_further(entry.module)
        order = [name for names in MODULES.values() for name in names]
        places = {name: place for place, name in enumerate(order)}
        groups = [*Group]

        def place_of(declared: CommandInfo) -> tuple[int, int]:
            name = declared.name or getattr(declared.callback, "__name__", "")
            group = declared.rich_help_panel
            return groups.index(group) if group in groups else len(groups), places.get(str(name), len(places))

        app.registered_commands.sort(key=place_of)
        self.commands = get_group(app).commands

    def get_help_option(self, ctx: Any) -> Any:
        """Return the option `--help`, off where it is not given: to convert None typer would load pydantic."""
        option = super().get_help_option(ctx)
        if option is not None:
            option.default = False
        return option


@cache
def _load_further(module: str) -> None:
    """Import a module of an optional package; one that fails is named, and takes no other command along."""
    try:
        load_part(module)
    except InputError as error:
        complain(error)


app = typer.Typer(
    cls=Commands,
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="markdown",
    pretty_exceptions_enable=False,
)


NO_CHOICE = re.compile(r"'([^']*)' is not one of (.*)")
CHOICE = re.compile(r"'([^']*)'")
"""How a value that is no choice is refused, and one of the choices."""


def _question(name: str, known: Collection[str]) -> str:
    match = meant(name, known)
    return f" Did you mean {match}?" if match is not None else ""


IDLE = {"--scheduler": ("--jobs",), "--scheduler-file": ("--jobs",)}
"""Options of several commands without effect where another one is given, by that one."""


class Subcommand(TyperCommand):
    """A subcommand whose options' help has its words filled in where it is shown.

    Attributes:
        former: former names of its options, and the present ones.
        idle: options that have no effect where an option is given, by that option.
    """

    former: Mapping[str, str] = {}
    idle: Mapping[str, Collection[str]] = {}

    def help_filled(self) -> Subcommand:
        """Fill in the words, and return the command."""
        for parameter in self.params:
            text = getattr(parameter, "help", None)
            if text:
                vars(parameter)["help"] = filled(text)
        return self

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse the words of a call, and propose what may be meant by an option or a choice that does not exist."""
        args = [self._present(word) for word in args]
        self._refuse_unknown(ctx, args)
        try:
            rest: list[str] = super().parse_args(ctx, args)
            self._refuse_idle(ctx)
            return rest
        except typer.BadParameter as error:
            match = NO_CHOICE.search(error.message)
            if match:
                error.message += _question(match[1], CHOICE.findall(match[2]))
            raise

    def _present(self, word: str) -> str:
        """Return a word of a call with the present name of an option in place of a former one."""
        name, sign, value = word.partition("=")
        if name not in self.former:
            return word
        complain(f"{name} is deprecated: use {self.former[name]}")
        return f"{self.former[name]}{sign}{value}"

    def _refuse_idle(self, ctx: Any) -> None:
        """Refuse an option without effect beside another one that is given."""
        typed = {
            name
            for parameter in self.params
            if ctx.get_parameter_source(parameter.name).name == "COMMANDLINE"
            for name in ((ctx.params.get(parameter.name) is False and parameter.secondary_opts) or parameter.opts)
        }
        for option, others in self.idle.items():
            for other in others:
                if option in typed and other in typed:
                    complain(f"{other}: has no effect with {option}: give one of them")
                    raise typer.Exit(BAD_INPUT)

    def _refuse_unknown(self, ctx: Any, args: list[str]) -> None:
        """Refuse an option that is none, which where negative numbers are arguments would be taken for another one."""
        options = [option for parameter in self.params for option in parameter.opts + parameter.secondary_opts]
        options += ctx.help_option_names
        for word in args:
            name = word.partition("=")[0]
            if word == "--":
                return
            if name.startswith("--") and name not in options:
                ctx.fail(f"No such option: {name}.{_question(name, options)}")

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the help."""
        super(Subcommand, self.help_filled()).format_help(ctx, formatter)


def command(
    group: Group,
    name: str | None = None,
    former: Mapping[str, str] | None = None,
    idle: Mapping[str, Collection[str]] | None = None,
    **settings: Any,
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Return the decorator of a subcommand's function.

    Args:
        group: in the help.
        name: where it is not that of the function.
        former: former names of its options, and the present ones.
        idle: options that have no effect where an option is given, by that option.
        settings: as typer has them.
    """
    kind = type("Subcommand", (Subcommand,), {"former": former or {}, "idle": {**IDLE, **(idle or {})}})
    return app.command(name, cls=kind, rich_help_panel=group, **settings)


ScenarioArgument = Annotated[
    str, typer.Argument(metavar="SCENARIO", help="A YAML file, or a shipped scenario: {scenarios}.")
]
RobotArgument = Annotated[str, typer.Argument(metavar="[ROBOT]", help="A shipped robot, or a robot file (.yaml).")]
RobotOption = Annotated[str, typer.Option("--robot", metavar="ROBOT", help="The same as the argument ROBOT.")]
OutOption = Annotated[
    Path | None,
    typer.Option("--out", help="New or empty directory for the results [default: runs/SCENARIO-DATE-TIME]"),
]
SetOption = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Another value of a key of the scenario, such as unified.kp=900 or plant.friction.stribeck=1.3; may be"
        " repeated.",
    ),
]
NamespaceOption = Annotated[
    str, typer.Option(metavar="NAME", help="Namespace of all nodes, for several robots in one domain [default: none]")
]

RecordedNamespaceOption = Annotated[
    str | None,
    typer.Option(
        "--namespace", metavar="NAME", help="Namespace of the topics in the bag [default: the one that has the robot's]"
    ),
]
RealtimeOption = Annotated[
    bool, typer.Option("--realtime", help="Follow the clock instead of waiting for every node (lockstep).")
]
OwnDomainOption = Annotated[
    int | None,
    typer.Option(
        "--domain",
        min=0,
        max=HIGHEST_DOMAIN,
        help="ROS_DOMAIN_ID to use [default: a free one, for this run only]",
    ),
]
PageOption = Annotated[
    bool, typer.Option("--page/--no-page", help="Draw the figures and the page, or write summary and bag only.")
]
JobsOption = Annotated[
    int | None, typer.Option("--jobs", min=1, max=256, help="Processes to use. [default: one per processor]")
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print the result as JSON on standard output, nothing else.")]


def robot_of(argument: str, option: str) -> str:
    """Return the robot that is given as an argument or as an option, "" for none.

    Raises:
        InputError: both are given, and differ.
    """
    if argument and option and argument != option:
        raise InputError(f"--robot: {option}: expected without the argument ROBOT, which is {argument}")
    return argument or option


def processes_of(jobs: int | None) -> int:
    """Return how many processes to use: so many, or one per processor."""
    return jobs if jobs is not None else os.cpu_count() or 1


def _show_version(wanted: bool) -> None:
    if wanted:
        print(f"fivebar {version('fivebar_bringup')}")
        raise typer.Exit


@app.callback()
def _options(
    _: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    """Drive a five-bar parallel robot through its Type 2 singularities."""


@contextmanager
def input_errors() -> Iterator[None]:
    """Turn bad input into one line on standard error and exit status 2.

    An interrupt of what can be resumed says so in one line, and goes on. From here on any is a KeyboardInterrupt;
    before, while the command was loaded, it ended the process.
    """
    if signal.getsignal(signal.SIGINT) is signal.SIG_DFL:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        yield
    except (InputError, BagError) as error:
        complain(error)
        raise typer.Exit(BAD_INPUT) from error
    except ResumableInterrupt as interrupt:
        complain(interrupt)
        raise


def print_outcome(directory: RunDirectory, summary: Summary) -> None:
    """Print the end of a command that made a run: its figures, its files, what became of it, and what to look at."""
    from rich.text import Text

    from fivebar_bringup.report.outcome_words import outcome_details, outcome_rows

    page = directory.page.exists()
    shown = directory.page if page else directory.path
    files = ", ".join(str(path) for path in (directory.bag, directory.summary) if path.exists())
    rows = [*outcome_rows(summary), ("files", files)]
    if not page:
        rows.append(("page", f"`fivebar report {directory.path}` makes it"))
    printer = Printer()
    width = max(len(name) for name, _ in rows)
    for name, text in rows:
        printer.print(Text.assemble((f"{name:<{width}}  ", "dim"), text), soft_wrap=True)
    colour = {RunOutcome.SUCCEEDED: "green", RunOutcome.OFF_REFERENCE: "yellow"}.get(summary.outcome, "red")
    words = (
        (str(summary.outcome), colour),
        f"{outcome_details(summary)}: look at {shown}",
    )
    printer.print(Text.assemble(*words), soft_wrap=True)
