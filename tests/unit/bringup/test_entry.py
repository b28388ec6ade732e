# SPDX-License-Identifier: Apache-2.0
"""The entry point of the `fivebar` command: what it loads, and an interrupt while it does."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import fivebar

LIBRARIES = {
    "numpy", "scipy", "numba", "pinocchio", "matplotlib", "pydantic", "yaml", "ruamel", "rosbags", "mcap", "rclpy",
    "cv2", "mujoco", "toppra", "multiprocessing", "asyncio",
}  # fmt: skip
"""Packages that take long to load."""

LOADED = """
import contextlib, io, json, sys

import typer
from fivebar_bringup.cli.main import app

loaded = {}

def invoked(*words):
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        try:
            app(words)
        except SystemExit as exit:
            status = exit.code
    loaded[" ".join(words)] = status, sorted({name.partition(".")[0] for name in sys.modules})

invoked("--version")
invoked("--help")
invoked("--no-such-option")
invoked("no-such-command")
names = list(typer.main.get_command(app).commands)
# negative numbers are arguments of these, and so is an option that they do not have
for name in sorted(names, key=lambda name: name in ("goto", "posture")):
    invoked(name, "--no-such-option")
print(json.dumps(loaded))
"""

SIMULATED = """
import contextlib, io, json, sys
from fivebar_bringup.cli.main import app

with contextlib.redirect_stdout(io.StringIO()), contextlib.suppress(SystemExit):
    app(["simulate", "unified_middle", "--no-page", "--out", "{}"])
print(json.dumps([*sys.modules]))
"""

MOST_MODULES = 226
"""Modules of this project that a simulation without a page loads at most, without those that declare commands."""

NODES = [
    f"fivebar_control.nodes.{name}"
    for name in ("trajectory_generator", "supervisor", "ctc_controller", "vhc_controller", "blender", "imu_listener")
]

INTERRUPTED = """
import os, signal, sys

class Interrupting:
    def find_spec(self, name, path, target=None):
        if name == "fivebar_bringup.cli.main":
            os.kill(os.getpid(), signal.SIGINT)

signal.signal(signal.SIGINT, signal.{handler})
sys.meta_path.insert(0, Interrupting())
sys.argv = ["fivebar", "--help"]
from fivebar_bringup.cli.entry import main
main()
"""


@pytest.mark.parametrize(
    ("handler", "status", "shown"), [("default_int_handler", -signal.SIGINT, False), ("SIG_IGN", 0, True)]
)
def test_an_interrupt_while_the_command_loads_ends_it_without_a_traceback_unless_it_is_ignored(
    handler: str, status: int, shown: bool
) -> None:
    command = [sys.executable, "-c", INTERRUPTED.format(handler=handler)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert (done.returncode, done.stderr) == (status, "")
    assert ("crossing" in done.stdout) == shown


def loaded_by(program: str) -> Any:
    """Return what a program prints as JSON, run by itself."""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=120, check=True)
    return json.loads(done.stdout)


def long_to_load() -> set[str]:
    """Return the libraries but for those that every interpreter has: a .pth file makes the namespace of old ruamel."""
    return LIBRARIES - set(loaded_by("import json, sys; print(json.dumps([*sys.modules]))"))


def test_help_version_and_a_mistyped_option_load_no_library() -> None:
    loaded: dict[str, tuple[int, list[str]]] = loaded_by(LOADED)
    assert len(loaded) > 20
    libraries = long_to_load()
    for words, (status, names) in loaded.items():
        assert status == (0 if words in ("--version", "--help") else 2), words
        # typer converts numbers by pydantic, which a coordinate or an angle needs
        allowed = {"pydantic"} if words.startswith(("goto", "posture")) else set()
        assert set(names) & libraries <= allowed, words


def test_the_library_loads_what_is_asked_of_it() -> None:
    names = loaded_by("import fivebar, json, sys; print(json.dumps([*sys.modules]))")
    assert not {name.partition(".")[0] for name in names} & {*long_to_load(), "fivebar_bringup", "fivebar_control"}
    assert {getattr(fivebar, name).__name__ for name in fivebar.__all__} == set(fivebar.__all__) <= set(dir(fivebar))
    with pytest.raises(AttributeError, match="no_such_name"):
        fivebar.no_such_name  # noqa: B018


def test_a_simulation_without_a_page_loads_neither_compiler_nor_scipy_nor_matplotlib(tmp_path: Path) -> None:
    names = loaded_by(SIMULATED.format(tmp_path / "run"))
    assert not {name.partition(".")[0] for name in names} & {"numba", "scipy", "matplotlib", "rclpy", "cv2", "mujoco"}
    # nor what belongs to another plant, drives, studies or pages, and no more modules than a crossing needs
    others = (".mujoco", ".boards.", ".emulators.", ".studies.", ".odds.", ".pages.", ".live.", ".hardware.")
    own = {name for name in names if name.startswith("fivebar_") and not name.startswith("fivebar_bringup.cli.")}
    assert not {name for name in own if any(other in name for other in others)}
    assert len(own) <= MOST_MODULES


@pytest.mark.extra
def test_a_node_loads_neither_compiler_nor_scipy_nor_the_robot_of_the_plant() -> None:
    names = loaded_by(f"import json, sys, {', '.join(NODES)}; print(json.dumps([*sys.modules]))")
    assert not {name.partition(".")[0] for name in names} & {"numba", "scipy", "matplotlib", "pinocchio", "cv2"}
