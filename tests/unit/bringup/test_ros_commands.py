# SPDX-License-Identifier: Apache-2.0
"""Every command that starts ROS checks the environment first: one line, exit status 2, and nothing has been started."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from fivebar_bringup.cli.main import app
from fivebar_bringup.cli.status import graph_domain
from fivebar_bringup.drives.hardware import Hardware
from fivebar_bringup.graph.node_spec import Mode
from fivebar_bringup.runs.launching import run_command
from fivebar_description.errors import InputError

COMMANDS = (
    ("run", "middle", "--domain", "46"),
    ("run", "middle_robot", "--hardware", "socketcan", "--drives", "dextar_socketcan"),
    ("stand",),
    ("goto", "0", "0.1", "--ros"),
    ("goto", "0", "0.1", "--live"),
    ("program", "pick_and_place"),
    ("status",),
    ("view",),
)

WRONG = {
    "RMW_IMPLEMENTATION": "rmw_elsewhere_cpp",
    "ROS_DOMAIN_ID": "banana",
    "ROS_LOG_DIR": "/dev/null/logs",
}


@pytest.mark.parametrize("words", COMMANDS, ids=" ".join)
def test_a_wrong_environment_is_refused(
    words: tuple[str, ...], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    for variable, value in WRONG.items():
        monkeypatch.setenv(variable, value)
        result = CliRunner().invoke(app, words)
        assert result.exit_code == 2
        assert result.stderr.startswith(f"fivebar: {variable}: '{value}': ")
        assert len(result.stderr.splitlines()) == 1
        monkeypatch.delenv(variable)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("words", [("goto", "0", "0.1", "--plan-only"), ("program", "pick_and_place", "--dry-run")])
def test_what_starts_no_ros_does_not_care(words: tuple[str, ...], monkeypatch: pytest.MonkeyPatch) -> None:
    for variable, value in WRONG.items():
        monkeypatch.setenv(variable, value)
    assert CliRunner().invoke(app, words).exit_code == 0


def test_a_node_names_the_middleware_that_is_missing() -> None:
    command = [sys.executable, "-m", "fivebar_control.nodes.supervisor"]
    result = subprocess.run(
        command, env={"RMW_IMPLEMENTATION": "rmw_elsewhere_cpp"}, capture_output=True, text=True, check=False
    )
    assert result.returncode == 2
    assert result.stderr.startswith("RMW_IMPLEMENTATION: 'rmw_elsewhere_cpp': ")
    assert len(result.stderr.splitlines()) == 1


def test_a_launch_file_refuses_a_wrong_domain() -> None:
    with pytest.raises(InputError, match=r"^ROS_DOMAIN_ID: 'banana'"):
        run_command("middle", Mode.LOCKSTEP, "", Hardware.SIMULATED, {"ROS_DOMAIN_ID": "banana"})


def test_a_goal_goes_to_the_domain_of_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    """Also where a run goes on in a domain of its own, which `status` then shows."""
    monkeypatch.setattr("fivebar_bringup.cli.status.held_domains", lambda: [33])
    monkeypatch.setenv("ROS_DOMAIN_ID", "7")
    assert (graph_domain(None), graph_domain(None, environment_first=True)) == (33, 7)
    assert graph_domain(9, environment_first=True) == 9
    monkeypatch.delenv("ROS_DOMAIN_ID")
    assert graph_domain(None, environment_first=True) == 33
