# SPDX-License-Identifier: Apache-2.0
"""Runs that go wrong: they end by themselves, without torque, with a cause by name and a bag to look at."""

from __future__ import annotations

import os
import re
import shutil
import signal
import time
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import pytest
from fivebar_command import RUN_DEADLINE, FivebarCommand, GraphRun, InstalledCommand
from mcap.reader import make_reader
from rosbags.rosbag2 import Reader

from fivebar_bringup.bag.reader import read_bag
from fivebar_description.interface import FAULTS, JOINT_STATES, NANOSECONDS, TORQUE_COMMAND
from fivebar_description.interrupts import STOP_SIGNALS
from fivebar_description.ros.messages import stamp_of

ZERO = (0.0, 0.0)


def test_ctc_alone_asks_for_too_much_on_the_locus(fivebar: Callable[..., FivebarCommand]) -> None:
    call = fivebar("run", "ctc_middle", "--json", "--out", "out")
    assert call.finish() == 1
    assert call.stderr == ""
    summary = call.json()
    assert summary["outcome"] == "stopped"
    assert max(summary["torque_requested_peak_nm"]) > 100.0
    assert summary["faults"]
    assert all(name.isidentifier() for name in summary["faults"])
    bag = read_bag(call.folder / "out" / "bag")
    assert [text.partition(":")[0] for text in bag.texts(FAULTS)] == summary["faults"]
    assert tuple(bag.field(TORQUE_COMMAND, "effort")[-1]) == ZERO
    call.expect_no_process(0.0)


CAUSES = {
    "ctc_controller": (
        "candidate_missing: no ctc/torque for sample ",
        "node_died: ctc_controller ended with status -9",
    ),
    "supervisor": ("candidate_missing: no supervisor/state for sample ", "node_died: supervisor ended with status -9"),
    "trajectory_generator": (
        "candidate_missing: no reference",
        "node_died: trajectory_generator ended with status -9",
    ),
    "blender": ("command_timeout: no torque for sample ", "node_died: blender ended with status -9"),
    "plant": ("node_died: plant ended with status -9",),
    "bag_recorder": ("node_died: bag_recorder ended with status -9",),
}


ALIKE = ("ctc_controller", "supervisor", "trajectory_generator", "blender")
"""Nodes of the control chain, which the fault matrix kills too."""


@pytest.mark.parametrize(
    "victim", [pytest.param(one, marks=pytest.mark.extra) if one in ALIKE else one for one in CAUSES]
)
def test_a_killed_node_ends_the_run(graph_run: Callable[..., GraphRun], victim: str) -> None:
    run = graph_run()
    # the recorder is given the time for some checkpoints
    run.wait_for_sample(600 if victim == "bag_recorder" else 150)
    killed_at = time.time_ns()
    os.kill(run.command.node(victim), signal.SIGKILL)
    summary = run.finish()
    run.command.expect_no_process(0.0)
    for cause in CAUSES[victim]:
        assert any(detail.startswith(cause) for detail in summary["fault_details"]), summary["fault_details"]
    bag = run.bag()
    assert bag.count(JOINT_STATES) > 100
    if victim != "blender":
        run.expect_no_torque()
    if victim not in ("blender", "bag_recorder"):
        assert tuple(bag.field(TORQUE_COMMAND, "effort")[-1]) == ZERO
    if victim == "bag_recorder":
        expect_at_most_a_second_lost(run, killed_at)


def expect_at_most_a_second_lost(run: GraphRun, killed_at: int) -> None:
    bag = run.bag()
    for topic in (JOINT_STATES, TORQUE_COMMAND):
        sent = dict(zip(map(stamp_of, run.probe.got(topic)), run.probe.sent(topic), strict=True))
        assert sent[bag.stamps(topic)[-1]] * NANOSECONDS > killed_at - NANOSECONDS
        # the part that is there has no gap
        stamps = sorted(set(bag.stamps(topic).tolist()))
        assert {after - before for before, after in pairwise(stamps)} == {2_000_000}
    directory = run.out / "bag"
    with Reader(directory) as reader:
        count = sum(1 for _ in reader.messages())
        assert reader.message_count == count
    (path,) = directory.glob("*.mcap")
    with path.open("rb") as stream:
        assert sum(1 for _ in make_reader(stream).iter_messages()) == count


@pytest.mark.parametrize(
    "number", [pytest.param(one, marks=() if one is signal.SIGINT else pytest.mark.extra) for one in STOP_SIGNALS]
)
def test_an_interrupted_run_ends_in_order(graph_run: Callable[..., GraphRun], number: signal.Signals) -> None:
    run = graph_run()
    run.wait_for_sample(150)
    nodes = [pid for pid in run.command.processes() if pid != run.command.pid]
    assert len(nodes) == 8
    run.command.send(number)
    # whoever sends one signal may send another while the nodes are stopped
    run.command.send(signal.SIGTERM)
    # the robot stops at once; figures and page take the launcher some more seconds
    run.probe.wait_for(lambda: not set(nodes) & set(run.command.processes()), "the end of all nodes")
    summary = run.finish()
    assert (summary["outcome"], summary["faults"]) == ("interrupted", ["interrupted"])
    assert 100 < summary["samples"] < summary["planned_samples"]
    run.expect_no_torque()
    assert tuple(run.bag().field(TORQUE_COMMAND, "effort")[-1]) == ZERO
    assert run.bag().custom_data["dropped"] == "0", dict(run.bag().custom_data)
    run.command.expect_no_process(0.0)


@pytest.mark.extra
def test_a_signal_to_all_processes_of_a_run_ends_it_in_order(graph_run: Callable[..., GraphRun]) -> None:
    """As a service manager stops a group: SIGTERM to each process, here to the launcher last."""
    run = graph_run()
    run.wait_for_sample(150)
    for pid in sorted(run.command.processes(), key=lambda pid: pid == run.command.pid):
        os.kill(pid, signal.SIGTERM)
    summary = run.finish()
    assert (summary["outcome"], summary["faults"]) == ("interrupted", ["interrupted"]), summary["fault_details"]
    assert 100 < summary["samples"] < summary["planned_samples"]
    run.expect_no_torque()
    assert tuple(run.bag().field(TORQUE_COMMAND, "effort")[-1]) == ZERO
    assert run.bag().custom_data["dropped"] == "0", dict(run.bag().custom_data)
    run.command.expect_no_process(0.0)


@pytest.mark.extra
def test_a_run_whose_directory_is_deleted_ends_in_one_line(graph_run: Callable[..., GraphRun]) -> None:
    run = graph_run()
    run.wait_for_sample(150)
    shutil.rmtree(run.out)
    run.probe.wait_for(lambda: run.command.status is not None, "the end of the run", deadline=RUN_DEADLINE)
    assert run.command.finish() == 2
    words = ": cannot be used for the results: No such file or directory"
    assert re.fullmatch(f"fivebar: {re.escape(str(run.out))}/[a-z/._]+{words}\n", run.command.stderr)
    run.expect_no_torque()
    run.command.expect_no_process(0.0)


@pytest.mark.extra
def test_a_run_that_never_gets_going_ends_too(folder: Path) -> None:
    """The interrupt comes while the nodes still start."""
    call = InstalledCommand(folder / "interrupted", "run", "middle", "--json", "--out", "out")
    try:
        end = time.monotonic() + RUN_DEADLINE
        while len(call.processes()) < 4 and time.monotonic() < end:
            time.sleep(0.02)
        call.send(signal.SIGINT)
        assert call.finish() == 1
        assert "Traceback" not in call.stderr
        # those that had not begun end by themselves, and nobody waits for them
        call.expect_no_process(RUN_DEADLINE)
    finally:
        call.close()
