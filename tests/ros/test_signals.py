# SPDX-License-Identifier: Apache-2.0
"""SIGINT, SIGTERM and SIGHUP end every node, whatever it waits for, and in order.

The first turn is in test_node_parameters.py, with the nodes that are there.
"""

from __future__ import annotations

import pytest
from graph_probe import Bench, node_modules
from stopped_nodes import expect_orderly_end

from fivebar_bringup.bag.reader import read_bag


@pytest.mark.extra
@pytest.mark.parametrize("turn", [1, 2])
def test_a_signal_ends_every_node(bench: Bench, turn: int) -> None:
    probe = bench.probe()
    nodes = sorted(node_modules())
    processes = {}
    for node in nodes:
        more = {"command_timeout_s": 600.0} if node == "plant" else {}
        processes[node] = bench.start(node, f"/{node}", **more)
    for node in nodes:
        # its diagnostics come once it spins
        probe.health(f"/{node}/{node}")
    expect_orderly_end(processes, turn)
    assert read_bag(bench.folder / "processes" / "bag").topics
