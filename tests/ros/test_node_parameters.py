# SPDX-License-Identifier: Apache-2.0
"""Parameters: every node starts with its defaults and explains them, bad values end it, gains can be tuned."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import pytest
from bound_laws import bound_law
from console_scripts import console_scripts
from forked_node import ForkedNode
from graph_probe import RATE_HZ, Bench, Probe, node_modules
from middle_motion import MiddleMotion
from rcl_interfaces.msg import Parameter, ParameterDescriptor, ParameterType
from rcl_interfaces.srv import GetParameters, ListParameters, SetParameters
from stopped_nodes import complaints_of, expect_orderly_end

from fivebar_bringup.bag.reader import read_bag
from fivebar_bringup.drives.choice import write_drive_files
from fivebar_bringup.drives.run_files import Rehearsal
from fivebar_bringup.graph.crossing_graph import crossing_graph
from fivebar_bringup.graph.node_spec import Mode
from fivebar_bringup.runs.processes import processes
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_control.laws.gains import UnifiedSettings
from fivebar_control.laws.robot_sizes import law_sizes
from fivebar_description.interface import CTC_TORQUE, JOINT_STATES, REFERENCE
from fivebar_description.robot_file import read_robot

NODES = sorted(node_modules())
OF_ROS = ("use_sim_time", "start_type_description_service")
"""Parameters that every ROS node has."""

NUMBERS = (ParameterType.PARAMETER_DOUBLE, ParameterType.PARAMETER_INTEGER, ParameterType.PARAMETER_DOUBLE_ARRAY)


@pytest.fixture(scope="module")
def started(shared_bench: Bench) -> dict[str, ForkedNode]:
    """Each node with its defaults, alone in its namespace."""
    # by itself the plant would give up after some seconds, which on a busy machine may be before it is asked
    more = {"plant": {"command_timeout_s": 600.0}}
    return {node: shared_bench.start(node, f"/{node}", **more.get(node, {})) for node in NODES}


@pytest.fixture(scope="module")
def descriptors(shared_bench: Bench, started: dict[str, ForkedNode]) -> dict[str, dict[str, ParameterDescriptor]]:
    """Each node asked for its parameters."""
    probe = shared_bench.probe()
    found = {}
    for node, process in started.items():
        found[node] = {one.name: one for one in probe.describe(f"/{node}/{node}") if one.name not in OF_ROS}
        assert process.status is None
        assert complaints_of(process) == []
    return found


def test_there_are_nodes() -> None:
    assert {"blender", "plant", "bag_recorder", "trajectory_generator", "supervisor"} < set(NODES)


@pytest.mark.parametrize("node", NODES)
def test_every_parameter_is_explained(descriptors: dict[str, dict[str, ParameterDescriptor]], node: str) -> None:
    assert descriptors[node]
    for name, descriptor in descriptors[node].items():
        assert len(descriptor.description.split()) >= 2, f"{name}: {descriptor.description!r}"
        assert descriptor.type != ParameterType.PARAMETER_NOT_SET


@pytest.mark.parametrize("node", NODES)
def test_every_number_has_a_unit_or_a_range(descriptors: dict[str, dict[str, ParameterDescriptor]], node: str) -> None:
    for name, descriptor in descriptors[node].items():
        # a depth that is none is refused otherwise, since rclpy declares these
        if descriptor.type in NUMBERS and not name.startswith("qos_overrides."):
            ranges = [*descriptor.floating_point_range, *descriptor.integer_range]
            assert ranges or "unit: " in descriptor.additional_constraints, name
            assert all(one.from_value < one.to_value for one in ranges), name


@pytest.mark.parametrize("node", NODES)
def test_the_example_of_a_nodes_help_sets_parameters_that_it_has(
    descriptors: dict[str, dict[str, ParameterDescriptor]], node: str
) -> None:
    example = console_scripts()[node].load().example
    named = re.findall(r"-p (\w+):=", example)
    assert named
    assert set(named) <= set(descriptors[node])


@pytest.mark.parametrize("scenario", ["middle", "unified_middle", "middle_robot"])
def test_a_graph_sets_only_parameters_that_its_nodes_have(
    descriptors: dict[str, dict[str, ParameterDescriptor]], scenario: str, tmp_path: Path
) -> None:
    """ROS ignores a parameter that no node declares. Nodes with another law than by default have other parameters."""
    loaded = load_scenario(scenario)
    graphs = [crossing_graph(loaded, mode, tmp_path, scene=True) for mode in Mode]
    if scenario == "middle_robot":
        graphs.append(crossing_graph(loaded, Mode.REALTIME, tmp_path, Rehearsal(write_drive_files(loaded, tmp_path))))
    for graph in graphs:
        for process in processes(graph, Mode.REALTIME, loaded.rate_hz):
            for node in process.nodes:
                assert set(node.parameters) <= set(descriptors[node.executable]), node.executable


@pytest.mark.usefixtures("descriptors")
def test_a_signal_ends_every_node(shared_bench: Bench, started: dict[str, ForkedNode]) -> None:
    expect_orderly_end(started, 0)
    assert read_bag(shared_bench.folder / "processes" / "bag").topics


REFUSED: list[tuple[str, dict[str, Any], str]] = [
    ("ctc_controller", {"gains.kp": -1.0}, "parameter gains.kp: expected 0.0 to 1000000.0 1/s^2"),
    ("ctc_controller", {"gains.kd": "much"}, "parameter gains.kd: "),
    ("ctc_controller", {"gains.kp": math.nan}, "parameter gains.kp: "),
    ("ctc_controller", {"working_mode": [1, 0]}, "working_mode: [1, 0]: expected two signs, each +1 or -1"),
    ("vhc_controller", {"vhc_resolution": "best"}, "parameter vhc_resolution: "),
    ("vhc_controller", {"working_modes": [1, -1] * 3}, "controller multi_cartesian cannot meet Type 1"),
    ("vhc_controller", {"controller": "unified"}, "its laws run in unified_controller"),
    ("unified_controller", {"working_modes": [1, -1] * 2}, "2 given for 3 waypoints"),
    ("unified_controller", {"unified.weight": 0.0}, "unified.weight: expected 1e-12 to 1000000000000.0 (m/s^2 / Nm)^2"),
    ("supervisor", {"waypoints": [0.0, 0.15, 0.3, 0.15, 0.0, 0.15]}, "segment 1: (0.3000, 0.1500) m is out of reach"),
    ("supervisor", {"waypoints": [0.0, 0.15, math.nan, 0.15, 0.0, 0.15]}, "parameter waypoints: "),
    ("trajectory_generator", {"waypoints": [0.0, 0.15, 0.0]}, ": 3 numbers: expected pairs"),
    ("trajectory_generator", {"segment_duration": [1.0, 1.0, 1.0]}, "segment_duration: 3 given for 2 segments"),
    ("trajectory_generator", {"robot": "hexapod"}, "robot 'hexapod': expected one of dextar"),
    ("trajectory_generator", {"controller": "pid"}, "controller: 'pid': expected one of ctc, multi_joint"),
    ("trajectory_generator", {"safety.workspace": [0.1, -0.1, 0.0, 0.2]}, "expected x_min < x_max"),
    ("blender", {"robot": "no/such/file.yaml"}, "no/such/file.yaml: cannot be read"),
    ("blender", {"candidate_deadline_ms": 0.5}, "candidate_deadline_ms: 0.5: expected at least 1, at most 60000"),
    ("imu_listener", {"rate_hz": 0}, "parameter rate_hz: expected 1 to 10000 Hz"),
    ("blender", {"rate_hz": 7}, "expected a rate that divides 1e9"),
    ("plant", {"mode": "fast"}, "parameter mode: "),
    ("plant", {"initial_joints": [0.0, 0.0]}, "initial_joints: "),
    ("plant", {"plant.mass_scale": math.nan}, "parameter plant.mass_scale: "),
    ("plant", {"plant.friction_scale": -0.1}, "parameter plant.friction_scale: expected 0.0 to 1000.0"),
    ("plant", {"imu.bias": [0.1]}, "imu.bias"),
    ("blender", {"safety.workspace": [0.1, -0.1, 0.0, 0.2]}, "expected x_min < x_max"),
    ("blender", {"working_mode": [1]}, "working_mode"),
    ("supervisor", {"zone.epsilon": 0.5}, "parameter zone.epsilon: 0.5: expected above 0, below 0.5"),
    ("supervisor", {"zone_epsilon": 0.05}, "parameter zone_epsilon: no such parameter: expected zone.epsilon"),
    ("ctc_controller", {"kp": 900.0}, "parameter kp: no such parameter: expected gains.kp"),
    ("bag_recorder", {"topics": ["joint_states", "gossip"]}, "topics: 'gossip': expected some of joint_states"),
    ("bag_recorder", {"directory": "."}, "directory: .: exists already"),
    # ROS reads an empty list as no value
    ("supervisor", {"waypoints": []}, "parameter waypoints: has no value"),
    ("bag_recorder", {"topics": []}, "parameter topics: has no value"),
    ("blender", {"rate_hz": []}, "has no value, as ROS reads an empty list: expected a value such as 500"),
    ("supervisor", {"rate_hs": 500, "use_sim_time": False}, "parameter rate_hs: no such parameter: expected rate_hz"),
    # before a bag or a page is made
    ("bag_recorder", {"topic": ["joint_states"]}, "parameter topic: no such parameter: expected topics"),
    ("viewer", {"ports": 0}, "parameter ports: no such parameter: expected port"),
]  # fmt: skip


@pytest.fixture(scope="module")
def refused(tmp_path_factory: pytest.TempPathFactory) -> list[ForkedNode]:
    """All refused nodes; they run side by side, since none of them is to join a graph."""
    with Bench(tmp_path_factory.mktemp("refused")) as bench:
        processes = [bench.start(node, f"/n{number}", **bad) for number, (node, bad, _) in enumerate(REFUSED)]
        for process in processes:
            process.wait(60.0)
        return processes


@pytest.mark.parametrize("number", range(len(REFUSED)), ids=[f"{node}-{next(iter(bad))}" for node, bad, _ in REFUSED])
def test_a_bad_value_ends_the_node_in_one_line(refused: list[ForkedNode], number: int) -> None:
    process, (_, _, wanted) = refused[number], REFUSED[number]
    assert process.status == 2
    lines = process.stderr.splitlines()
    assert len(lines) == 1, process.stderr
    assert wanted in lines[0]
    assert "None" not in lines[0]
    assert process.stdout == ""


@pytest.mark.parametrize("arguments", [["-p", "gains.kp:="], ["--params-file", "nowhere.yaml"], ["--no-such-option"]])
def test_arguments_that_ros_refuses_end_the_node_without_traceback(bench: Bench, arguments: list[str]) -> None:
    process = bench.start("ctc_controller", arguments=arguments)
    assert process.wait() == 2
    assert "Traceback" not in process.stderr
    assert arguments[-1] in process.stderr.splitlines()[-1]


def test_arrays_are_read_as_launch_ros_writes_them(bench: Bench) -> None:
    """SetParameter gives the nodes a tuple of Python on their command line."""
    given = ["-p", "external_inputs:=('joint_states',)", "-p", "waypoints:=(0.0, 0.15, 0, 0.1)"]
    bench.start("trajectory_generator", arguments=given)
    probe = bench.probe()
    assert list(probe.parameter("/trajectory_generator", "external_inputs")) == ["joint_states"]
    assert list(probe.parameter("/trajectory_generator", "waypoints")) == [0.0, 0.15, 0.0, 0.1]


def test_a_name_that_no_node_has_is_a_warning(bench: Bench) -> None:
    """A key of the file may be for the others, and parameters of ROS are its own."""
    of_ros = dict.fromkeys(OF_ROS, False)
    process = bench.start("supervisor", "/alone", **{"conveyor_speed": 0.5, "safety.brake": True}, **of_ros)
    bench.probe().health("/alone/supervisor")
    (warning,) = (line for line in process.complaints if "parameter " in line)
    assert warning.endswith("[alone.supervisor]: parameter conveyor_speed: this node has no such parameter")


def test_a_parameter_file_for_all_namespaces_is_read(bench: Bench, tmp_path: Path) -> None:
    path = tmp_path / "parameters.yaml"
    path.write_text("/**:\n  ros__parameters:\n    gains.kp: -3.5\n", encoding="utf-8")
    process = bench.start("ctc_controller", "/somewhere", arguments=["--params-file", str(path)])
    assert process.wait() == 2
    assert "-3.5" in process.stderr


@pytest.mark.parametrize("node", ["unified_controller", "trajectory_generator"])
def test_what_is_not_given_follows_from_the_robot(bench: Bench, node: str) -> None:
    """The nominal crossing of the bench takes a sixteenth of the torque of DexTAR's."""
    motion = [0.0, 0.12, 0.0, 0.0, 0.0, 0.12]
    bench.start(node, robot="motkin", controller="unified", waypoints=motion, **{"unified.kd": 77.0})
    names = [f"unified.{name}" for name in ("kd", "weight", "disturbance_limit")]
    answer = bench.probe().call(GetParameters, f"/{node}/get_parameters", GetParameters.Request(names=names))
    sizes = law_sizes(read_robot("motkin"))["unified"]
    assert [value.double_value for value in answer.values] == [77.0, sizes["weight"], sizes["disturbance_limit"]]
    assert sizes["weight"] > 100.0 * UnifiedSettings().weight


def test_by_what_requests_are_planned_is_not_changed_while_the_node_runs(bench: Bench) -> None:
    """The planning process has it from the start; a law's gains can be changed on the law's node."""
    bench.start("trajectory_generator")
    probe = bench.probe()
    for name, value in (("unified.kp", 900.0), ("tracking_error_limit", 0.01)):
        result = probe.set_parameter("/trajectory_generator", name, value)
        assert not result.successful and "read-only" in result.reason


@pytest.mark.parametrize("node", ["plant", "blender", "trajectory_generator", "unified_controller"])
def test_a_node_loads_what_it_has_dumped(bench: Bench, node: str) -> None:
    """Also what is read-only, as long as it keeps its value: `ros2 param load` sets all that a dump has."""
    controller = {"scenario": "unified_middle"} if node == "unified_controller" else {}
    bench.start(node, **controller)
    probe = bench.probe()
    names = probe.call(ListParameters, f"/{node}/list_parameters", ListParameters.Request()).result.names
    values = probe.call(GetParameters, f"/{node}/get_parameters", GetParameters.Request(names=names)).values
    assert len(values) > 10
    dump = [Parameter(name=name, value=value) for name, value in zip(names, values, strict=True)]
    results = probe.call(SetParameters, f"/{node}/set_parameters", SetParameters.Request(parameters=dump)).results
    assert [(name, one.reason) for name, one in zip(names, results, strict=True) if not one.successful] == []
    if node == "plant":
        # as rclpy reads a dump
        assert probe.set_parameter(f"/{node}", "camera.deviation", "3e-05").successful
    refused = probe.set_parameter(f"/{node}", "scenario", "another")
    assert not refused.successful and "read-only" in refused.reason


class Tuning:
    """A ctc_controller whose gains are changed while it runs."""

    def __init__(self, bench: Bench, motion: MiddleMotion) -> None:
        bench.start("ctc_controller")
        self.probe: Probe = bench.probe()
        self.probe.join("ctc_controller", [JOINT_STATES, REFERENCE], [CTC_TORQUE])
        self._motion = motion
        self._sample = 0

    def torque(self) -> tuple[float, ...]:
        """Ask for the torque of a sample that is not asked again."""
        self._sample += 1
        messages = (
            (REFERENCE, self._motion.reference_message(self._sample)),
            (JOINT_STATES, self._motion.joint_states_message(self._sample)),
        )
        self.probe.ask(messages, [CTC_TORQUE], self._sample)
        return tuple(self.probe.answer(CTC_TORQUE, self._sample).effort)

    def expected(self, kp: float, kd: float) -> tuple[float, ...]:
        """Return what the law gives for the sample asked last."""
        law = bound_law("ctc", self._motion.robot, self._motion.plan, RATE_HZ, kp=kp, kd=kd)
        return law(self._sample, self._motion.state(self._sample), self._motion.reference(self._sample))


def test_gains_can_be_changed_while_the_node_runs(bench: Bench, motion: MiddleMotion) -> None:
    tuning = Tuning(bench, motion)
    assert tuning.torque() == tuning.expected(2500.0, 100.0)
    assert tuning.probe.set_parameter("/ctc_controller", "gains.kp", 900.0).successful
    assert tuning.torque() == tuning.expected(900.0, 100.0) != tuning.expected(2500.0, 100.0)
    assert tuning.probe.set_parameter("/ctc_controller", "gains.kd", 60.0).successful
    assert tuning.torque() == tuning.expected(900.0, 60.0)
    bad = (
        ("gains.kp", math.nan, "kp"),
        ("gains.kp", -0.5, "out of range"),
        ("gains.kp", 2e6, "out of range"),
        ("gains.kd", math.inf, "kd"),
        ("gains.kd", "high", "Wrong parameter type"),
        ("rate_hz", 1000, "read-only"),
        ("waypoints", [0.0, 0.1], "read-only"),
        ("no_such_parameter", 1.0, "undeclared"),
    )
    for name, value, reason in bad:
        result = tuning.probe.set_parameter("/ctc_controller", name, value)
        assert not result.successful, (name, value)
        assert reason in result.reason, (name, value, result.reason)
    assert tuning.torque() == tuning.expected(900.0, 60.0)
