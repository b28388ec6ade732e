"""SIGINT, SIGTERM and SIGHUP end every node, whatever it waits for, and in order."""

from __future__ import annotations

import pytest
from graph_probe import Bench, node_modules

from fivebar_bringup.recorded.bag.reader import read_bag
from fivebar_description.interrupts import STOP_SIGNALS


@pytest.mark.parametrize("turn", [0, *(pytest.param(turn, marks=pytest.mark.extra) for turn in (1, 2))])
def test_a_signal_ends_every_node(bench: Bench, turn: int) -> None:
    """Each third of the nodes gets one signal; every node gets each of them in some turn."""
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
        process.send(STOP_SIGNALS[(place + turn) % len(STOP_SIGNALS)])
    for node, process in processes.items():
        assert process.wait() == 0, node
        # on a busy machine a node has time to say that it waits for the others
        assert [line for line in process.complaints if "not ready: " not in line] == [], node
    assert read_bag(bench.folder / "processes" / "bag").topics
