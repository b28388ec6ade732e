# SPDX-License-Identifier: Apache-2.0
"""The bridge's bus against drives in another process, over UDP that stays on this machine."""

from __future__ import annotations

import math
import os
import queue
import random
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml
from forked_node import end_with_parent

from fivebar_control.hardware.cia402 import DriveState
from fivebar_control.hardware.configuration import load_drives
from fivebar_control.hardware.drive_bus import DriveBus
from fivebar_control.hardware.drive_interface import ZERO, Exchange
from fivebar_description.files import share_file

TIMEOUT_MS = 2000
"""Age at which a heartbeat counts as lost, longer than a shared machine stands still."""

SILENCE = 3.0
"""How long (s) a master is silent."""

DEADLINE = 120.0
RATE_HZ = 100
"""Rate of the robot: it moves on by one period with every SYNC, whenever that comes."""

PERIOD_US = 50_000
"""Pace of the bridge where it has one, slow enough for a machine that has other work to do."""

ON, OFF = (DriveState.ENABLED, DriveState.ENABLED), (DriveState.SWITCH_ON_DISABLED, DriveState.SWITCH_ON_DISABLED)


class Drives:
    """The process of the emulated drives."""

    def __init__(self, file: Path) -> None:
        command = [str(Path(sys.executable).parent / "emulated_drives"), str(file)]
        self.process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            preexec_fn=end_with_parent,
        )
        self._lines: queue.Queue[str] = queue.Queue()
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self._lines.put(line.strip())

    def heard(self, text: str) -> None:
        """Wait until the process has said something."""
        line = self._lines.get(timeout=DEADLINE)
        assert text in line, line

    def tell(self, line: str) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(f"{line}\n")
        self.process.stdin.flush()
        self.heard(f"done: {line}")


@pytest.fixture
def bus_section() -> dict[str, object]:
    """A group and port of this test's own."""
    rng = random.Random(os.getpid() ^ time.monotonic_ns())
    return {
        "interface": "udp_multicast",
        "channel": f"239.74.{rng.randrange(256)}.{rng.randrange(1, 255)}",
        "port": rng.randrange(20000, 60000),
    }


def rewritten(package: str, folder: Path, changes: dict[str, Any]) -> Path:
    content = yaml.safe_load(share_file(package, "config", "drives", "dextar_emulated.yaml").read_text())
    path = folder / f"{package}.yaml"
    path.write_text(yaml.safe_dump({**content, **changes}))
    return path


def patient(bus: dict[str, object]) -> dict[str, Any]:
    """Changes of the bridge's file that give every answer time to come."""
    drives = yaml.safe_load(share_file("fivebar_control", "config", "drives", "dextar_emulated.yaml").read_text())
    for drive in drives["drives"].values():
        drive["heartbeat_timeout_ms"] = TIMEOUT_MS
    return {
        "bus": bus,
        "sync_period_us": PERIOD_US,
        "gather_deadline_us": PERIOD_US - 1000,
        "drives": drives["drives"],
        "master": {**drives["master"], "timeout_ms": TIMEOUT_MS},
    }


@pytest.fixture
def drives(tmp_path: Path, bus_section: dict[str, object]) -> Iterator[Drives]:
    drives = Drives(rewritten("fivebar_sim", tmp_path, {"bus": bus_section, "sync_period_us": 1_000_000 // RATE_HZ}))
    try:
        drives.heard("ready: ")
        yield drives
    finally:
        drives.process.kill()
        drives.process.wait()


@pytest.fixture
def bus(tmp_path: Path, bus_section: dict[str, object], drives: Drives) -> Iterator[DriveBus]:
    with DriveBus(load_drives(str(rewritten("fivebar_control", tmp_path, patient(bus_section))))) as bus:
        bus.set_up()
        yield bus


def cycles_until(bus: DriveBus, condition: Callable[[Exchange], bool]) -> Exchange:
    end = time.monotonic() + DEADLINE
    while time.monotonic() < end:
        cycle = bus.exchange_paced()
        if condition(cycle):
            return cycle
    raise AssertionError("not seen before the deadline")


def fault_name(cycle: Exchange) -> str:
    return cycle.fault.name if cycle.fault is not None else ""


def test_a_second_of_torque(bus: DriveBus, drives: Drives) -> None:
    """Enable, a second's cycles of a sine on both motors, disable; the drives end with status 0 on a signal."""
    bus.enable(DEADLINE)
    torques: list[float] = []
    for k in range(RATE_HZ):
        torque = 0.8 * math.sin(2.0 * math.pi * 4.0 * k / RATE_HZ)
        bus.write((torque, -torque))
        cycle = bus.exchange()
        assert cycle.fault is None, cycle.fault
        if cycle.complete and cycle.readings[0] is not None:
            torques.append(cycle.readings[0].torque)
    print(f"{len(torques)} of {RATE_HZ} SYNCs answered in time, peak torque {max(torques)} Nm")
    assert len(torques) > RATE_HZ // 2
    assert max(torques) == pytest.approx(0.8, abs=0.1)
    bus.disable(DEADLINE)
    assert bus.states == OFF
    assert bus.counters == (0, 0, 0)
    drives.process.send_signal(signal.SIGTERM)
    assert drives.process.wait(DEADLINE) == 0


@pytest.mark.extra
def test_a_drive_fault_and_its_recovery(bus: DriveBus, drives: Drives) -> None:
    bus.enable(DEADLINE)
    drives.tell("fault 2")
    cycle = cycles_until(bus, lambda cycle: fault_name(cycle) == "drive_fault" and "7305" in str(cycle.fault))
    assert "q21 (node 2)" in str(cycle.fault)
    bus.reset(DEADLINE)
    cycles_until(bus, lambda cycle: bus.states == OFF and cycle.fault is None)
    bus.enable(DEADLINE)
    assert bus.states == ON


@pytest.mark.extra
def test_a_drive_that_loses_its_power(bus: DriveBus, drives: Drives) -> None:
    """The heartbeats end with the process: the last state that it told was operational."""
    bus.enable(DEADLINE)
    drives.process.kill()
    cycle = cycles_until(bus, lambda cycle: fault_name(cycle) == "drive_lost")
    assert "last heartbeat" in str(cycle.fault)
    bus.write(ZERO)


def test_a_silent_master_is_noticed_by_the_drives(bus: DriveBus, drives: Drives) -> None:
    """No cycle, no heartbeat: once cycles go on, the drives say that they have stopped, and why."""
    bus.enable(DEADLINE)
    # with the first cycles the heartbeat begins, and with it the watch
    for _ in range(100):
        bus.exchange()
    # the silence itself, many times what the drives bear
    signal.sigtimedwait([], SILENCE)
    cycle = cycles_until(bus, lambda cycle: fault_name(cycle) == "drive_fault")
    assert "heartbeat lost (0x8130)" in str(cycle.fault)


@pytest.mark.extra
@pytest.mark.parametrize(
    ("argument", "text"),
    [("nowhere", "emulation 'nowhere': expected one of dextar_emulated"), ("/none.yaml", "cannot be read")],
)
def test_bad_input_is_one_line(argument: str, text: str) -> None:
    command = [str(Path(sys.executable).parent / "emulated_drives"), argument]
    done = subprocess.run(command, capture_output=True, text=True, timeout=DEADLINE, check=False)
    assert done.returncode == 2
    assert text in done.stderr
    assert done.stderr.count("\n") == 1
