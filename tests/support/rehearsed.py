"""What becomes of a rehearsal on emulated drives."""

from __future__ import annotations

from pathlib import Path

from fivebar_command import CommandCall

from fivebar_bringup.recorded.bag.reader import read_bag
from fivebar_description.interface import TORQUE_COMMAND


def expect_crossing(call: CommandCall) -> None:
    """Expect that a run through the locus and back succeeds, from the first sample to the last."""
    assert call.finish() == 0, call.stderr
    summary = call.json()
    assert (summary["outcome"], summary["faults"], summary["assembly_mode_changes"]) == ("succeeded", [], 2)
    assert summary["tracking_error_peak_m"] < 0.004
    assert summary["samples"] == summary["planned_samples"]


def expect_stop(call: CommandCall, *faults: str) -> None:
    """Expect that a run is stopped by a fault, whose text begins in one of these ways."""
    assert call.finish() == 1, call.stderr
    summary = call.json()
    assert summary["outcome"] == "stopped"
    assert summary["fault_details"][0].startswith(faults)


def last_torque(out: Path) -> tuple[float, ...]:
    """Return the last torque command (Nm) in the bag of a run."""
    return tuple(read_bag(out / "bag").field(TORQUE_COMMAND, "effort")[-1])
