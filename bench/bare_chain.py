# SPDX-License-Identifier: Apache-2.0
"""Baseline of the benchmark: a ring of nodes that only forward a message of the graph's type and QoS."""

from __future__ import annotations

import json
import statistics
import time
from typing import Annotated, NamedTuple

from sensor_msgs.msg import JointState

from fivebar_description.interface import JOINTS, Topic, sample_stamp_ns
from fivebar_description.ros.messages import joint_state
from fivebar_description.ros.node import GraphNode
from fivebar_description.ros.run import run_node
from fivebar_description.settings import Setting

RATE_HZ = 500
VALUES = (0.1, 0.2, 0.3, 0.4)


class BareChainSettings(NamedTuple):
    """Position of a node in the ring, and length of the measurement."""

    position: Annotated[
        int, Setting("Position in the ring; 0 sends the messages and measures.", at_least=0, at_most=100)
    ] = 0
    hops: Annotated[int, Setting("Number of nodes in the ring.", at_least=2, at_most=100)] = 3
    rounds: Annotated[int, Setting("Number of measured rounds.", at_least=1, at_most=10_000_000)] = 2000


class BareChain(GraphNode):
    """One node of the ring. The first prints the round-trip times and then exits."""

    def __init__(self) -> None:
        """Make the node."""
        super().__init__("bare_chain")
        settings = self.declare_settings(BareChainSettings)
        self._position = settings.position
        self._rounds = settings.rounds
        self._sent = 0
        self._times: list[float] = []
        self._began = 0.0
        here, there = self._position, (self._position + 1) % settings.hops
        self._output = self.advertise(Topic(f"bench/hop_{there}", "sensor_msgs/msg/JointState"))
        # as messages, not as samples: what the graph's ways to save work come to is measured against this
        self.listen(Topic(f"bench/hop_{here}", "sensor_msgs/msg/JointState"), self._on_message, raw=False)
        if self._position == 0:
            self._start = self.every(0.1, self._send)

    def _send(self) -> None:
        self._began = time.perf_counter()
        stamp = sample_stamp_ns(self._sent, RATE_HZ)
        self._output.publish(joint_state(stamp, JOINTS, VALUES, VALUES, VALUES))

    def _on_message(self, message: JointState) -> None:
        if self._position != 0:
            self._output.publish(message)
            return
        now = time.perf_counter()
        if self._sent == 0:
            # the first message is repeated until all nodes are connected, so its time is not representative
            self._start.cancel()
        else:
            self._times.append((now - self._began) * 1e3)
        if self._sent == self._rounds:
            print(json.dumps({"p50": statistics.median(self._times), "max": max(self._times)}), flush=True)
            self.exit_status = 0
            return
        self._sent += 1
        self._send()


def main() -> None:
    """Run the node."""
    run_node(BareChain)


if __name__ == "__main__":
    main()
