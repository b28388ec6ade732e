# SPDX-License-Identifier: Apache-2.0
"""Timing of a run, written by the process that made it."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from pydantic import ConfigDict, Field

from fivebar_bringup.recorded.results import read_json
from fivebar_description.strict_yaml import StrictModel


class RunTiming(StrictModel):
    """The content of timing.json; all fields are unknown without the file.

    Attributes:
        runner: with the node graph or offline.
        mode: lockstep or real time, of the node graph.
        wall_s: how long the run took (s).
        overruns: clock periods that passed without a torque.
        latency_ms: median, 99th percentile and maximum from a sample to its torque at plant or drives (ms).
        stop_cycles: cycles for which the last torque could be held in real time, when something was late or missing.
        faults: texts of the faults that the launcher detects, such as a node that died.
    """

    model_config = ConfigDict(extra="ignore", frozen=True, strict=True, allow_inf_nan=False)

    runner: Literal["ros", "offline"] | None = None
    mode: Literal["lockstep", "realtime"] | None = None
    wall_s: float | None = None
    overruns: int | None = None
    latency_ms: dict[str, float] | None = None
    stop_cycles: int | None = Field(default=None, ge=1)
    faults: list[str] = Field(default_factory=list)


def read_timing(path: Path) -> RunTiming:
    """Read timing.json; a run without one gives a Timing with all fields unknown.

    Raises:
        InputError: the file cannot be read, or has unexpected content.
    """
    return read_json(path, RunTiming) if path.exists() else RunTiming()
