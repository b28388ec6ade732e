# SPDX-License-Identifier: Apache-2.0
"""The launch files under ROS' own launch: they end with the run, say where its results are, and fail where it failed.

launch_testing is not used: it takes a launch that ends by itself, as these do, for one that has died. What the files
share with `fivebar run` is tested without launch, in tests/system and tests/unit/bringup/runs.
"""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from described_bench import described, description, emulated
from doc_blocks import blocks, command_lines
from fivebar_command import LONG, RUN_DEADLINE, CommandCall
from graph_probe import DDS_VARIABLES, RATE_HZ, Bench, ChildProcess, Probe, clean_environment
from sensor_msgs.msg import JointState

from fivebar_bringup.bag.reader import read_bag
from fivebar_bringup.errors import BagError
from fivebar_bringup.recorded.run_directory import RunDirectory
from fivebar_bringup.report.report import write_report
from fivebar_bringup.runs.description import described_robot
from fivebar_bringup.runs.domain import private_domain
from fivebar_description.files import share_file
from fivebar_description.interface import (
    CELL_CLOCK,
    GOAL,
    GOAL_STATUS,
    NANOSECONDS,
    RUN_STATUS,
    STATE_QOS,
    TORQUE_COMMAND,
    Topic,
    sample_of_stamp,
)
from fivebar_description.interrupts import STOP_SIGNALS
from fivebar_description.modules import module_command
from fivebar_description.ros.messages import stamp_of

pytestmark = pytest.mark.skipif(
    find_spec("launch_ros") is None,
    reason="launch and launch_ros are not installed: they come with a ROS 2 installation, and are not on PyPI",
)

SERVICE = Path(__file__).with_name("launch_service.py")
COLOURS = re.compile(r"\x1b\[[0-9;]*[A-Za-z]")

SHORT = {
    "name": "short",
    "waypoints": [[0.0, 0.15], [0.0, 0.02], [0.0, 0.15]],
    "segment_duration": 0.5,
    # unscreened: that would take longer than all else
    "force": True,
}

REMAPPED_TORQUE = TORQUE_COMMAND._replace(name="motors/torque")

PAGE = Path(__file__).parents[2] / "docs" / "ros.md"


def installed(package: str) -> bool:
    """Whether a package of ROS is installed, as launch files find it."""
    prefixes = os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)
    return any(Path(one, "share", "ament_index", "resource_index", "packages", package).is_file() for one in prefixes)


def dds_variables() -> dict[str, str]:
    """What keeps a launch on this machine as it keeps the probe, which sets it."""
    return {name: os.environ[name] for name in DDS_VARIABLES if name in os.environ}


AROUND = """
from launch import LaunchDescription
from launch.actions import GroupAction, IncludeLaunchDescription
from launch_ros.actions import PushRosNamespace, SetParameter, SetRemap


def generate_launch_description():
    return LaunchDescription([GroupAction([{around}, IncludeLaunchDescription("{path}")])])
"""


class LaunchCall(CommandCall, ChildProcess):
    """One launch in a folder and a domain of its own."""

    def __init__(self, folder: Path, domain: int, name: str | Path, *arguments: str, **variables: str) -> None:
        folder.mkdir(parents=True)
        self.folder, self.out = folder.resolve(), folder.resolve() / "out"
        path = name if isinstance(name, Path) else share_file("fivebar_bringup", "launch", f"{name}.launch.py")
        self._environment = {**clean_environment(domain, folder), **variables}
        ChildProcess.__init__(self, [sys.executable, str(SERVICE), str(path), *arguments], folder, self._environment)

    @property
    def output(self) -> str:
        """All that the launch has printed, without colours."""
        return COLOURS.sub("", self.stdout + self.stderr)

    def ask(self, command: str, expected: str = "") -> str:
        """Return what a command prints in the domain of the launch.

        The daemon of ros2cli, which has only just started, may not know all of the graph at first: the command is given
        again until it prints what is expected.
        """
        words, until = shlex.split(command), time.monotonic() + LONG
        while True:
            done = subprocess.run(
                words, capture_output=True, text=True, check=False, env=self._environment, timeout=LONG
            )
            known = done.returncode == 0 and expected in done.stdout
            if known or time.monotonic() > until:
                assert known, done.stdout + done.stderr
                return done.stdout

    def close(self) -> None:
        ChildProcess.close(self)
        self.kill_processes()


Launch = Callable[..., LaunchCall]


@pytest.fixture
def domain() -> Iterator[int]:
    with private_domain() as number:
        yield number


@pytest.fixture
def launch(tmp_path: Path, domain: int) -> Iterator[Launch]:
    """Start a launch file with arguments; a mapping is written as the scenario."""
    calls: list[LaunchCall] = []

    def start(name: str, scenario: str | dict[str, object], *arguments: str) -> LaunchCall:
        folder = tmp_path / f"launch{len(calls)}"
        if not isinstance(scenario, str):
            path = tmp_path / "scenario.yaml"
            path.write_text(yaml.safe_dump(scenario), encoding="utf-8")
            scenario = str(path)
        calls.append(LaunchCall(folder, domain, name, f"scenario:={scenario}", f"out:={folder / 'out'}", *arguments))
        return calls[-1]

    yield start
    for call in calls:
        call.close()


def test_a_crossing_ends_the_launch_and_says_where_its_results_are(launch: Launch) -> None:
    call = launch("crossing", SHORT, "mode:=lockstep")
    assert call.finish() == 0, call.output
    assert str(call.out) in call.output
    assert "succeeded" in call.output
    # into a file go neither colours nor a progress bar
    assert not set("\x1b\r") & set(call.stdout + call.stderr)
    assert (call.out / "summary.json").is_file()
    assert (call.out / "report.html").is_file()
    call.expect_no_process(0.0)


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"tracking_error_limit": 1e-6}, "tracking_lost"),
        ({"waypoints": [[0.0, 0.15], [0.0, 0.5]], "segment_duration": 1.0}, "out of reach"),
    ],
)
def test_a_failing_run_fails_the_launch(launch: Launch, change: dict[str, object], word: str) -> None:
    call = launch("crossing", {**SHORT, **change})
    assert call.finish() != 0, call.output
    assert word in call.output
    call.expect_no_process(0.0)


def test_a_killed_node_ends_the_launch(launch: Launch) -> None:
    call = launch("crossing", {**SHORT, "segment_duration": LONG})
    end = time.monotonic() + RUN_DEADLINE
    while not under_way(call):
        assert call.status is None, call.output
        assert time.monotonic() < end, call.output
        time.sleep(0.1)
    os.kill(call.node("supervisor"), signal.SIGKILL)
    assert call.finish() != 0, call.output
    assert "node_died" in (call.out / "summary.json").read_text(encoding="utf-8") + call.output
    call.expect_no_process(0.0)


@pytest.mark.parametrize(
    ("number", "to"),
    [*((number, "the launch") for number in STOP_SIGNALS), (signal.SIGINT, "its group"), (signal.SIGTERM, "all")],
)
def test_a_signal_ends_the_run_in_order(launch: Launch, number: signal.Signals, to: str) -> None:
    """An IDE sends it to the launch alone, a terminal to its group, a service manager to all processes."""
    call = launch("crossing", {**SHORT, "segment_duration": LONG})
    end = time.monotonic() + RUN_DEADLINE
    while not under_way(call):
        assert call.status is None, call.output
        assert time.monotonic() < end, call.output
        time.sleep(0.1)
    if to == "the launch":
        call.send(number)
    elif to == "its group":
        os.killpg(call.pid, number)
    else:
        for pid in sorted(call.processes(), reverse=True):
            os.kill(pid, number)
    assert call.finish() != 0, call.output
    # a launch that is terminated or hung up does not wait for its processes
    call.expect_no_process(RUN_DEADLINE)
    summary = json.loads((call.out / "summary.json").read_text(encoding="utf-8"))
    assert summary["outcome"] == "interrupted"
    assert summary["samples"] < summary["planned_samples"]
    assert not read_bag(call.out / "bag").field(TORQUE_COMMAND, "effort")[-1].any()


def under_way(call: LaunchCall) -> bool:
    """Whether the recorder has written some commands."""
    try:
        return read_bag(call.out / "bag").count(TORQUE_COMMAND) > 50
    except BagError:
        return False


def test_a_rehearsal_ends_the_launch(launch: Launch) -> None:
    call = launch("robot", "middle_robot", "hardware:=emulated")
    # whether it succeeds in real time depends on the machine; the launch says which, and ends
    assert (call.finish() == 0) == ("succeeded" in call.output), call.output
    assert str(call.out) in call.output
    call.expect_no_process(0.0)


def test_a_motor_board_needs_a_port(launch: Launch) -> None:
    call = launch("robot", "motkin_middle", "hardware:=usb")
    assert call.finish() != 0, call.output
    assert "--port: expected together with --hardware usb" in call.output
    call.expect_no_process(0.0)


def test_a_bench_that_starts_later_is_waited_for_and_crossed_with(tmp_path: Path) -> None:
    emulation, drives = emulated(tmp_path)
    with Bench(tmp_path) as bench:
        call = LaunchCall(tmp_path / "launched", bench.domain, "motkin", f"drives:={drives}", **dds_variables())
        try:
            end = time.monotonic() + RUN_DEADLINE
            while "waits for the controller manager /controller_manager" not in call.output:
                assert call.status is None, call.output
                assert time.monotonic() < end, call.output
                time.sleep(0.1)
            bench.run([*module_command("fivebar_sim.emulators.drives"), str(emulation)])
            with described(bench, description()):
                # how near it keeps to its path depends on the machine; the launch says whether it did, and ends
                assert (call.finish() == 0) == ("succeeded" in call.output), call.output
            assert "of 601 samples" in call.output
        finally:
            call.close()


def test_a_bench_of_other_lengths_is_refused(tmp_path: Path) -> None:
    emulation, drives = emulated(tmp_path)
    with Bench(tmp_path) as bench, described(bench, description(crank=0.07)):
        bench.run([*module_command("fivebar_sim.emulators.drives"), str(emulation)])
        call = LaunchCall(tmp_path / "launched", bench.domain, "motkin", f"drives:={drives}", **dds_variables())
        try:
            assert call.finish() != 0, call.output
        finally:
            call.close()
    assert "l_11 is 70.0 mm, expected 60.0 mm as robot motkin has" in call.output
    call.expect_no_process(0.0)


def test_drives_on_a_bus_wait_for_the_operator(launch: Launch) -> None:
    # there is no such bus here: nothing opens it before the operator configures the bridge
    call = launch("robot", "middle_robot", "hardware:=socketcan")
    end = time.monotonic() + RUN_DEADLINE
    while "dextar_bridge" not in call.processes().values():
        assert call.status is None, call.output
        assert time.monotonic() < end, call.output
        time.sleep(0.1)
    assert "ros2 lifecycle set /dextar_bridge configure" in call.output
    call.send(signal.SIGINT)
    assert call.finish() != 0, call.output
    call.expect_no_process(0.0)


@pytest.mark.skipif(not installed("robot_state_publisher"), reason="robot_state_publisher is not installed")
def test_the_view_publishes_the_described_robot(tmp_path: Path, domain: int) -> None:
    probe = Probe(domain)
    description = Topic("robot_description", "std_msgs/msg/String", STATE_QOS)
    probe.listen(description)
    call = LaunchCall(tmp_path / "view", domain, "view", "robot:=unequal", "rviz:=false", **dds_variables())
    try:
        probe.wait_for(
            lambda: probe.got(description) or call.status is not None, "the description", deadline=RUN_DEADLINE
        )
        assert call.status is None, call.output
        assert probe.got(description)[0].data == described_robot("unequal")
        call.send(signal.SIGINT)
        call.finish()
        call.expect_no_process(10.0)
    finally:
        call.close()
        probe.close()


def last_sample(probe: Probe) -> int:
    """Return the last sample that the status of the run tells of, -1 before the first one."""
    told = probe.got(RUN_STATUS)
    return int(json.loads(told[-1].data)["sample"]) if told else -1


def test_nodes_of_a_scenario_are_part_of_a_cell(tmp_path: Path, domain: int) -> None:
    """The launch file and the commands of docs/ros.md, with a namespace, a gain and remappings around the nodes."""
    (file,) = [block for block in blocks(PAGE) if block.file == "cell.launch.py"]
    (tmp_path / file.file).write_text(file.text, encoding="utf-8")
    probe = Probe(domain, "cell")
    probe.listen(RUN_STATUS, REMAPPED_TORQUE)
    call = LaunchCall(tmp_path / "cell", domain, tmp_path / file.file, **dds_variables())
    try:
        probe.wait_for(
            lambda: call.status is not None or last_sample(probe) > 1100,
            "the end of the crossing",
            deadline=RUN_DEADLINE,
        )
        assert call.status is None, call.output
        # which may arrive later than what is told about them
        probe.wait_for(
            lambda: (sample_of_stamp(stamp_of(probe.got(REMAPPED_TORQUE)[-1]), RATE_HZ) or 0) >= 1000,
            "torques of the crossing",
        )
        assert probe.parameter("/cell/unified_controller", "unified.kp") == 1100.0
        assert probe.node.count_publishers("/clock") == 1
        assert not probe.node.count_publishers("/cell/torque_command")
        if shutil.which("ros2"):
            listing, asking = command_lines(PAGE, "ros2 topic list", "ros2 param get")
            for topic in ("/cell/joint_states", "/cell/motors/torque", "/clock"):
                call.ask(listing, topic)
            call.ask(asking, "1100.0")
            call.ask("ros2 daemon stop")
        call.send(signal.SIGINT)
        call.finish()
        call.expect_no_process(RUN_DEADLINE)
    finally:
        call.close()
        probe.close()
    summary = write_report(RunDirectory(call.folder / "in_the_cell"), with_page=False)
    assert (summary.assembly_mode_changes, summary.faults) == (2, [])
    assert summary.tracking_error_peak_m < 2e-3


def test_two_robots_share_a_cell(tmp_path: Path, domain: int) -> None:
    """The first command of docs/ros.md: one clock, one bag, and each robot crosses as it does alone."""
    (command, _) = command_lines(PAGE, "ros2 launch fivebar_bringup cell.launch.py")
    arguments = shlex.split(command)[4:]
    probe = Probe(domain, "left")
    probe.listen(CELL_CLOCK)
    call = LaunchCall(tmp_path / "cell", domain, "cell", *arguments, **dds_variables())
    folder = call.folder / "two_robots"
    try:
        end = RUN_DEADLINE
        probe.wait_for(lambda: call.status is not None or call.output.count("has ended") == 2, "the end", deadline=end)
        assert call.status is None, call.output
        assert probe.node.count_publishers("/clock") == 1
        call.send(signal.SIGINT)
        call.finish()
        call.expect_no_process(RUN_DEADLINE)
    finally:
        call.close()
        probe.close()
    stamps = [stamp_of_clock(message) for message in probe.got(CELL_CLOCK)]
    assert stamps == sorted(stamps)
    assert set(np.diff(stamps)) <= {0, 2_000_000}
    for robot in ("left", "right"):
        summary = write_report(RunDirectory(folder / robot), with_page=False, namespace=f"/{robot}")
        assert (summary.outcome, summary.samples, summary.dropped_messages) == ("succeeded", 1001, 0)


def stamp_of_clock(message: Any) -> int:
    return int(message.clock.sec) * NANOSECONDS + int(message.clock.nanosec)


@pytest.mark.skipif(shutil.which("ros2") is None, reason="ros2cli comes with a ROS 2 installation")
def test_goals_are_sent_and_followed_from_the_command_line(tmp_path: Path, domain: int) -> None:
    """The commands of docs/ros.md: poses and trajectories are driven to, a motion pauses, goes on and is cancelled."""
    (command,) = command_lines(PAGE, "ros2 launch fivebar_bringup control.launch.py")
    poses, trajectories = (command_lines(PAGE, f"ros2 topic pub --once /{name}") for name in ("goal_pose", "goal_traj"))
    echoes = command_lines(PAGE, "ros2 topic echo --once --field message")
    calls = {line.split("/")[2].split()[0]: line for line in command_lines(PAGE, "ros2 service call")}
    probe = Probe(domain)
    probe.listen(GOAL_STATUS, RUN_STATUS)
    probe.advertise(GOAL)
    call = LaunchCall(tmp_path / "goals", domain, "control", *shlex.split(command)[4:], **dds_variables())

    def told() -> list[str]:
        return [json.loads(status.data)["state"] for status in probe.received[GOAL_STATUS.name]]

    def wait_for(state: str) -> None:
        probe.wait_for(
            lambda: call.status is not None or told()[-1:] == [state], f"{state}, told: {told()}", deadline=RUN_DEADLINE
        )
        assert call.status is None, call.output

    def rests() -> bool:
        # 1000 samples are the run's own motion
        return last_sample(probe) > 1010

    try:
        probe.wait_for(lambda: call.status is not None or rests(), "the end of the crossing", deadline=RUN_DEADLINE)
        for number, (line,) in enumerate((poses, trajectories), start=1):
            call.ask(line)
            probe.wait_for(
                lambda number=number: call.status is not None or told().count("arrived") == number,
                f"arrival {number}, told: {told()}",
                deadline=RUN_DEADLINE,
            )
            assert told()[-3:] == ["planning", "moving", "arrived"]
            assert call.ask(echoes[0]).splitlines()[0] == "arrived"
        probe.publish(GOAL, JointState(name=["x", "y", "duration"], position=[0.0, 0.03, 40.0]))
        for name, state in (("pause", "paused"), ("resume", "resumed"), ("cancel", "cancelled")):
            wait_for({"pause": "moving", "resume": "paused", "cancel": "resumed"}[name])
            assert "success=True" in call.ask(calls[name])
            wait_for(state)
        call.ask("ros2 daemon stop")
        call.send(signal.SIGINT)
        call.finish()
        call.expect_no_process(RUN_DEADLINE)
    finally:
        call.close()
        probe.close()


@pytest.mark.skipif(installed("rviz2"), reason="rviz2 is installed")
@pytest.mark.parametrize("name", ["view", "control", "cell"])
def test_without_rviz_its_windows_are_refused_in_one_line(tmp_path: Path, domain: int, name: str) -> None:
    call = LaunchCall(tmp_path / "rviz", domain, name, "rviz:=true")
    try:
        assert call.finish() != 0
        (line,) = [line for line in call.output.splitlines() if "rviz2" in line]
        assert line.endswith("expected installed packages of ROS")
    finally:
        call.close()


@pytest.mark.parametrize(
    ("name", "around", "word"),
    [
        ("crossing", 'PushRosNamespace("cell")', "PushRosNamespace cell"),
        ("robot", 'SetParameter("zone.epsilon", 0.05)', "SetParameter zone.epsilon"),
        ("crossing", 'SetRemap("joint_states", "states")', "SetRemap joint_states:=states"),
    ],
)
def test_a_run_refuses_what_is_set_around_it(tmp_path: Path, domain: int, name: str, around: str, word: str) -> None:
    path = share_file("fivebar_bringup", "launch", f"{name}.launch.py")
    (tmp_path / "around.launch.py").write_text(AROUND.format(around=around, path=str(path)), encoding="utf-8")
    call = LaunchCall(tmp_path / "around", domain, tmp_path / "around.launch.py")
    try:
        assert call.finish() != 0
        assert f"{name}.launch.py: {word}: is not honoured here" in call.output
    finally:
        call.close()


def test_what_does_not_go_together_is_refused(tmp_path: Path, domain: int) -> None:
    call = LaunchCall(tmp_path / "wrong", domain, "control", "hardware:=simulated", "drives:=mine.yaml")
    try:
        assert call.finish() != 0
        assert "drives: expected hardware:=emulated, socketcan, usb, external or real" in call.output
    finally:
        call.close()


def test_emulated_robots_share_a_cell(tmp_path: Path, domain: int) -> None:
    """The second command of docs/ros.md, without RViz where that is not installed: both robots are powered and move."""
    (_, command) = command_lines(PAGE, "ros2 launch fivebar_bringup cell.launch.py")
    arguments = shlex.split(command)[4:]
    if not installed("rviz2"):
        arguments.remove("rviz:=true")
    probes = [Probe(domain, robot) for robot in ("left", "right")]
    for probe in probes:
        probe.listen(RUN_STATUS)
    call = LaunchCall(tmp_path / "cell", domain, "cell", *arguments, **dds_variables())
    try:
        for probe in probes:
            probe.wait_for(
                lambda probe=probe: call.status is not None or last_sample(probe) > 100,
                "a robot that moves",
                deadline=RUN_DEADLINE,
            )
            assert call.status is None, call.output
        call.send(signal.SIGINT)
        call.finish()
        call.expect_no_process(RUN_DEADLINE)
    finally:
        call.close()
        for probe in probes:
            probe.close()
