# SPDX-License-Identifier: Apache-2.0
"""The description of the graph against the graph: `fivebar nodes`, the launch file, and a live run."""

from __future__ import annotations

import ast
import os
import signal
from collections.abc import Callable
from pathlib import Path

import pytest
from console_scripts import console_scripts
from fivebar_command import FivebarCommand, GraphRun
from graph_probe import DEADLINE

from fivebar_bringup.drives.hardware import Hardware
from fivebar_bringup.graph.crossing_graph import crossing_graph
from fivebar_bringup.graph.node_spec import Mode
from fivebar_bringup.runs.launching import run_command
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_description.interface import TOPICS
from fivebar_description.modules import module_command
from fivebar_description.scenario_file import shipped_scenarios

LAUNCH_FILES = Path(__file__).parents[2] / "src/fivebar_bringup/launch"

OF_EVERY_NODE = {"rosout", "parameter_events", "diagnostics", "run/ready"}
"""Topics that each node publishes, whatever its part in the graph: left out of its description."""


@pytest.fixture(scope="module")
def live(graph_run: Callable[..., GraphRun]) -> GraphRun:
    run = graph_run()
    run.wait_for_sample(50)
    return run


def test_the_live_graph_is_the_described_one(live: GraphRun, fivebar: Callable[..., FivebarCommand]) -> None:
    listing = fivebar("nodes", "--json")
    ros = live.probe.node
    listing_ready = live.probe.wait_for(lambda: listing.status is not None, "the listing", deadline=60.0)
    assert listing_ready
    described = {node["node"]: node for node in listing.json()}
    # the probe and the launcher's ear are no part of it
    names = live.probe.wait_for(
        lambda: (found := set(ros.get_node_names()) - {"probe", "run_monitor"}) >= set(described) and found,
        "all nodes",
    )
    assert names == set(described)

    def topics(found: list[tuple[str, list[str]]]) -> dict[str, str]:
        return {name.removeprefix("/"): kinds[0] for name, kinds in found}

    def seen(name: str) -> tuple[dict[str, str], dict[str, str]]:
        publishes = topics(ros.get_publisher_names_and_types_by_node(name, "/"))
        return publishes, topics(ros.get_subscriber_names_and_types_by_node(name, "/"))

    def described_one(name: str) -> bool:
        publishes, subscribes = seen(name)
        wanted = {
            way: {topic.removeprefix("/"): kind for topic, kind in described[name][way].items()}
            for way in ("publishes", "subscribes")
        }
        own = {topic: kind for topic, kind in publishes.items() if topic not in OF_EVERY_NODE}
        return set(publishes) >= OF_EVERY_NODE and (own, subscribes) == (wanted["publishes"], wanted["subscribes"])

    for name in described:
        # a node is discovered by its name first, and then topic by topic
        live.probe.wait_for(lambda name=name: described_one(name), f"{described[name]}, not {seen(name)}")
    for topic in TOPICS:
        for endpoint in ros.get_publishers_info_by_topic(f"/{topic.name}"):
            assert endpoint.topic_type == topic.type


def test_a_killed_launcher_leaves_no_node_behind(live: GraphRun) -> None:
    """Comes last here, since it ends the live run."""
    assert len(live.command.processes()) == 9
    os.kill(live.command.pid, signal.SIGKILL)
    assert live.command.finish() == -signal.SIGKILL
    live.command.expect_no_process(DEADLINE)
    live.expect_no_torque()
    assert live.bag().count(TOPICS[0]) > 50


def test_every_node_of_a_graph_is_an_installed_command() -> None:
    loaded = map(load_scenario, shipped_scenarios())
    # of those that are alike one
    scenarios = {(one.controller, one.estimator, one.camera.on, one.ekf.gyro): one for one in loaded}.values()
    graphs = [crossing_graph(scenario, mode, Path("bag")) for scenario in scenarios for mode in Mode]
    nodes = {(node.package, node.executable, node.module) for graph in graphs for node in graph}
    assert len(nodes) > 10
    entries = console_scripts()
    for package, executable, module in nodes:
        entry = entries[executable]
        assert (entry.dist.name, entry.load().module) == (package, module)
        assert entry.module == f"{package}.executables"


@pytest.mark.parametrize("name", ["crossing", "robot"])
def test_a_launch_file_starts_what_the_command_starts(name: str) -> None:
    """ROS' launch is not on PyPI, so the files are read here, and run only under ROS: they add nothing of their own."""
    path = LAUNCH_FILES / f"{name}.launch.py"
    text = path.read_text(encoding="utf-8")
    compile(text, str(path), "exec")
    tree = ast.parse(text)
    imported = {alias.name for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) for alias in node.names}
    assert "run_command" in imported
    assert not imported & {"crossing_graph", "processes", "Node"}
    assert "generate_launch_description" in {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}


@pytest.mark.parametrize(
    ("mode", "hardware", "words"),
    [
        (Mode.LOCKSTEP, Hardware.SIMULATED, ["run", "middle", "--domain", "7", "--out", "there"]),
        (Mode.REALTIME, Hardware.SIMULATED, ["run", "middle", "--domain", "7", "--realtime", "--out", "there"]),
        (
            Mode.REALTIME,
            Hardware.EMULATED,
            ["run", "middle", "--domain", "7", "--hardware", "emulated", "--out", "there"],
        ),
        (Mode.REALTIME, Hardware.USB, ["run", "middle", "--domain", "7", "--hardware", "usb", "--out", "there"]),
    ],
)
def test_a_launched_run_is_that_of_the_command(mode: Mode, hardware: Hardware, words: list[str]) -> None:
    start, parent = module_command("fivebar_bringup.cli.entry"), ["--parent", str(os.getpid())]
    command = run_command("middle", mode, "there", hardware, {"ROS_DOMAIN_ID": "7"})
    assert list(command) == [*start, *words[:4], *parent, *words[4:]]
    # ROS takes an empty variable for the domain 0, like one that is not set
    domain = len(start) + 3
    assert run_command("middle", mode, "there", hardware, {"ROS_DOMAIN_ID": ""})[domain] == "0"
    more = run_command("middle", mode, "there", hardware, {}, scene=True, namespace="robot1")
    assert {"--scene", "--namespace", "robot1"} <= set(more)
    board = run_command("middle", mode, "there", Hardware.USB, {}, drives="board.yaml", port="/dev/ttyACM0")
    assert board[-6:] == ("--drives", "board.yaml", "--port", "/dev/ttyACM0", "--out", "there")
    bus = run_command("middle", mode, "there", Hardware.SOCKETCAN, {}, drives="bus.yaml", activate=True)
    assert bus[domain:] == (
        "0",
        *parent,
        "--hardware",
        "socketcan",
        "--drives",
        "bus.yaml",
        "--activate",
        "--out",
        "there",
    )
