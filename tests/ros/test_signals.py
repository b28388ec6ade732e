"""SIGINT and SIGTERM end every node, whatever it waits for, and in order."""

from __future__ import annotations

import signal

import pytest
from graph_probe import Bench, node_modules

from fivebar_bringup.runs.bag.reader import read_bag

SIGNALS = (signal.SIGINT, signal.SIGTERM)


@pytest.mark.parametrize("turn", [0, pytest.param(1, marks=pytest.mark.extra)])
def test_a_signal_ends_every_node(bench: Bench, turn: int) -> None:
    """Every other node gets the one signal, the rest the other; then the other way round."""
    probe = bench.probe()
    nodes = sorted(node_modules())
    processes = {}
    for node in nodes:
        more = {"command_timeout_s": 600.0} if node == "plant" else {}
        processes[node] = bench.start(node, f"/{node}", **more)
    for node in nodes:
        # its diagnostics come once it spins
        probe.health(f"/{node}/{node}")
    for place, process in enumerate(processes.values()):
        process.send(SIGNALS[(place + turn) % 2])
    for node, process in processes.items():
        assert process.wait() == 0, node
        assert process.complaints == [], node
    assert read_bag(bench.folder / "processes" / "bag").topics
