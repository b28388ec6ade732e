"""When a run counts as a success, and how it falls short of one."""

from __future__ import annotations

from fivebar_bringup.simulation.outcome import FAULT_NAMES, Outcome
from fivebar_control.safety.stages import NO_FAULT
from fivebar_description.rounding import in_millimetres

PEAK_LIMIT = 2e-3
"""A success stays within this distance (m) of its reference throughout."""

FINAL_LIMIT = 1e-3
"""A success ends within this distance (m) of its reference."""


def success_rule(scale: float = 1.0) -> str:
    """Return the definition of a success in words, fixed before any run; distances go with the size of a robot."""
    return (
        "all samples without a fault, the planned change of assembly mode, never"
        f" {1e3 * scale * PEAK_LIMIT:.3g} mm from the reference, less than {1e3 * scale * FINAL_LIMIT:.3g} mm from it"
        " at the end"
    )


def shortcomings(
    outcome: Outcome, planned_samples: int, planned_mode_changes: int, peak_limit: float = PEAK_LIMIT
) -> list[str]:
    """Return how a run falls short of a success, worst first; nothing for a success.

    Args:
        outcome: of the run.
        planned_samples, planned_mode_changes: of its plan.
        peak_limit: largest distance from the reference (m); half of it is that at the end.
    """
    missed = []
    if outcome.fault != NO_FAULT:
        missed.append(f"fault {FAULT_NAMES[outcome.fault]}")
    elif outcome.samples != planned_samples:
        missed.append(f"{outcome.samples} of {planned_samples} samples")
    if outcome.mode_changes != planned_mode_changes:
        missed.append(f"{outcome.mode_changes} changes of assembly mode, planned {planned_mode_changes}")
    # a NaN is no success
    if not outcome.error_peak < peak_limit:
        missed.append(f"peak error {in_millimetres(outcome.error_peak)}")
    if not outcome.error_final < peak_limit * (FINAL_LIMIT / PEAK_LIMIT):
        missed.append(f"final error {in_millimetres(outcome.error_final)}")
    return missed
