# SPDX-License-Identifier: Apache-2.0
"""The `fivebar` command as a person runs it, and what it leaves behind: directories and processes."""

from __future__ import annotations

import json
import os
import signal
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
import yaml
from forked_node import ForkedNode, fork_context
from graph_probe import COMMAND, PRELOADED, RATE_HZ, ChildProcess, Probe, clean_environment

from fivebar_bringup.bag.reader import read_bag
from fivebar_bringup.bag.recording import Recording
from fivebar_bringup.runs.node_starter import LONGEST_NAME
from fivebar_description.interface import JOINT_STATES, RUN_STATUS, TORQUE_COMMAND, sample_of_stamp
from fivebar_description.ros.messages import stamp_of

FIVEBAR = Path(sys.executable).with_name("fivebar")

RUN_DEADLINE = 240.0
"""Longest time (s) for a command that takes some ten seconds on an idle machine."""

LONG = 30.0
"""Time (s) of one segment of a motion that is still on its way when whoever listens has joined, and then is ended:
nothing awaits the probe of a run."""


class CommandCall:
    """One call of the command in a folder of its own; its processes run there, whoever their parent has become."""

    folder: Path
    stdout: str
    wait: Callable[[float], int]

    def finish(self) -> int:
        """Wait for the end and return the exit status."""
        return self.wait(RUN_DEADLINE)

    def json(self) -> Any:
        return json.loads(self.stdout)

    def processes(self) -> dict[int, str]:
        """Return all living processes of this call, itself included, with their names."""
        found = {}
        for entry in Path("/proc").iterdir():
            if not entry.name.isdecimal():
                continue
            # what has ended by now, or is a zombie, has no folder
            with suppress(OSError):
                if (entry / "cwd").readlink() == self.folder:
                    found[int(entry.name)] = (entry / "comm").read_text(encoding="utf-8").strip()
        return found

    def node(self, name: str) -> int:
        """Return the process number of a node."""
        (pid,) = (pid for pid, found in self.processes().items() if found == name[:LONGEST_NAME])
        return pid

    def expect_no_process(self, deadline: float) -> None:
        """Fail where a process of this call still lives after a time (s)."""
        end = time.monotonic() + deadline
        while alive := self.processes():
            if time.monotonic() > end:
                pytest.fail(f"still there after {deadline} s: {alive}")
            time.sleep(0.05)

    def kill_processes(self) -> None:
        """Kill whatever is left of this call."""
        for pid in self.processes():
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)


class InstalledCommand(CommandCall, ChildProcess):
    """The installed command, which takes seconds of processor time to load its modules."""

    def __init__(self, folder: Path, *arguments: str, domain: int = 0) -> None:
        self.folder = folder.resolve()
        command = [str(FIVEBAR), *without_page(arguments)]
        ChildProcess.__init__(self, command, folder, clean_environment(domain, folder))

    def close(self) -> None:
        ChildProcess.close(self)
        self.kill_processes()


class FivebarCommand(CommandCall, ForkedNode):
    """The command forked from a process that has loaded it and all nodes."""

    def __init__(self, folder: Path, *arguments: str, domain: int = 0) -> None:
        self.folder = folder.resolve()
        context, environment = fork_context(PRELOADED), clean_environment(domain, folder)
        ForkedNode.__init__(self, context, COMMAND, without_page(arguments), folder, environment, FIVEBAR.name)

    def close(self) -> None:
        ForkedNode.close(self)
        self.kill_processes()


def without_page(arguments: tuple[str, ...]) -> tuple[str, ...]:
    """Return the arguments of a call that draws only if it says so: that takes longer than a short run."""
    return (*arguments, "--no-page") if arguments[0] in ("run", "simulate") and "--page" not in arguments else arguments


class GraphRun:
    """A `fivebar run` in the background, and a probe in its domain."""

    def __init__(self, folder: Path, domain: int, probe: Probe, *arguments: str, **sections: Any) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.probe = probe
        scenario = folder / "scenario.yaml"
        content = {
            "name": "interrupted",
            "waypoints": [[0.0, 0.15], [0.0, 0.02], [0.0, 0.15]],
            "segment_duration": LONG,
            # unscreened: that would take longer than all else
            "force": True,
            **sections,
        }
        scenario.write_text(yaml.safe_dump(content), encoding="utf-8")
        self.out = folder / "out"
        probe.listen(JOINT_STATES, TORQUE_COMMAND, RUN_STATUS)
        self.command = FivebarCommand(
            folder,
            *("run", str(scenario), "--json", "--out", str(self.out), "--domain", str(domain), *arguments),
            domain=domain,
        )

    def wait_for_sample(self, sample: int) -> None:
        """Wait until the run has got to a sample, and the launcher knows that it is under way."""

        def reached() -> bool:
            if self.command.status is not None:
                pytest.fail(f"the run has ended: {self.command.stdout}{self.command.stderr}")
            if sum(json.loads(status.data)["sample"] > 0 for status in self.probe.got(RUN_STATUS)) < 2:
                # a launcher that has not heard yet that the run has begun does not wait for what the others miss; of
                # the last status it may not know, of the one before, a fifth of a second ago, it does
                return False
            # both: the probe is not awaited, and one topic may be discovered later than the other
            return all(
                bool(got := self.probe.got(topic)) and (sample_of_stamp(stamp_of(got[-1]), RATE_HZ) or 0) >= sample
                for topic in (JOINT_STATES, TORQUE_COMMAND)
            )

        self.probe.wait_for(reached, f"sample {sample}", deadline=RUN_DEADLINE)

    def finish(self) -> dict[str, Any]:
        """Wait for the end of a failing run, hearing all of it, and return its summary."""
        self.probe.wait_for(lambda: self.command.status is not None, "the end of the run", deadline=RUN_DEADLINE)
        assert self.command.finish() == 1, self.command.stderr
        assert "Traceback" not in self.command.stderr
        summary = self.command.json()
        assert summary["outcome"] in ("stopped", "interrupted")
        assert json.loads((self.out / "summary.json").read_text(encoding="utf-8")) == summary
        return summary

    def bag(self) -> Recording:
        return read_bag(self.out / "bag")

    def expect_no_torque(self, besides: tuple[float, ...] = ()) -> None:
        """Wait for a command of no torque, which stays the last one; commands of a torque of others do not count."""
        commands = self.probe.got(TORQUE_COMMAND)

        def torque() -> tuple[float, ...]:
            return next(tuple(one.effort) for one in reversed(commands) if tuple(one.effort) != besides)

        self.probe.wait_for(lambda: not any(torque()), "no torque")
        self.probe.spin_for(0.1)
        assert not any(torque())
