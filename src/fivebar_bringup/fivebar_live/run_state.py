# SPDX-License-Identifier: Apache-2.0
"""The state of a run as the live page tells it, from what its graph publishes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import StrEnum
from typing import Any, NamedTuple

STALE_AFTER = 3.0
"""Time (s) without a report after which a node is stale; nodes report once a second."""

OFF = "drives_off"
"""Name of the state of drives that are off, which is no fault: also at the regular end of a run."""


class RunWord(StrEnum):
    """The state of a run."""

    WAITING = "waiting"
    RUNNING = "running"
    OFF = "off"
    FINISHED = "finished"
    STOPPED = "stopped"
    INTERRUPTED = "interrupted"
    STALE = "stale"


OVER = (RunWord.FINISHED, RunWord.INTERRUPTED)
"""States after which nodes are expected to be silent."""


class RunState(NamedTuple):
    """The state of a run: one word, and the words for the page."""

    word: RunWord
    text: str


def run_state(run: Mapping[str, Any], faults: Sequence[str], drives: str | None, silence: float | None) -> RunState:
    """Return the state of a run.

    Args:
        run: the last status of plant or bridge.
        faults: texts of latched faults.
        drives: the last state of the drives, None where there is none.
        silence: how long (s) no node has reported, None where none ever has.
    """
    silent = silence is not None and silence > STALE_AFTER
    off = drives is not None and drives.startswith(OFF)
    told = run.get("state")
    if faults:
        return RunState(RunWord.STOPPED, "stopped by a fault")
    if told == "completed":
        return RunState(RunWord.FINISHED, "finished")
    if told is not None and run.get("sample") and (told == "failed" or off):
        return RunState(RunWord.INTERRUPTED, "interrupted: the run was ended before its last sample")
    if silent:
        return RunState(RunWord.STALE, f"stale: no node has reported for {silence:.0f} s")
    if off:
        return RunState(RunWord.OFF, f"the drives are off: {drives}")
    if run.get("sample") is None:
        return RunState(RunWord.WAITING, "waiting for samples")
    return RunState(RunWord.RUNNING, "running")


def node_level(level: str, age: float, run: RunWord) -> str:
    """Return the level of a node whose last report is so old (s): one that is silent after the run has ended."""
    if age <= STALE_AFTER:
        return level
    return "ended" if run in OVER else "stale"
