"""The `fivebar` command as a person runs it, and what it leaves behind: directories and processes."""

from __future__ import annotations

import json
import os
import signal
import sys
import time
import uuid
from pathlib import Path
from typing import Any

import pytest
import yaml
from forked_node import ForkedNode, fork_context
from graph_probe import COMMAND, PRELOADED, RATE_HZ, ChildProcess, Probe, clean_environment

from fivebar_bringup.runs.bag.reader import read_bag
from fivebar_bringup.runs.bag.recording import Recording
from fivebar_bringup.runs.node_starter import LONGEST_NAME
from fivebar_description.interface import JOINT_STATES, TORQUE_COMMAND, sample_of_stamp
from fivebar_description.ros.messages import stamp_of

FIVEBAR = Path(sys.executable).with_name("fivebar")
MARK = "FIVEBAR_TEST_RUN"
"""Environment variable by which all processes of a run are found, whoever their parent has become."""

RUN_DEADLINE = 240.0
"""Longest time (s) for a command that takes some ten seconds on an idle machine."""

LONG = 30.0
"""Time (s) of one segment of a motion that is still on its way when whoever listens has joined, and then is ended:
nothing awaits the probe of a run."""


class FivebarCommand(ChildProcess):
    """One call of the command, in a folder of its own."""

    def __init__(self, folder: Path, *arguments: str, domain: int = 0) -> None:
        if arguments[:1] in (("run",), ("simulate",)) and "--page" not in arguments:
            # drawing takes longer than a short run, and few tests look at the pictures
            arguments = (*arguments, "--no-page")
        self.folder = folder
        self.domain = domain
        self._mark = f"{MARK}={uuid.uuid4()}"
        name, _, value = self._mark.partition("=")
        super().__init__([str(FIVEBAR), *arguments], folder, {**clean_environment(domain, folder), name: value})

    def finish(self, deadline: float = RUN_DEADLINE) -> int:
        """Wait for the end and return the exit status."""
        return self.wait(deadline)

    def json(self) -> Any:
        return json.loads(self.stdout)

    def processes(self) -> dict[int, str]:
        """Return all living processes of this call, itself included, with their command lines."""
        found = {}
        for entry in Path("/proc").iterdir():
            if not entry.name.isdecimal():
                continue
            try:
                environment = (entry / "environ").read_bytes()
                line = (entry / "cmdline").read_bytes()
            except OSError:
                continue
            # a zombie has no command line any more
            if line and self._mark.encode() in environment.split(b"\0"):
                found[int(entry.name)] = line.replace(b"\0", b" ").decode()
        return found

    def node(self, name: str) -> int:
        """Return the process number of a node."""
        kept = name[:LONGEST_NAME]
        (pid,) = (pid for pid in self.processes() if Path(f"/proc/{pid}/comm").read_text().strip() == kept)
        return pid

    def expect_no_process(self, deadline: float) -> None:
        """Fail where a process of this call still lives after a time (s)."""
        end = time.monotonic() + deadline
        while alive := self.processes():
            if time.monotonic() > end:
                pytest.fail(f"still there after {deadline} s: {alive}")
            time.sleep(0.05)

    def close(self) -> None:
        """End whatever is left of this call."""
        super().close()
        for pid in self.processes():
            os.kill(pid, signal.SIGKILL)


class ForkedCommand(ForkedNode):
    """One call of the command that starts no processes, forked from one that has loaded it, in a folder of its own."""

    def __init__(self, folder: Path, *arguments: str) -> None:
        if arguments[:1] in (("run",), ("simulate",)) and "--page" not in arguments:
            # drawing takes longer than a short run, and few tests look at the pictures
            arguments = (*arguments, "--no-page")
        self.folder = folder
        environment = clean_environment(0, folder)
        super().__init__(fork_context(PRELOADED), COMMAND, arguments, folder, environment, FIVEBAR.name)

    def finish(self) -> int:
        """Wait for the end and return the exit status."""
        return self.wait(RUN_DEADLINE)

    def json(self) -> Any:
        return json.loads(self.stdout)


class GraphRun:
    """A `fivebar run` in the background, and a probe in its domain."""

    def __init__(self, folder: Path, domain: int, probe: Probe) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.probe = probe
        scenario = folder / "scenario.yaml"
        content = {
            "name": "interrupted",
            "waypoints": [[0.0, 0.15], [0.0, 0.02], [0.0, 0.15]],
            "segment_duration": LONG,
        }
        scenario.write_text(yaml.safe_dump(content), encoding="utf-8")
        self.out = folder / "out"
        probe.listen(JOINT_STATES, TORQUE_COMMAND)
        self.command = FivebarCommand(
            folder, "run", str(scenario), "--json", "--out", str(self.out), "--domain", str(domain), domain=domain
        )

    def wait_for_sample(self, sample: int) -> None:
        """Wait until the run has got to a sample."""

        def reached() -> bool:
            if self.command.status is not None:
                pytest.fail(f"the run has ended: {self.command.stdout}{self.command.stderr}")
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
        assert summary["completed"] is False
        assert json.loads((self.out / "summary.json").read_text(encoding="utf-8")) == summary
        return summary

    def bag(self) -> Recording:
        return read_bag(self.out / "bag")

    def expect_no_torque(self) -> None:
        """Wait for a command of no torque, which stays the last one."""
        commands = self.probe.got(TORQUE_COMMAND)
        self.probe.wait_for(lambda: not any(commands[-1].effort), "no torque")
        self.probe.spin_for(0.1)
        assert not any(commands[-1].effort)
