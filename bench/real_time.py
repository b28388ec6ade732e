# SPDX-License-Identifier: Apache-2.0
"""Figures of a run in real time, beside a bare loop of the same priority on the same machine."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fivebar_bringup.runs.processes import CONTROLLERS
from graph_speed import GraphSpeed
from stalls import Stalls

Row = tuple[str, str, str, str]
"""A measured quantity, its value in the control chain and in the bare loop, and the target; "" for none."""

NO_MORE = "what no program here can do better"

CHAIN_CPU_MS = 0.45
"""Processor time (ms) of the control chain per cycle that is aimed at."""


ALONE = "at most 0.45 ms median, 1.00 ms p99"
TOGETHER = "at most 0.20 ms median, 0.45 ms p99"
"""From a sample to its torque, with nodes that share no process with the robot, and with the bridge in the chain's."""


def real_time_rows(graph: GraphSpeed, loop: Stalls, samples: int, wanted_latency: str = ALONE) -> list[Row]:
    """Return the table of a run in real time with so many samples, and of a bare loop with as many beats."""
    rows = [
        ("faults", "; ".join(graph.faults) or "none", "", "none"),
        ("missed deadlines", f"{graph.missed} of {samples}", f"{loop.late} of {samples}", NO_MORE),
        ("from one sample to the next", _times(graph.periods_ms), _times(loop.periods_ms), NO_MORE),
    ]
    if graph.latency_ms is not None:
        latency = _spread(graph.latency_ms["p50"], graph.latency_ms["p99"], graph.latency_ms["max"])
        name = "from sample to torque; loop: from due to awake"
        rows.append((name, latency, _times(loop.lateness_ms), wanted_latency))
    for name, cpu_ms in graph.cpu_ms.items():
        wanted = f"at most {CHAIN_CPU_MS:g} ms" if name == CONTROLLERS else ""
        rows.append((f"processor time of {name} per cycle", f"{cpu_ms:.3f} ms", "", wanted))
    return rows


def _times(times_ms: Sequence[float]) -> str:
    if not times_ms:
        return "none"
    return _spread(float(np.percentile(times_ms, 50)), float(np.percentile(times_ms, 99)), max(times_ms))


def _spread(median: float, p99: float, most: float) -> str:
    return f"{median:.2f} ms median, {p99:.2f} ms p99, {most:.2f} ms at most"
