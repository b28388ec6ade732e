# SPDX-License-Identifier: Apache-2.0
"""The progress of a run, as the node that keeps its time publishes it."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Collection

from std_msgs.msg import String

from fivebar_description.interface import RUN_STATUS
from fivebar_description.ros.latency_watch import LatencyWatch
from fivebar_description.ros.node import GraphNode

TELLING_TIME = 5.0
"""Time (s) after which the nodes are told for which a run waits."""


class RunProgress:
    """The nodes that a run waits for, and how far it has come.

    Attributes:
        samples: number of the last sample, 0 while it is not known.
        overruns: samples that had no torque in time.
        latency: from samples to their torques.
    """

    def __init__(self, node: GraphNode, samples: int, awaited: Collection[str]) -> None:
        """Advertise the topic on behalf of a node; the run has so many samples after sample 0."""
        self.samples = samples
        self._node = node
        self._missing = set(awaited)
        self._began = time.monotonic()
        self._told = ""
        self._status = node.advertise(RUN_STATUS)
        self.overruns = 0
        self.latency = LatencyWatch()

    @property
    def missing(self) -> str:
        """The nodes that are not ready, "" for none."""
        return ", ".join(sorted(self._missing))

    def tell(self, lacking: str) -> None:
        """Log what the run waits for, where that takes long or has changed since."""
        if lacking != self._told and time.monotonic() - self._began > TELLING_TIME:
            self._told = lacking
            self._node.get_logger().warning(f"the run has not begun, not ready yet: {lacking}")

    def on_ready(self, message: String) -> None:
        """Note that a node is ready."""
        self._missing.discard(message.data)

    def publish(self, state: str, sample: int) -> None:
        """Publish the progress."""
        status = {
            "state": state,
            "sample": sample,
            "samples": self.samples,
            "overruns": self.overruns,
            "latency_ms": self.latency.summary(),
            "pid": os.getpid(),
        }
        self._status.publish(String(data=json.dumps(status)))
