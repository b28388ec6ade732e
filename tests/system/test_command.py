# SPDX-License-Identifier: Apache-2.0
"""The command's help, and what it says to bad input."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

import pytest
from fivebar_command import FivebarCommand, InstalledCommand
from typer.main import get_group
from typer.testing import CliRunner

from fivebar_bringup.cli.main import app

SUBCOMMANDS = sorted(get_group(app).list_commands(None))

GOOD = "name: mine\nwaypoints: [[0.0, 0.15], [0.0, 0.02]]\n"
BAD_FILES = {
    "broken": ("name: [mine\n", r"broken\.yaml: is not valid YAML: "),
    "unknown_key": (f"{GOOD}speed: 3\n", r"unknown_key\.yaml: speed: unknown key"),
    "wrong_type": (f"{GOOD}rate_hz: fast\n", r"wrong_type\.yaml: rate_hz: 'fast': "),
    "rate": (f"{GOOD}rate_hz: 700\n", r"rate\.yaml: rate_hz: 700: expected a rate that divides 1e9"),
    "far": (
        "name: mine\nwaypoints: [[0.0, 0.15], [0.3, 0.15]]\n",
        r"far\.yaml: segment 1: \(0\.3000, 0\.1500\) m is out of reach of leg 1 by \d+\.\d+ mm",
    ),
    "robot": (f"{GOOD}robot: hexapod\n", r"robot 'hexapod': expected one of dextar, motkin, motkin_vertical, unequal"),
}


@pytest.fixture(scope="module")
def forked(fivebar: Callable[..., FivebarCommand]) -> FivebarCommand:
    """The help of the command."""
    call = fivebar("--help")
    call.finish()
    return call


def test_the_installed_command_is_this_one(folder: Path, forked: FivebarCommand) -> None:
    installed = InstalledCommand(folder / "installed", "--help")
    assert installed.finish() == 0
    assert (installed.stdout, installed.stderr) == (forked.stdout, "")


def test_there_are_subcommands() -> None:
    assert {"run", "simulate", "report", "nodes"} <= set(SUBCOMMANDS)


def test_help_names_every_subcommand(forked: FivebarCommand) -> None:
    assert forked.status == 0
    assert forked.stderr == ""
    assert all(re.search(rf"\b{name}\b", forked.stdout) for name in SUBCOMMANDS)


@pytest.mark.parametrize("name", SUBCOMMANDS)
def test_help_of_a_subcommand_has_an_example(name: str) -> None:
    shown = CliRunner().invoke(app, [name, "--help"])
    assert shown.exit_code == 0
    words = " ".join(re.sub(r"[│╭╮╰╯─]", " ", shown.stdout).split())
    assert f"Example: fivebar {name}" in words
    assert shown.stderr == ""


@pytest.fixture(scope="module")
def refused(fivebar: Callable[..., FivebarCommand], folder: Path) -> dict[str, FivebarCommand]:
    """Calls with bad input, all at once."""
    calls = {}
    for index, (name, (content, _)) in enumerate(BAD_FILES.items()):
        path = folder / f"{name}.yaml"
        path.write_text(content, encoding="utf-8")
        calls[name] = fivebar(("run", "simulate", "nodes")[index % 3], str(path))
    occupied = folder / "occupied"
    occupied.mkdir()
    (occupied / "note.txt").write_text("mine", encoding="utf-8")
    (folder / "file").write_text("mine", encoding="utf-8")
    calls["no_scenario"] = fivebar("run", "no_such_scenario")
    calls["no_file"] = fivebar("simulate", "nowhere.yaml")
    calls["occupied_run"] = fivebar("run", "middle", "--out", str(occupied))
    calls["occupied_simulate"] = fivebar("simulate", "middle", "--json", "--out", str(occupied))
    calls["out_is_file"] = fivebar("simulate", "middle", "--out", str(folder / "file"))
    calls["no_run"] = fivebar("report", str(occupied))
    for call in calls.values():
        call.finish()
    assert [path.name for path in occupied.iterdir()] == ["note.txt"]
    return calls


EXPECTED = {
    **{name: expected for name, (_, expected) in BAD_FILES.items()},
    "no_scenario": r"scenario 'no_such_scenario': expected one of .*middle, or a path to a \.yaml file",
    "no_file": r"nowhere\.yaml: cannot be read: No such file or directory",
    "occupied_run": r"occupied: is not empty",
    "occupied_simulate": r"occupied: is not empty",
    "out_is_file": r"file: cannot be used for the results: ",
    "no_run": r"occupied: is not a run directory",
}


@pytest.mark.parametrize("name", EXPECTED)
def test_bad_input_is_answered_in_one_line(refused: dict[str, FivebarCommand], name: str) -> None:
    call = refused[name]
    assert call.status == 2
    lines = call.stderr.splitlines()
    assert len(lines) == 1, call.stderr
    assert lines[0].startswith("fivebar: ")
    assert re.search(EXPECTED[name], lines[0]), lines[0]
    assert call.stdout == ""
    # nothing is left in the folder from which the command was called
    assert not (call.folder / "runs").exists()


def test_nodes_are_listed(fivebar: Callable[..., FivebarCommand]) -> None:
    table, listing = fivebar("nodes", "ctc_middle"), fivebar("nodes", "ctc_middle", "--json")
    assert (table.finish(), listing.finish()) == (0, 0)
    names = [node["node"] for node in json.loads(listing.stdout)]
    assert "ctc_controller" in names
    assert "vhc_controller" not in names
    assert all(name in table.stdout for name in names)
