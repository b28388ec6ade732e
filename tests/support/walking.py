# SPDX-License-Identifier: Apache-2.0
"""Follows four pieces of data through the code and counts what they pass: `make walks`.

A walk is traced while the code runs: every function of the four packages that Python calls on the way, the files in
which these stand, and how often the way changes from one file to another. Compiled code and libraries do not count, and
neither does what had been computed before and is only looked up, such as what modules compute when they are imported. A
comprehension belongs to its function, since only some versions of Python call it. The counts measure how much of the
code a reader has to know who follows the data; a test keeps them from growing unnoticed.

Usage: walking.py [WALK ...] [--functions], by default all; `--functions` lists what was passed, in the order of first
use.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import CodeType, FrameType
from typing import Any, NamedTuple

SOURCE = str(Path(__file__).resolve().parents[2] / "src") + "/"

LONGEST = 60.0
"""Time (s) within which the graph has to reach that sample."""

LONGEST_WALK = 900.0
"""Time (s) that a walk may take."""

COMPREHENSIONS = ("<genexpr>", "<listcomp>", "<setcomp>", "<dictcomp>")

SAMPLE = 40
"""The sample that is followed to its torque, when all that is computed once has been."""


class Walk(NamedTuple):
    """What a piece of data passed.

    Attributes:
        functions: of the packages, as FILE:FUNCTION, in the order of their first call.
        files: in which they stand.
        changes: of file from one call to the next.
        calls: in all.
    """

    functions: list[str]
    files: list[str]
    changes: int
    calls: int


class Trace:
    """Notes every call of a function of the packages while it is on."""

    def __init__(self) -> None:
        """Begin with nothing."""
        self._names: dict[CodeType, str] = {}
        self._last = ""
        self._importing = 0
        self.changes = self.calls = 0

    @contextlib.contextmanager
    def on(self) -> Iterator[None]:
        """Trace what is called within."""
        sys.setprofile(self.note)
        try:
            yield
        finally:
            sys.setprofile(None)

    def walk(self) -> Walk:
        """Return what was passed."""
        functions = list(self._names.values())
        return Walk(
            functions, list(dict.fromkeys(one.partition(":")[0] for one in functions)), self.changes, self.calls
        )

    def note(self, frame: FrameType, event: str, argument: Any) -> None:
        """Note an event as `sys.setprofile` announces it."""
        code = frame.f_code
        if event not in ("call", "return") or not code.co_filename.startswith(SOURCE):
            return
        if code.co_name == "<module>":
            self._importing += 1 if event == "call" else -1
        if event == "return" or self._importing or code.co_name in COMPREHENSIONS or code.co_name == "<module>":
            return
        file = code.co_filename.removeprefix(SOURCE)
        self._names.setdefault(code, f"{file}:{code.co_qualname}")
        self.calls += 1
        self.changes += file != self._last
        self._last = file


def torque() -> Walk:
    """Follow a JointState through the control chain, in one process, to the torque that answers it."""
    import rclpy
    import yaml

    from fivebar_bringup.graph.crossing_graph import crossing_graph
    from fivebar_bringup.graph.node_spec import Mode
    from fivebar_bringup.nodes.node_group import node_class
    from fivebar_bringup.runs.domain import private_domain
    from fivebar_bringup.scenarios.scenario_files import load_scenario
    from fivebar_description.interface import JOINT_STATES, START_STAMP_NS, TORQUE_COMMAND, sample_stamp_ns
    from fivebar_description.ros.node import GraphNode
    from fivebar_description.ros.process_topics import ProcessTopics
    from fivebar_description.ros.run import NodeExecutor, use_local_network_only
    from fivebar_description.scenario_file import FILE_OF_RUN

    scenario, trace = load_scenario("middle"), Trace()
    followed = sample_stamp_ns(SAMPLE, scenario.rate_hz, START_STAMP_NS)
    with tempfile.TemporaryDirectory() as folder, private_domain() as domain:
        specs = crossing_graph(scenario, Mode.LOCKSTEP, Path(folder) / "bag")
        Path(folder, FILE_OF_RUN).write_text(scenario.to_yaml(), encoding="utf-8")
        chain = [spec for spec in specs if spec.in_chain or spec.executable == "plant"]
        parameters: dict[str, Any] = {
            f"/{spec.executable}": yaml.safe_load(spec.parameter_file())["/**"] for spec in chain
        }
        parameters["/plant"]["ros__parameters"]["wait_for_nodes"] = [
            spec.executable for spec in chain if spec.executable != "plant"
        ]
        file = Path(folder, "parameters.yaml")
        file.write_text(yaml.safe_dump(parameters), encoding="utf-8")
        use_local_network_only()
        rclpy.init(args=["--ros-args", "--params-file", str(file)], domain_id=domain)
        topics = GraphNode.process_topics = ProcessTopics()
        nodes = [node_class(spec.module)() for spec in chain]
        state, command = f"/{JOINT_STATES.name}", f"/{TORQUE_COMMAND.name}"
        done: list[bool] = []

        def watched(listener: Callable[[Any], None], begins: bool) -> Callable[[Any], None]:
            def observe(message: Any) -> None:
                if message.stamp_ns == followed:
                    sys.setprofile(trace.note if begins else None)
                    done.extend([True] * (not begins))
                listener(message)

            return observe

        for name in (state, command):
            listeners = topics._lines[name].listeners
            listeners[0] = watched(listeners[0], begins=name == state)
        topics.connect()
        executor = NodeExecutor()
        for node in nodes:
            executor.add_node(node)
            node.schedule()
        latest = time.monotonic() + LONGEST
        while not done:
            executor.spin_once(timeout_sec=0.1)
            if time.monotonic() > latest:
                raise TimeoutError(f"torque: sample {SAMPLE} was not reached within {LONGEST:g} s")
        for node in nodes:
            node.stop()
        rclpy.try_shutdown()
    return trace.walk()


def limit() -> Walk:
    """Follow the keys of a scenario's file to the limits of the guard in the blender."""
    import rclpy

    from fivebar_control.nodes.blender import Blender

    trace = Trace()
    rclpy.init(args=["--ros-args", "-p", "scenario:=middle"])
    with trace.on():
        node = Blender()
    node.destroy_node()
    rclpy.try_shutdown()
    return trace.walk()


def motion() -> Walk:
    """Follow a goal to the scenario that drives there: planned, screened and written down."""
    import fivebar

    trace = Trace()
    with trace.on():
        fivebar.plan("dextar", goal=(0.0, 0.02), assembly_mode="-")
    return trace.walk()


def row() -> Walk:
    """Follow a case of a sweep to its row."""
    from fivebar_studies.sweep.running import run_case

    run_case(1, 1, "calibrated", ("unified",))
    trace = Trace()
    with trace.on():
        run_case(1, 2, "calibrated", ("unified",))
    return trace.walk()


WALKS: dict[str, Callable[[], Walk]] = {"torque": torque, "limit": limit, "motion": motion, "row": row}


def walked(name: str) -> Walk:
    """Return a walk, made in a process of its own, so that no other has computed anything before."""
    command = [sys.executable, str(Path(__file__)), "--here", name]
    made = subprocess.run(command, capture_output=True, text=True, timeout=LONGEST_WALK, check=False)
    if made.returncode != 0:
        raise RuntimeError(f"walk {name}: exit status {made.returncode}: {made.stderr.strip()}")
    return Walk(*json.loads(made.stdout.splitlines()[-1]))


def main() -> None:
    """Print the counts of each walk."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("walks", nargs="*", metavar="WALK", help=f"one of {', '.join(WALKS)}; by default all")
    parser.add_argument("--functions", action="store_true", help="list what was passed")
    parser.add_argument(
        "--here", metavar="WALK", choices=WALKS, help="make one walk in this process and print it as JSON"
    )
    given = parser.parse_args()
    if given.here:
        print(json.dumps(WALKS[given.here]()), flush=True)
        # without waiting for what nodes and workers leave behind
        os._exit(0)
    if unknown := [name for name in given.walks if name not in WALKS]:
        parser.error(f"{', '.join(unknown)}: expected {', '.join(WALKS)}")
    print("| walk | files | functions | changes of file | calls |\n|---|---|---|---|---|")
    for name in given.walks or WALKS:
        found = walked(name)
        print(f"| {name} | {len(found.files)} | {len(found.functions)} | {found.changes} | {found.calls} |", flush=True)
        if given.functions:
            print("\n".join(found.functions))


if __name__ == "__main__":
    main()
