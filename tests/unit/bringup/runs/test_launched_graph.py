# SPDX-License-Identifier: Apache-2.0
"""The processes that `control.launch.py` starts: those of the runner's graph, as far as they are asked for."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml

from fivebar_bringup.graph.crossing_graph import crossing_graph
from fivebar_bringup.graph.node_spec import Mode
from fivebar_bringup.graph.standing import LONGEST
from fivebar_bringup.runs.launched_graph import launched_processes
from fivebar_bringup.runs.launching import (
    ControlRequest,
    LaunchedProcess,
    cell_clock,
    cell_rviz_configuration,
    described_processes,
    recorder_of_cell,
)
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_description.errors import InputError


def started(scenario: str = "middle", **request: Any) -> dict[str, dict[str, Any]]:
    """Return the parameters of each node that a request starts."""
    found = {}
    for process in launched_processes(ControlRequest(scenario, **request)):
        content = yaml.safe_load(process.parameter_file)
        names = [name.rpartition(".")[2] for name in process.arguments] or [process.name]
        keys = [f"/**/{name}" for name in names] if process.arguments else ["/**"]
        found |= {name: content[key]["ros__parameters"] for name, key in zip(names, keys, strict=True)}
    return found


@pytest.mark.extra
@pytest.mark.parametrize("scenario", ["middle", "unified_middle", "gyro_middle"])
def test_the_nodes_are_those_of_a_run(scenario: str) -> None:
    of_run = {node.executable for node in crossing_graph(load_scenario(scenario), Mode.LOCKSTEP, Path("bag"))}
    assert set(started(scenario, hardware="simulated")) == of_run - {"bag_recorder"}
    alone = set(started(scenario))
    assert alone == of_run - {"bag_recorder", "plant", "imu_listener"}
    assert set(started(scenario, imu="true")) == alone | {"imu_listener"}


@pytest.mark.extra
def test_nobody_waits_for_a_node_that_is_not_started(tmp_path: Path) -> None:
    without = started(hardware="simulated", imu="false")
    awaited = without["plant"]["wait_for_nodes"]
    assert set(awaited) == set(without) - {"plant"}
    recorded = started(hardware="simulated", imu="false", record=str(tmp_path / "run"))
    assert set(recorded["plant"]["wait_for_nodes"]) == set(awaited) | {"bag_recorder"}
    assert {one["scenario"] for name, one in recorded.items() if name != "bag_recorder"} == {
        str(tmp_path / "run" / "scenario.yaml")
    }
    assert recorded["bag_recorder"]["directory"] == str(tmp_path / "run" / "bag")


@pytest.mark.extra
def test_parameters_of_all_nodes_decide_which_these_are() -> None:
    nodes = started(parameters={"controller": "unified", "unified.kp": 1100.0, "use_sim_time": True})
    assert set(nodes) == set(started("middle", parameters={"controller": "unified"}))
    assert "unified_controller" in nodes
    assert "vhc_controller" not in nodes
    # what is set for all takes the place of what the graph would say
    realtime = started(mode="realtime", parameters={"safety.stop_cycles": 7})
    assert "safety.stop_cycles" not in realtime["blender"]
    assert "safety.stop_cycles" in started(mode="realtime")["blender"]


@pytest.mark.extra
def test_a_chain_in_one_process() -> None:
    def names(**request: Any) -> list[str]:
        return [process.name for process in launched_processes(ControlRequest("middle", **request))]

    chain = ["trajectory_generator", "supervisor", "ctc_controller", "vhc_controller", "blender"]
    assert names() == names(mode="realtime", composed="false") == chain
    assert names(mode="realtime") == names(composed="true") == ["controllers"]


@pytest.mark.extra
def test_a_bridge_has_a_lifecycle_of_its_own(tmp_path: Path) -> None:
    def bridge(**request: Any) -> LaunchedProcess:
        path = tmp_path / f"run{len(list(tmp_path.iterdir()))}"
        found = launched_processes(ControlRequest("middle_robot", hardware="emulated", record=str(path), **request))
        (one,) = [process for process in found if process.lifecycle]
        return one

    for activate in (False, True):
        one = bridge(activate=activate)
        assert (one.name, one.ends_run) == ("dextar_bridge", False)
        assert yaml.safe_load(one.parameter_file)["/**"]["ros__parameters"]["autostart"] is activate


@pytest.mark.extra
def test_a_watchdog_runs_beside_the_bridge_to_a_controller(tmp_path: Path) -> None:
    nodes = started("middle_ros2_control", hardware="emulated", record=str(tmp_path / "run"))
    assert nodes["command_watchdog"]["drives"] == nodes["drive_bridge"]["drives"]
    assert "command_watchdog" in nodes["drive_bridge"]["wait_for_nodes"]
    assert "scenario" not in nodes["command_watchdog"]
    assert "command_watchdog" not in started("middle_robot", hardware="emulated", record=str(tmp_path / "other"))


@pytest.mark.extra
def test_a_robot_that_stays_goes_on_after_its_motion() -> None:
    assert started("unified_middle", hardware="simulated", stay=True)["plant"]["samples"] == LONGEST
    with pytest.raises(InputError, match="accepts no goals"):
        started("middle", hardware="simulated", stay=True)


@pytest.mark.extra
@pytest.mark.parametrize(
    ("request_", "words"),
    [
        ({"drives": "mine.yaml"}, "drives: expected hardware:=emulated"),
        ({"activate": True, "hardware": "simulated"}, "activate: expected hardware:=emulated"),
        ({"port": "/dev/ttyACM0"}, "port: expected together with hardware:=usb"),
        ({"hardware": "usb"}, "--hardware usb: the drives are canopen: expected socketcan or real: dextar"),
        ({"hardware": "external"}, "--hardware external: the drives are canopen: expected socketcan or real: dextar"),
        ({"stay": True}, "stay: expected hardware:=simulated or emulated"),
        ({"shutdown": True, "hardware": "emulated"}, "shutdown: expected hardware:=simulated"),
        ({"camera": "true"}, "camera: a run of middle on hardware:=none has none"),
        ({"hardware": "emulated"}, "estimator: expected ekf"),
        ({"parameters": {"mode": "realtime"}}, "parameter mode: expected the argument mode:="),
        ({"parameters": {"waypoints": [0.0, 0.15, 0.0, 0.5]}}, "out of reach"),
        ({"parameters": {"waypoints": [0.0, 0.15, 0.0]}}, "waypoints: 3 numbers: expected pairs"),
    ],
)
def test_what_does_not_go_together_is_refused(request_: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        launched_processes(ControlRequest("middle", **request_))


def test_the_command_lists_the_processes_to_the_launch_file(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("AMENT_PREFIX_PATH", raising=False)
    request = ControlRequest("middle", hardware="simulated", parameters={"gains.kp": 900.0})
    assert described_processes(request) == launched_processes(request)
    with pytest.raises(RuntimeError, match="nowhere"):
        described_processes(ControlRequest("nowhere"))


@pytest.mark.extra
def test_robots_of_a_cell_share_clock_and_recorder(tmp_path: Path) -> None:
    recorders = {}
    for robot in ("left", "right"):
        request = ControlRequest("middle", hardware="simulated", cell=True, record=str(tmp_path / robot))
        found = {process.name: process for process in launched_processes(request)}
        recorders[robot] = found["bag_recorder"]
        assert yaml.safe_load(found["plant"].parameter_file)["/**"]["ros__parameters"]["follows_clock"] is True
    shared = yaml.safe_load(recorder_of_cell(recorders, tmp_path / "bag").parameter_file)["/**"]["ros__parameters"]
    assert {"left/joint_states", "right/joint_states", "/diagnostics"} <= set(shared["topics"])
    assert shared["topics"].count("/diagnostics") == 1
    assert {"left/plant", "right/blender"} <= set(shared["wait_for_nodes"])
    assert shared["directory"] == str(tmp_path / "bag")
    for robots, in_lockstep in ((["left", "right"], True), ([""], False)):
        clock = yaml.safe_load(cell_clock(["left", "right"], in_lockstep).parameter_file)
        assert clock["/**"]["ros__parameters"]["robots"] == robots


def test_one_rviz_shows_all_robots_of_a_cell() -> None:
    manager = yaml.safe_load(cell_rviz_configuration(["left", "cell/right"], "cell"))["Visualization Manager"]
    assert manager["Global Options"]["Fixed Frame"] == "cell"
    models = [one for one in manager["Displays"] if one["Class"].endswith("RobotModel")]
    assert [one["TF Prefix"] for one in models] == ["left", "cell/right"]
    assert [one["Description Topic"]["Value"] for one in models] == [
        "/left/robot_description",
        "/cell/right/robot_description",
    ]
    topics = [one["Topic"]["Value"] for one in manager["Displays"] if "Topic" in one]
    assert topics == [
        f"/{robot}/{topic}" for robot in ("left", "cell/right") for topic in ("scene", "scene/map", "scene/trail")
    ]
