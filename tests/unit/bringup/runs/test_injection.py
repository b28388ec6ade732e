# SPDX-License-Identifier: Apache-2.0
"""What is injected when, and how the death of a process is noticed."""

from __future__ import annotations

import math
import queue
import subprocess
import sys
from pathlib import Path

import pytest

from fivebar_bringup.drives.kinds import CANOPEN_DRIVES
from fivebar_bringup.graph.crossing_graph import Bridged, crossing_graph
from fivebar_bringup.graph.node_spec import Mode, Sharing
from fivebar_bringup.runs.injection import kills, read_injection, refuse_late
from fivebar_bringup.runs.launcher import Kill
from fivebar_bringup.runs.process_watch import watch_processes
from fivebar_bringup.runs.processes import processes
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_description.files import share_file
from fivebar_description.strict_yaml import InputError
from fivebar_sim.emulators.hardware_kinds import open_hardware
from fivebar_vendor_drives.kinds import MOTKIN_BOARD

WAIT = 10.0


@pytest.mark.parametrize(
    ("text", "seconds", "order", "victim"),
    [
        ("1.2 fault 1", 1.2, "fault 1", None),
        (" 0 late 2 5 ", 0.0, "late 2 5", None),
        ("3 late_sync 2.5", 3.0, "late_sync 2.5", None),
        ("0.5 bus_off", 0.5, "bus_off", None),
        ("1234.567 bus_off", 1234.567, "bus_off", None),
        ("0.5 kill blender", 0.5, "kill blender", "blender"),
    ],
)
def test_a_moment_and_what_breaks(text: str, seconds: float, order: str, victim: str | None) -> None:
    injection = read_injection(text, CANOPEN_DRIVES)
    assert (injection, injection.victim) == ((seconds, order), victim)
    assert read_injection(str(injection), CANOPEN_DRIVES) == injection


@pytest.mark.parametrize(
    "text",
    ["", "fault 1", "-1 fault 1", "nan fault 1", "1", "1 fault", "1 fault 3", "1 kill", "1 late 1 -5", "1 dance"],
)
def test_what_is_not_understood_is_refused(text: str) -> None:
    with pytest.raises(InputError, match=r"--inject .*: expected seconds and one of"):
        read_injection(text, CANOPEN_DRIVES)


def test_a_motor_board_has_faults_of_its_own() -> None:
    assert read_injection("1 fault 3", MOTKIN_BOARD) == (1.0, "fault 3")
    with pytest.raises(InputError, match="expected seconds and one of"):
        read_injection("1 bus_off", MOTKIN_BOARD)


def test_a_file_of_emulated_drives_says_which_they_are(tmp_path: Path) -> None:
    shipped = share_file("fivebar_sim", "config", "boards", "motkin_emulated.yaml").read_text(encoding="utf-8")
    path = tmp_path / "board.yaml"
    path.write_text(shipped.replace("interface: motkin\n", ""), encoding="utf-8")
    with pytest.raises(InputError, match="interface: expected that of the drives, one of canopen, moteus, motkin, od"):
        open_hardware(str(path))
    for hardware, _ in (open_hardware(str(path), "motkin"), open_hardware("motkin_emulated")):
        assert hardware.resolution == pytest.approx(math.tau / 16384)
        hardware.close()


def test_a_node_is_killed_with_the_process_that_it_lives_in() -> None:
    scenario = load_scenario("middle_robot")
    nodes = crossing_graph(scenario, Mode.REALTIME, Path("bag"))
    together = processes(nodes, Mode.REALTIME, scenario.rate_hz)
    alone = processes(nodes, Mode.REALTIME, scenario.rate_hz, sharing=Sharing.NONE)
    injections = [
        read_injection(text, CANOPEN_DRIVES) for text in ("0.5 kill blender", "0.2 fault 1", "0.25 kill bag_recorder")
    ]
    assert kills(injections, together, 100) == [Kill(25, "bag_recorder"), Kill(50, "controllers")]
    assert kills(injections, alone, 100) == [Kill(25, "bag_recorder"), Kill(50, "blender")]
    with pytest.raises(InputError, match="node cook: expected one of"):
        kills([read_injection("1 kill cook", CANOPEN_DRIVES)], alone, 100)


def test_the_bridge_may_live_with_the_control_chain() -> None:
    scenario = load_scenario("middle_robot")
    nodes = crossing_graph(scenario, Mode.REALTIME, Path("bag"), Bridged("dextar_socketcan"))
    specs = processes(nodes, Mode.REALTIME, scenario.rate_hz, sharing=Sharing.ROBOT)
    shared = [node.executable for node in specs[0].nodes]
    chain = [node.executable for node in processes(nodes, Mode.REALTIME, scenario.rate_hz)[0].nodes]
    assert sorted(shared) == sorted([*chain, "dextar_bridge"])
    assert "dextar_bridge" not in [spec.name for spec in specs]
    injection = read_injection("1 kill dextar_bridge", CANOPEN_DRIVES)
    assert kills([injection], specs, 100) == [Kill(100, "controllers")]


def test_a_death_is_announced_by_name_and_a_living_process_is_not() -> None:
    sleeper = [sys.executable, "-c", "import sys; sys.stdin.read()"]
    with (
        subprocess.Popen(sleeper, stdin=subprocess.PIPE) as first,
        subprocess.Popen(sleeper, stdin=subprocess.PIPE) as second,
    ):
        heard: queue.Queue[str] = queue.Queue()
        with watch_processes({"first": first.pid, "second": second.pid}, heard.put):
            second.kill()
            assert heard.get(timeout=WAIT) == "node_died: second has ended"
        assert heard.empty()
        first.kill()
    assert heard.empty(), "after the context nobody listens"


def test_a_motor_board_has_words_of_its_own() -> None:
    assert read_injection("0.3 fault 9", MOTKIN_BOARD).command == "fault 9"
    assert read_injection("0.3 unplug", MOTKIN_BOARD).seconds == 0.3
    for text in ("0.3 fault 10", "0.3 bus_off", "0.3 button"):
        with pytest.raises(InputError, match="unplug"):
            read_injection(text, MOTKIN_BOARD)
    with pytest.raises(InputError, match="bus_off"):
        read_injection("0.3 unplug", CANOPEN_DRIVES)


def test_a_fault_that_would_never_come_is_refused() -> None:
    soon, late = read_injection("1.2 fault 1", CANOPEN_DRIVES), read_injection("100 kill blender", CANOPEN_DRIVES)
    refuse_late([soon], 1.2)
    with pytest.raises(InputError, match=r"--inject '100\.0 kill blender': expected at most 1\.2 s, the end of"):
        refuse_late([soon, late], 1.2)
