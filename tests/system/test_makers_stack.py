# SPDX-License-Identifier: Apache-2.0
"""The bridge against the MOTKIN bench's own stack as its makers' sources have it, which is no part of the project.

What really happens is read from that stack's mechanism, and not from what the project records.
"""

from __future__ import annotations

import os
import signal
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import forward_controller_stack
import numpy as np
import pytest
import yaml
from fivebar_command import RUN_DEADLINE, InstalledCommand
from graph_probe import RATE_HZ, Bench

import fivebar
from fivebar_control.hardware.motors_file import load_motors
from fivebar_description.files import share_file

pytestmark = [pytest.mark.clock, pytest.mark.extra]

GAINS = {"stiffness": 1.0, "damping": 0.03}  # A/rad, A/(rad/s)
IN_NM = {"stiffness": 0.062, "damping": 0.00186}
GAZEBO_START = [0.0, 0.1466]
WITHIN = 2e-3
"""Largest distance from the reference (m)."""

WATCHDOG_MS = 100
"""Of the project's watchdog, which takes twice that where time waits for commands: ten times what is shipped, for a
busy machine."""

STOP_CYCLES, MISSING_LIMIT = 100, 300
"""How long the nodes wait for each other, and the bridge for states, in samples, for the same reason."""

SET_UP_TIMEOUT_MS = 20_000

GONE_WITHIN = 0.5
"""Longest time (s) from a death in mid crossing until the motors have no torque. The watchdog has one and a half of its
time at most, since it looks four times in it and twice in a row."""


class Truth(NamedTuple):
    """The mechanism's motion: stamps of its states and time of the machine (s), platform (m), the sine between the
    couplers, and torques (Nm)."""

    stamps: np.ndarray
    times: np.ndarray
    platform: np.ndarray
    side: np.ndarray
    torques: np.ndarray

    def error(self, run: Path) -> float:
        """Return the largest distance (m) from the reference of a run, which begins with the first torque.

        While a bench waits its stamps are not those of the machine: two samples earlier or later, whatever fits best.
        """
        table = fivebar.load_run(run).to_dataframe()
        table = table[table.t <= fivebar.load_scenario(run / "scenario.yaml").plan().path.duration]
        begun = self.stamps[np.argmax(np.any(self.torques != 0.0, axis=1))]
        errors = []
        for late in np.arange(-2, 3) / RATE_HZ:
            x, y = (np.interp(begun + late + table.t, self.stamps, axis) for axis in self.platform.T)
            errors.append(float(np.hypot(x - table.xd, y - table.yd).max()))
        return min(errors)

    def torque_after(self, event: float) -> float:
        """Return how long after a time of the machine the motors had a torque (s)."""
        last = self.times[np.any(self.torques != 0.0, axis=1)][-1]
        return float(last - event)


class MakersBench:
    """Their stack and a run of ours beside it, in a domain of their own."""

    def __init__(self, bench: Bench, folder: Path) -> None:
        self.bench, self.folder = bench, folder

    def drives(self, **link: Any) -> Path:
        """Write the drives file that is shipped, for a world that stands still while it waits for a command."""
        content = load_motors("motkin_ros2_control").model_dump(mode="json", exclude_none=True)
        content |= {
            "pace": "commands",
            "missing_limit": MISSING_LIMIT,
            "watchdog_ms": WATCHDOG_MS,
            "set_up_timeout_ms": SET_UP_TIMEOUT_MS,
            "link": {**content["link"], **link},
        }
        file = self.folder / "drives.yaml"
        file.write_text(yaml.safe_dump(content), encoding="utf-8")
        return file

    def scenario(self, name: str) -> Path:
        """Write a shipped scenario, or that of their simulation, in which both cranks begin along +y."""
        shipped = "motkin_middle" if name == "gazebo" else name
        file = share_file("fivebar_description", "config", "scenarios", f"{shipped}.yaml")
        content = yaml.safe_load(file.read_text(encoding="utf-8")) | {"safety": {"stop_cycles": STOP_CYCLES}}
        if name == "gazebo":
            content |= {"waypoints": [GAZEBO_START, [0.0, 0.0], GAZEBO_START], "segment_duration": 0.7}
        copy = self.folder / f"{name}.yaml"
        copy.write_text(yaml.safe_dump(content), encoding="utf-8")
        return copy

    def begin(self, scenario: str, options: tuple[str, ...], **link: Any) -> InstalledCommand:
        """Start the stack with some options, and a run."""
        stack = (sys.executable, forward_controller_stack.__file__, str(self.folder / "truth.npy"), "--patient")
        self.stack = self.bench.run([*stack, *options])
        external = ("--hardware", "external", "--drives", str(self.drives(**link)), "--activate")
        names = ("--namespace", "fivebar", "--json", "--out", str(self.folder / "out"))
        call = ("run", str(self.scenario(scenario)), *external, *names)
        return InstalledCommand(self.folder / "call", *call, domain=self.bench.domain)

    def near(self, run: InstalledCommand) -> float:
        """Wait until the platform comes near to the locus; return when that was, on the clock of the machine (s)."""
        end = time.monotonic() + RUN_DEADLINE
        while "near" not in self.stack.stdout:
            assert run.status is None, run.stdout
            assert time.monotonic() < end
            time.sleep(1e-3)
        return int(self.stack.stdout.split()[-1]) * 1e-9

    def truth(self) -> Truth:
        """End the stack, and return what really happened."""
        self.stack.send(signal.SIGTERM)
        assert self.stack.wait() == 0, self.stack.stderr
        table = np.load(self.folder / "truth.npy")
        return Truth(table[:, 0], table[:, 1], table[:, 2:4], table[:, 4], table[:, 5:])


@pytest.fixture
def beside(tmp_path: Path) -> Iterator[MakersBench]:
    with Bench(tmp_path) as bench:
        yield MakersBench(bench, tmp_path)


@pytest.mark.parametrize(
    ("scenario", "options", "link"),
    [
        ("motkin_middle", (), {}),
        ("motkin_middle", (), {"inner_loop": GAINS}),
        ("motkin_vertical", ("--upright",), {}),
        ("gazebo", ("--simulation", "--motors", "0", "0"), {"unit": "Nm"}),
        ("gazebo", ("--simulation", "--motors", "0", "0"), {"unit": "Nm", "inner_loop": IN_NM}),
    ],
    ids=["level", "level with gains", "upright", "gazebo", "gazebo with gains"],
)
def test_it_crosses_to_and_fro(
    beside: MakersBench, scenario: str, options: tuple[str, ...], link: dict[str, Any]
) -> None:
    run = beside.begin(scenario, options, **link)
    assert run.finish() == 0, run.stdout
    summary, truth = run.json(), beside.truth()
    assert (summary["outcome"], summary["faults"], summary["assembly_mode_changes"]) == ("succeeded", [], 2)
    # well beyond the locus, and back
    assert truth.side.min() < -0.5 < 0.5 < abs(truth.side[0])
    assert truth.error(beside.folder / "out") < WITHIN
    assert np.abs(truth.torques).max() > 0.01


@pytest.mark.parametrize(
    "broken",
    [
        "silent",
        "missing",
        "nan",
        "frozen",
        "hang",
        "deactivate",
        "second_commander",
        "SIGKILL drive_bridge",
        "SIGSTOP drive_bridge",
        "SIGKILL controllers",
    ],
)
def test_no_torque_is_left_at_the_plant_after_a_death_in_mid_crossing(beside: MakersBench, broken: str) -> None:
    """Which fault comes first depends on how patient the drives file is; what it does to the motors does not."""
    number, _, node = broken.rpartition(" ")
    run = beside.begin("motkin_middle", ("--fault", "outside" if number else broken))
    event = beside.near(run)
    if number:
        pid = run.node(node)
        event = time.monotonic()
        os.kill(pid, signal.Signals[number])
    status = run.finish()
    after = beside.truth().torque_after(event)
    assert status == 1, run.stdout
    assert run.json()["outcome"] == "stopped"
    assert -1e-3 < after < GONE_WITHIN
