"""The description of the graph against the graph: `fivebar nodes`, the launch file, and a live run."""

from __future__ import annotations

import ast
import os
import signal
from collections.abc import Callable
from importlib.metadata import distribution
from pathlib import Path
from typing import Any

import pytest
from fivebar_command import FivebarCommand, GraphRun
from graph_probe import DEADLINE

from fivebar_bringup.runs.graph import Mode, crossing_graph
from fivebar_bringup.scenario import load_scenario, shipped_scenarios
from fivebar_description.interface import TOPICS

LAUNCH_FILE = Path(__file__).parents[2] / "src/fivebar_bringup/launch/crossing.launch.py"

OF_EVERY_NODE = {"/rosout", "/parameter_events", "/diagnostics", "/run/ready"}
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
        return {name.removeprefix("/"): kinds[0] for name, kinds in found if name not in OF_EVERY_NODE}

    for name, node in described.items():
        publishes = ros.get_publisher_names_and_types_by_node(name, "/")
        subscribes = ros.get_subscriber_names_and_types_by_node(name, "/")
        assert topics(publishes) == node["publishes"], name
        wanted = dict(node["subscribes"])
        ready = wanted.pop("run/ready", None)
        assert topics(subscribes) == wanted, name
        assert (ready is not None) == ("/run/ready" in dict(subscribes)), name
        assert set(dict(publishes)) >= OF_EVERY_NODE, name
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


@pytest.mark.parametrize("scenario", shipped_scenarios())
@pytest.mark.parametrize("mode", Mode)
def test_every_node_of_a_graph_is_an_installed_command(scenario: str, mode: Mode) -> None:
    for node in crossing_graph(load_scenario(scenario), mode, Path("bag")):
        entries = distribution(node.package).entry_points.select(group="console_scripts", name=node.executable)
        assert [entry.module for entry in entries] == [node.module]


def test_the_launch_file_starts_the_same_graph() -> None:
    """ROS' launch is not on PyPI, so the file is read here, and run only under ROS."""
    text = LAUNCH_FILE.read_text(encoding="utf-8")
    compile(text, str(LAUNCH_FILE), "exec")
    tree = ast.parse(text)
    modules = {node.module or "" for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    modules |= {alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names}
    packages = {module.partition(".")[0] for module in modules}
    assert packages == {"pathlib", "launch", "launch_ros", "fivebar_bringup"}
    functions = {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}
    assert "generate_launch_description" in functions
    assert _node_arguments(tree) == {"package": "node.package", "executable": "node.executable"}


def _node_arguments(tree: ast.AST) -> dict[str, str]:
    """Return what the one Node action is made from, given that it stands in a loop over crossing_graph."""
    (loop,) = (
        node
        for node in ast.walk(tree)
        if isinstance(node, ast.For) and ast.unparse(node.iter).startswith("crossing_graph(")
    )
    calls: list[Any] = [
        node for node in ast.walk(tree) if isinstance(node, ast.Call) and ast.unparse(node.func) == "Node"
    ]
    assert len(calls) == 1
    assert calls[0] in list(ast.walk(loop))
    assert ast.unparse(loop.target) == "node"
    arguments = {keyword.arg: ast.unparse(keyword.value) for keyword in calls[0].keywords if keyword.arg}
    return {name: arguments[name] for name in ("package", "executable")}
