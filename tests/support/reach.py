# SPDX-License-Identifier: Apache-2.0
"""Counts what commands and nodes load and execute of the packages: `make reach`.

Each Python process of a command notes at its end which of our modules it has loaded, and which of our functions it has
called. Files and lines are those of all its processes together; a function counts with the lines from its first to its
last. Libraries do not count, and neither does compiled code, which is compiled in the first run before the counted one.

Usage: reach.py [NAME ...] [--modules], by default all; `--modules` lists the modules, those first of which no function
was called.
"""

from __future__ import annotations

import argparse
import ast
import functools
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

SOURCE = Path(__file__).resolve().parents[2] / "src"

LONGEST = 300.0
"""Time (s) that a command may take."""

NOTES = "FIVEBAR_REACH"
"""Environment variable with the folder into which each process writes what it has loaded and called."""

NOTING = f"""
import atexit, json, os, sys, threading

SOURCE, called = {f"{SOURCE}/"!r}, set()

def note(frame, event, argument):
    if event == "call" and frame.f_code.co_filename.startswith(SOURCE):
        called.add((frame.f_code.co_filename, frame.f_code.co_firstlineno))

def write():
    sys.setprofile(None)
    files = sorted({{str(getattr(one, "__file__", None)) for one in list(sys.modules.values())}})
    content = {{"files": [one for one in files if one.startswith(SOURCE)], "called": sorted(called)}}
    with open(os.path.join(os.environ[{NOTES!r}], f"{{os.getpid()}}.json"), "w") as file:
        json.dump(content, file)

def end(status, leave=os._exit):
    write()
    leave(status)

os._exit = end
atexit.register(write)
threading.setprofile(note)
sys.setprofile(note)
"""
"""What Python executes before anything else in each process that is counted."""

NODE = """
import rclpy
from {module} import {node}

rclpy.init(args=["--ros-args", "-p", "{parameter}"])
{node}().destroy_node()
rclpy.try_shutdown()
"""
"""Makes one node of `middle`, and ends."""

NODES = {
    "trajectory_generator": "fivebar_control.nodes.trajectory_generator:TrajectoryGenerator",
    "supervisor": "fivebar_control.nodes.supervisor:SupervisorNode",
    "ctc_controller": "fivebar_control.nodes.ctc_controller:CtcController",
    "vhc_controller": "fivebar_control.nodes.vhc_controller:VhcController",
    "blender": "fivebar_control.nodes.blender:Blender",
    "plant": "fivebar_sim.nodes.plant:PlantNode",
    "imu_listener": "fivebar_control.nodes.imu_listener:ImuListener",
    "bag_recorder": "fivebar_bringup.nodes.bag_recorder:BagRecorder",
}

FIVEBAR = [sys.executable, "-m", "fivebar_bringup.cli.entry"]

COMMANDS = {
    "simulate": [*FIVEBAR, "simulate", "middle", "--no-page"],
    "run": [*FIVEBAR, "run", "middle", "--no-page"],
    "goto": [*FIVEBAR, "goto", "0", "0.02", "--mode=-", "--no-page"],
}
"""The commands, without the folder for their results."""

TOGETHER = "run, simulate and goto together"


class Reach(NamedTuple):
    """Files that were loaded, and functions that were called, each by file and first line."""

    files: frozenset[str]
    functions: frozenset[tuple[str, int]]

    @property
    def lines(self) -> int:
        """Lines of the files."""
        return sum(len(_text(file).splitlines()) for file in self.files)

    @property
    def called_lines(self) -> int:
        """Lines of the functions."""
        return sum(extents(file).get(line, 0) for file, line in self.functions)

    @property
    def named(self) -> frozenset[tuple[str, int]]:
        """The functions without comprehensions and lambdas, which belong to others."""
        return frozenset(one for one in self.functions if one[1] in extents(one[0]))

    def with_others(self, other: Reach) -> Reach:
        """Return both together."""
        return Reach(self.files | other.files, self.functions | other.functions)


NOTHING = Reach(frozenset(), frozenset())


@functools.cache
def _text(file: str) -> str:
    return Path(file).read_text(encoding="utf-8")


@functools.cache
def extents(file: str) -> dict[int, int]:
    """Return the number of lines of each function of a file, by its first line, which is that of a decorator."""

    def functions() -> Iterator[tuple[int, int]]:
        for node in ast.walk(ast.parse(_text(file))):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                first = min([node.lineno, *(one.lineno for one in node.decorator_list)])
                yield first, (node.end_lineno or first) - first + 1

    return dict(functions())


def command_of(name: str, folder: Path) -> list[str]:
    """Return the command of a name, with its results in a folder."""
    if name in COMMANDS:
        return [*COMMANDS[name], "--out", str(folder / "results")]
    module, _, node = NODES[name].partition(":")
    parameter = f"directory:={folder / 'bag'}" if name == "bag_recorder" else "scenario:=middle"
    return [sys.executable, "-c", NODE.format(module=module, node=node, parameter=parameter)]


@functools.cache
def reach(name: str) -> Reach:
    """Return what a command or a node reaches.

    Raises:
        RuntimeError: it fails.
    """
    if name == TOGETHER:
        return functools.reduce(Reach.with_others, map(reach, COMMANDS))
    with tempfile.TemporaryDirectory() as place:
        notes, first = Path(place, "notes"), Path(place, "first")
        for folder in (notes, first):
            folder.mkdir()
        Path(first, "sitecustomize.py").write_text(NOTING, encoding="utf-8")
        path = os.pathsep.join([str(first), *filter(None, [os.environ.get("PYTHONPATH")])])
        environment = {**os.environ, "PYTHONPATH": path, NOTES: str(notes)}
        made = subprocess.run(
            command_of(name, Path(place)), env=environment, capture_output=True, text=True, timeout=LONGEST, check=False
        )
        if made.returncode != 0:
            raise RuntimeError(f"{name}: exit status {made.returncode}: {made.stderr.strip()}")
        found = [json.loads(file.read_text(encoding="utf-8")) for file in notes.iterdir()]
    files = frozenset(file for one in found for file in one["files"])
    return Reach(files, frozenset((file, line) for one in found for file, line in one["called"]))


def main() -> None:
    """Print a table of what each reaches."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    known = [*COMMANDS, TOGETHER, *NODES]
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(known)}; by default all")
    parser.add_argument("--modules", action="store_true", help="list the modules that were loaded")
    given = parser.parse_args()
    if unknown := [name for name in given.names if name not in known]:
        parser.error(f"{', '.join(unknown)}: expected {', '.join(known)}")
    print("| what | files | lines | functions called | their lines | files without a call | their lines |")
    print("|---|---|---|---|---|---|---|")
    for name in given.names or known:
        found = reach(name)
        called = {file for file, _ in found.named}
        idle = Reach(found.files - called, frozenset())
        print(
            f"| {name} | {len(found.files)} | {found.lines} | {len(found.named)} | {found.called_lines}"
            f" | {len(idle.files)} | {idle.lines} |",
            flush=True,
        )
        if given.modules:
            for file in sorted(found.files, key=lambda one: (one in called, one)):
                mark = "called" if file in called else "-"
                print(f"{len(_text(file).splitlines()):6} {mark:7} {Path(file).relative_to(SOURCE)}")


if __name__ == "__main__":
    main()
