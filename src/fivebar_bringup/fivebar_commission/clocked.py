# SPDX-License-Identifier: Apache-2.0
"""A practice by the clock: the robot is simulated in a process of its own, everything else is as with a real one."""

from __future__ import annotations

import subprocess
import threading
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from fivebar_bringup.drives.run_files import private_bus
from fivebar_bringup.runs.domain import private_domain
from fivebar_bringup.runs.parent_death import end_with_parent
from fivebar_commission.person import Task
from fivebar_commission.practice import read_practice
from fivebar_commission.practice_tasks import DONE, READY, task_line
from fivebar_commission.real import RealBench
from fivebar_description.modules import module_command
from fivebar_description.strict_yaml import InputError

PROGRAM = "fivebar_commission.ros.practised_robot"

LONGEST_TASK = 600.0
"""Longest time (s) that the robot's process may take to begin, which compiles the first time, or for a task."""

END_TIMEOUT = 10.0
"""Longest time (s) until the robot's process has ended."""


def by_the_clock(content: dict[str, Any]) -> dict[str, Any]:
    """Return the content of a practice file whose drives are ODrives on a bus of its own, and move with the clock."""
    return content | {"interface": "odrive", "pace": "clock", "link": private_bus()}


class RobotProcess:
    """The process of the simulated robot, whose hand does what it is told."""

    def __init__(self, file: Path, domain: int) -> None:
        """Start it, and wait until its drives are on the bus.

        Raises:
            InputError: it does not start.
        """
        command = [*module_command(PROGRAM), str(file), str(domain)]
        # in a session of its own, since a robot hears no Ctrl-C: its drives are to be left without torque first
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            preexec_fn=end_with_parent,
            start_new_session=True,
        )
        self._expect(READY)

    def does(self, task: Task) -> None:
        """Let a hand do a task at the robot, and return when it is done.

        Raises:
            InputError: the process has ended.
        """
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(f"{task_line(task)}\n")
            self._process.stdin.flush()
        except BrokenPipeError:
            # the process has ended, which is told below
            pass
        self._expect(DONE)

    def close(self) -> None:
        """End the process."""
        assert self._process.stdin is not None
        self._process.stdin.close()
        try:
            self._process.wait(END_TIMEOUT)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def _expect(self, word: str) -> None:
        assert self._process.stdout is not None
        late = threading.Timer(LONGEST_TASK, self._process.kill)
        late.start()
        try:
            # what loads ROS may print a line of its own
            for line in self._process.stdout:
                if line.strip() == word:
                    return
        finally:
            late.cancel()
        raise InputError(f"the simulated robot's process has ended: exit status {self._process.wait()}")


class ClockedBench(RealBench):
    """The `RobotBench` of a simulated robot by the clock, with a DDS domain of its own."""

    def __init__(self, file: Path) -> None:
        """Start the robot of a practice file.

        Raises:
            InputError: it does not start.
        """
        practice = read_practice(file)
        with ExitStack() as stack:
            domain = stack.enter_context(private_domain())
            rate_hz = round(1e6 / practice.period_us)
            imu_rate_hz = 0 if practice.imu is None else practice.imu.rate_hz or rate_hz
            super().__init__(rate_hz, imu_rate_hz, domain)
            self.robot = RobotProcess(file, domain)
            stack.callback(self.robot.close)
            self._left = stack.pop_all()

    def close(self) -> None:
        """End the robot's process, and give the domain back."""
        self._left.close()
