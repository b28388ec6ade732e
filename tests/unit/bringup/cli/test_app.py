"""What the subcommands share: the groups of the help, one line and an example for each command."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

from fivebar_bringup.cli.app import Group
from fivebar_bringup.cli.main import app

COMMANDS: dict[str, Any] = vars(typer.main.get_command(app))["commands"]


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
    printing = {"view", "play", "lecture", "settings", "urdf", "model"}
    assert {name for name in COMMANDS if "--json" not in options[name]} == printing


@pytest.mark.parametrize("command", ["play", "lecture"])
def test_a_place_that_cannot_be_written_is_refused_in_one_line(command: str, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    done = CliRunner().invoke(app, [command, "--out", str(tmp_path / "file" / "in" / "it")])
    assert (done.exit_code, done.stdout) == (2, "")
    (line,) = done.stderr.splitlines()
    assert line.endswith("cannot be used for the results: Not a directory")
