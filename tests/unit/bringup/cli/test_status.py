# SPDX-License-Identifier: Apache-2.0
"""The status of a graph on a terminal of 80 columns."""

from __future__ import annotations

import io

from rich.console import Console

from fivebar_bringup.cli.status import _shown
from fivebar_bringup.ros.diagnostics_listener import NodeReport

FIGURES = {
    "answered": "123456",
    "rate_hz": "499.98",
    "jitter_ms": "0.123",
    "interval_max_ms": "12.345",
    "late": "1234",
    "dropped": "1234",
    "received": "123456",
    "stack_free": "98 %",
}


def test_it_has_every_figure_in_80_columns() -> None:
    reports = [NodeReport("trajectory_generator", "warning", "a reading came late", FIGURES)]
    reports += [NodeReport("blender", "error", "torque_excessive", {"answered": "7"})]
    text = io.StringIO()
    Console(file=text, width=80).print(_shown(reports))
    lines = text.getvalue().splitlines()
    assert max(map(len, map(str.rstrip, lines))) <= 80
    table = lines[:3]
    assert [line.split()[:2] for line in table] == [
        ["node", "level"], ["trajectory_generator", "warning"], ["blender", "error"]
    ]  # fmt: skip
    # nothing is cut off
    assert not any("…" in line for line in lines)
    assert all(value in " ".join(lines) for value in (*FIGURES, *FIGURES.values(), "a reading came late"))
    assert "blender: torque_excessive" in lines
