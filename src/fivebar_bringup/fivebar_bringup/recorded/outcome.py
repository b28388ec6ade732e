# SPDX-License-Identifier: Apache-2.0
"""The outcome of a run, as one word, and the exit status of a command that made it."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum

from fivebar_bringup.bag import RECORDER

INTERRUPTED_FAULT = "interrupted"
"""Name of the fault that the launcher reports where a signal has ended the run."""

RECORDING_FAILED = "recording_failed"
"""Name of the recorder's fault."""

ENDED_BADLY = ("node_died", "node_stuck", "node_failed")
"""Names of the faults that the launcher reports of a node's end."""


class RunOutcome(StrEnum):
    """The outcome of a run."""

    SUCCEEDED = "succeeded"
    """The whole motion was made without a fault, and the platform stayed within the scenario's tolerance."""
    OFF_REFERENCE = "off_reference"
    """The whole motion was made without a fault, but not on its reference: beyond the tolerance, beside its goal, in
    another mode, or with an error that is not known."""
    STOPPED = "stopped"
    """A fault stopped the robot, or the run ended before its last sample."""
    REFUSED = "refused"
    """Nothing has moved."""
    COULD_NOT_RUN = "could_not_run"
    """Nothing was judged: a setting, a law or the robot does not go with the rest."""
    INTERRUPTED = "interrupted"
    """A signal ended the run, such as that of Ctrl-C."""


EXIT_STATUS = {
    RunOutcome.SUCCEEDED: 0,
    RunOutcome.OFF_REFERENCE: 1,
    RunOutcome.STOPPED: 1,
    RunOutcome.INTERRUPTED: 1,
    RunOutcome.REFUSED: 2,
    RunOutcome.COULD_NOT_RUN: 2,
}
"""Exit status of a command that made a run; 2 is also that of one that refuses its input."""


def outcome_of(
    samples: int, ended: bool, followed: bool, faults: Sequence[str], launcher_faults: Sequence[str] = ()
) -> RunOutcome:
    """Return what became of a run.

    Args:
        samples: recorded.
        ended: whether the last planned sample was reached.
        followed: whether the platform stayed on its reference, as planned and within the tolerance.
        faults: texts of the recorded faults. Nodes that are stopped in order publish none, so these came before any
            signal, whenever the launcher has heard of them: such a run is not an interrupted one.
        launcher_faults: texts of those that the launcher detected, in the order in which they came.
    """
    if fault_name(next(iter((*faults, *launcher_faults)), "")) == INTERRUPTED_FAULT:
        return RunOutcome.INTERRUPTED
    if not samples and not any(_of_recording(fault) for fault in (*faults, *launcher_faults)):
        return RunOutcome.REFUSED
    if faults or launcher_faults or not ended:
        return RunOutcome.STOPPED
    return RunOutcome.SUCCEEDED if followed else RunOutcome.OFF_REFERENCE


def fault_name(text: str) -> str:
    """Return the name with which the text of a fault begins."""
    return text.partition(":")[0].strip()


def _of_recording(fault: str) -> bool:
    """Return whether a fault may be why no sample was recorded of a robot that moved."""
    name = fault_name(fault)
    return name == RECORDING_FAILED or (name in ENDED_BADLY and RECORDER in fault)
