# SPDX-License-Identifier: Apache-2.0
"""Nodes that are ended by signals, in order."""

from __future__ import annotations

from collections.abc import Mapping

from forked_node import ForkedNode
from graph_probe import DROPPED_RESPONSE

from fivebar_description.interrupts import STOP_SIGNALS


def complaints_of(process: ForkedNode) -> list[str]:
    """Return what a node complains of, but for what a busy machine brings about.

    A node then has time to say that it waits for the others, and a service to drop a response, for which it is asked
    again.
    """
    return [line for line in process.complaints if "not ready: " not in line and not DROPPED_RESPONSE.search(line)]


def expect_orderly_end(nodes: Mapping[str, ForkedNode], turn: int) -> None:
    """Send one signal to each third of the nodes; every node gets each of them in some turn."""
    for place, process in enumerate(nodes.values()):
        process.send(STOP_SIGNALS[(place + turn) % len(STOP_SIGNALS)])
    for node, process in nodes.items():
        assert process.wait() == 0, node
        complaints = complaints_of(process)
        assert not complaints, (node, complaints)
