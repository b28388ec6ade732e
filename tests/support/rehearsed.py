# SPDX-License-Identifier: Apache-2.0
"""What becomes of a rehearsal on emulated drives."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from fivebar_command import CommandCall

from fivebar_bringup.bag.reader import read_bag
from fivebar_description.interface import TORQUE_COMMAND


def expect_crossing(call: CommandCall) -> None:
    """Expect that a run through the locus and back succeeds, from the first sample to the last."""
    assert call.finish() == 0, call.stderr
    summary = call.json()
    assert (summary["outcome"], summary["faults"], summary["assembly_mode_changes"]) == ("succeeded", [], 2)
    assert summary["tracking_error_peak_m"] < 0.004
    # by the clock a machine that stalls may miss some, which the run bridges and the summary counts
    assert summary["samples"] + summary["missing_samples"] >= summary["planned_samples"]


def expect_stop(
    fivebar: Callable[..., CommandCall], rehearsed: Sequence[str], broken: str, out: Path, fault: str
) -> None:
    """Break something in a rehearsal, and expect that a fault whose text begins so stops it, with zero torque.

    Args:
        fivebar: begins a command.
        rehearsed: its arguments.
        broken: what is broken, and when.
        out: folder of the run, which is made.
        fault: how the text of the fault begins.
    """
    call = fivebar(*rehearsed, "--inject", broken, "--out", str(out))
    assert call.finish() == 1, call.stderr
    summary = call.json()
    assert summary["outcome"] == "stopped"
    assert summary["fault_details"][0].startswith(fault), summary["fault_details"]
    # nobody commands anything once the blender is dead
    assert "blender" in broken or tuple(read_bag(out / "bag").field(TORQUE_COMMAND, "effort")[-1]) == (0.0, 0.0)
