"""Nodes that are ended by signals, in order."""

from __future__ import annotations

from collections.abc import Mapping

from forked_node import ForkedNode

from fivebar_description.interrupts import STOP_SIGNALS


def expect_orderly_end(nodes: Mapping[str, ForkedNode], turn: int) -> None:
    """Send one signal to each third of the nodes; every node gets each of them in some turn."""
    for place, process in enumerate(nodes.values()):
        process.send(STOP_SIGNALS[(place + turn) % len(STOP_SIGNALS)])
    for node, process in nodes.items():
        assert process.wait() == 0, node
        # on a busy machine a node has time to say that it waits for the others
        complaints = [line for line in process.complaints if "not ready: " not in line]
        assert not complaints, (node, complaints)
