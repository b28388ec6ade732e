# SPDX-License-Identifier: Apache-2.0
"""What the subcommands share: the groups of the help, one line and an example for each command."""

from __future__ import annotations

import re
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import pytest
import typer
from typer.main import get_group
from typer.testing import CliRunner

from fivebar_bringup.cli.app import MODULES, Group
from fivebar_bringup.cli.main import app
from fivebar_description.optional import PACKAGE_OF, registered

LAB_COMMANDS = '''
from fivebar_bringup.cli.app import Group, app, command


@command(Group.ROBOT)
def hello() -> None:
    """Greet."""


@app.command()
def plain() -> None:
    """Greet plainly."""
    print("good day")
'''

GROUP: Any = typer.main.get_command(app)
COMMANDS: dict[str, Any] = {name: GROUP.get_command(None, name) for name in GROUP.list_commands(None)}


def test_the_help_lists_every_command_in_a_group_on_one_line_of_a_narrow_terminal() -> None:
    shown = CliRunner().invoke(app, ["--help"], env={"COLUMNS": "80"}).stdout
    titles = re.findall(r"─ (\w[\w ]*?) ─", shown)
    assert titles == ["Options", *(str(group) for group in Group)]
    lines = re.findall(r"^│ ([a-z][a-z-]+) +(\S.*?) *│$", shown, re.MULTILINE)
    first = {name: command.help.partition("\n")[0] for name, command in COMMANDS.items()}
    assert dict(lines) == first
    assert lines[0][0] == "run"


def test_every_command_has_an_example_whose_options_it_has() -> None:
    for name, command in COMMANDS.items():
        examples = re.findall(rf"`fivebar {name}\b([^`]*)`", command.help)
        assert "Example: " in command.help and examples, name
        options = {option for parameter in command.params for option in parameter.opts}
        assert {option for one in examples for option in re.findall(r"--[a-z-]+", one)} <= options, name


@pytest.mark.parametrize(
    ("words", "meant"),
    [
        (["simulate", "middle", "--outt", "x"], "--out"),
        # negative numbers are arguments of these two
        (["goto", "0", "-0.02", "--fastes"], "--fastest"),
        (["goto", "0", "-0.02", "--durations=1"], "--duration"),
        (["posture", "-1.2", "1.9", "--robots", "dextar"], "--robot"),
        (["run", "middle", "--hardware", "emulatd"], "emulated"),
        (["sweep", "--rig", "midling"], "middling"),
        (["compare", "--controllers", "ctc,unifid"], "unified"),
        (["robustness", "--effects", "length"], "lengths"),
    ],
)
def test_a_mistyped_option_or_name_is_answered_with_what_is_meant(words: list[str], meant: str) -> None:
    done = CliRunner().invoke(app, words, env={"COLUMNS": "200"})
    assert (done.exit_code, done.stdout) == (2, "")
    assert re.search(rf"[Dd]id you mean {meant}\?", done.stderr), done.stderr


def test_options_that_mean_the_same_are_called_the_same() -> None:
    options = {
        name: {one for parameter in command.params for one in parameter.opts} for name, command in COMMANDS.items()
    }
    for name in ("compare", "sweep", "benchmark"):
        assert "--controllers" in options[name] and "--controller" not in options[name], name
        done = CliRunner().invoke(app, [name, "--controller=nobody"])
        assert done.exit_code == 2
        complaint, error = done.stderr.splitlines()
        assert complaint == "fivebar: --controller is deprecated: use --controllers"
        assert error.startswith("fivebar: --controllers: 'nobody': ")
    for name in ("compare", "sweep", "benchmark", "robustness"):
        assert "--jobs" in options[name], name
    printing = {"view", "play", "settings", "urdf", "model"}
    assert {name for name in COMMANDS if "--json" not in options[name]} == printing


def test_a_place_that_cannot_be_written_is_refused_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    done = CliRunner().invoke(app, ["play", "--out", str(tmp_path / "file" / "in" / "it")])
    assert (done.exit_code, done.stdout) == (2, "")
    (line,) = done.stderr.splitlines()
    assert line.endswith("cannot be used for the results: Not a directory")


def test_each_module_declares_the_commands_that_are_listed_for_it() -> None:
    get_group(app).list_commands(None)
    declared: dict[str, list[str]] = {}
    for one in app.registered_commands:
        package, _, module = str(one.callback.__module__).rpartition(".")
        if package == "fivebar_bringup.cli":
            declared.setdefault(module, []).append(one.name or one.callback.__name__)
    assert {module: sorted(names) for module, names in declared.items()} == {
        module: sorted(names) for module, names in MODULES.items()
    }


def test_without_optional_packages_the_core_helps_and_refuses_their_commands(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever the distribution registers of packages that were left out of it."""
    GROUP.list_commands(None)
    core = [one for one in app.registered_commands if str(one.callback.__module__).startswith("fivebar_bringup.")]
    monkeypatch.setattr(app, "registered_commands", core)
    monkeypatch.setattr("fivebar_description.optional.find_spec", lambda name: None)
    monkeypatch.setattr("fivebar_bringup.cli.app.registered", registered.__wrapped__)
    shown = CliRunner().invoke(app, ["--help"])
    assert shown.exit_code == 0
    assert "simulate" in shown.stdout and "sweep" not in shown.stdout
    for name, package in PACKAGE_OF.items():
        done = CliRunner().invoke(app, [name, "--help"])
        refusal = f"needs the package {package}, which is not installed: pip install fivebar, or make setup in a clone"
        assert (done.exit_code, done.stderr) == (2, f"fivebar: {name}: {refusal}\n")


def test_a_package_adds_a_command_in_a_group_or_without_one(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "lab_commands.py").write_text(LAB_COMMANDS, encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(app, "registered_commands", [*app.registered_commands])
    lab = EntryPoint("lab", "lab_commands", "fivebar.commands")
    monkeypatch.setattr("fivebar_bringup.cli.app.registered", lambda group: [*registered(group), lab])
    shown = CliRunner().invoke(app, ["--help"], env={"COLUMNS": "80"}).stdout
    assert re.search(r"─ My robot ─+╮[^╭]*│ hello +Greet\.", shown)
    assert re.search(r"─ Commands ─+╮[^╭]*│ plain +Greet plainly\.", shown)
    assert CliRunner().invoke(app, ["plain"]).stdout == "good day\n"


def test_a_package_that_cannot_be_imported_is_named_and_takes_no_command_along(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "broken_commands.py").write_text("import no_such_module\n", encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    broken = EntryPoint("lab", "broken_commands", "fivebar.commands")
    monkeypatch.setattr("fivebar_bringup.cli.app.registered", lambda group: [broken, *registered(group)])
    done = CliRunner().invoke(app, ["sweep", "--help"])
    assert done.exit_code == 0
    assert "fivebar sweep" in done.stdout
    assert done.stderr == "fivebar: broken_commands: cannot be loaded: No module named 'no_such_module'\n"
