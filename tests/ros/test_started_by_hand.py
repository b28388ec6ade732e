# SPDX-License-Identifier: Apache-2.0
"""A node that is started by hand, with the parameter file that a run has left: it says what it waits for, and works."""

from __future__ import annotations

import math
import signal
import sys
from pathlib import Path

import pytest
from bound_laws import bound_law
from forked_node import ForkedNode
from graph_probe import RATE_HZ, Bench, ChildProcess
from middle_motion import MiddleMotion

from fivebar_bringup.bag import RECORDER
from fivebar_bringup.bag.reader import read_bag
from fivebar_bringup.graph.crossing_graph import crossing_graph
from fivebar_bringup.graph.node_spec import Mode
from fivebar_bringup.runs.processes import processes
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_control.model.kinematics import state_from_joints
from fivebar_description.interface import CTC_TORQUE, FAULTS, GROUND_TRUTH, JOINT_STATES, REFERENCE

KP = 900.0


@pytest.fixture
def left(tmp_path: Path) -> dict[str, Path]:
    """The parameter files of a run, by node, with another gain than by default."""
    content = load_scenario("middle").model_dump(mode="json")
    content["gains"]["kp"] = KP
    scenario = Scenario.model_validate(content)
    graph = crossing_graph(scenario, Mode.LOCKSTEP, tmp_path / "bag")
    (tmp_path / "scenario.yaml").write_text(scenario.to_yaml(), encoding="utf-8")
    folder = tmp_path / "parameters"
    folder.mkdir()
    for process in processes(graph, Mode.LOCKSTEP, RATE_HZ):
        process.prepare(folder, "")
    return {path.stem: path for path in folder.iterdir()}


def lines_of(process: ForkedNode | ChildProcess) -> list[str]:
    """What a node has said, without time stamps."""
    return [line.partition("]: ")[2] for line in process.stderr.splitlines()]


def test_a_controller_says_what_it_waits_for_and_answers_with_the_runs_gain(
    bench: Bench, motion: MiddleMotion, left: dict[str, Path]
) -> None:
    process = bench.start("ctc_controller", arguments=["--params-file", str(left["ctc_controller"])])
    probe = bench.probe()
    probe.publish_plan()
    # it has looked for its inputs several times by then
    probe.health("/ctc_controller")
    assert lines_of(process) == ["waits for /reference, /joint_states, /run/plan"]
    probe.join("ctc_controller", [JOINT_STATES, REFERENCE], [CTC_TORQUE])
    probe.wait_for(lambda: len(lines_of(process)) > 1, "the second line")
    assert lines_of(process)[1].startswith("ready: all inputs are there, plan ")

    inputs = ((REFERENCE, motion.reference_message(7)), (JOINT_STATES, motion.joint_states_message(7)))
    probe.ask(inputs, [CTC_TORQUE], 7)
    law = bound_law("ctc", motion.robot, motion.plan, RATE_HZ, kp=KP, kd=100.0)
    assert tuple(probe.answer(CTC_TORQUE, 7).effort) == law(7, motion.state(7), motion.reference(7))
    assert len(lines_of(process)) == 2


@pytest.mark.extra
def test_a_recorder_leaves_the_bag_of_the_run_and_makes_another(
    bench: Bench, motion: MiddleMotion, left: dict[str, Path]
) -> None:
    def record(process: ForkedNode | ChildProcess, directory: Path) -> None:
        probe = bench.probe()
        probe.advertise(JOINT_STATES)
        probe.wait_for(lambda: probe.listeners(JOINT_STATES), "the recorder listens")
        probe.publish(JOINT_STATES, motion.joint_states_message(0))
        assert probe.delivered(JOINT_STATES)
        probe.wait_for(lambda: lines_of(process), "the first line")
        process.send(signal.SIGINT)
        assert process.wait() == 0, process.stderr
        assert lines_of(process)[0].startswith("waits for /joint_states, /reference, /ctc/torque, /vhc/torque, ")
        assert read_bag(directory).count(JOINT_STATES) == 1

    parameters = ["--params-file", str(left[RECORDER])]
    record(bench.start(RECORDER, arguments=parameters), bench.folder / "bag")
    kept = {path.name: path.read_bytes() for path in (bench.folder / "bag").iterdir()}
    # what `ros2 run` starts
    executable = str(Path(sys.executable).with_name(RECORDER))
    record(bench.run([executable, "--ros-args", *parameters]), bench.folder / "bag-2")
    assert {path.name: path.read_bytes() for path in (bench.folder / "bag").iterdir()} == kept


def test_the_scenario_is_enough_for_every_node_of_a_graph(bench: Bench) -> None:
    """As a user starts them with `ros2 run`, in any order: the plant learns from the plan where the motion begins."""
    nodes = ["blender", "plant", "imu_listener", "state_estimator", "unified_controller", "supervisor"]
    processes = {node: bench.start(node, scenario="motkin_middle") for node in (*nodes, "trajectory_generator")}
    probe = bench.probe()
    probe.listen(GROUND_TRUTH, FAULTS)
    assert processes["plant"].wait() == 0
    scenario = load_scenario("motkin_middle")
    last = scenario.plan().path.samples(scenario.rate_hz)
    message = probe.answer(GROUND_TRUTH, last, scenario.rate_hz)
    there = state_from_joints(scenario.five_bar(), *message.position, *message.velocity)
    assert math.dist((there.x, there.y), scenario.waypoints[-1]) < 1e-3
    assert not probe.got(FAULTS)
