"""What a success is; fixed before any run."""

from __future__ import annotations

from fivebar_bringup.simulation.outcome import FAULT_NAMES, Outcome
from fivebar_control.safety.stages import NO_FAULT

PEAK_LIMIT = 2e-3
"""A success stays within this distance (m) of its reference throughout."""

FINAL_LIMIT = 1e-3
"""A success ends within this distance (m) of its reference."""

WORDS = (
    "all samples without a fault, the planned change of assembly mode, never 2 mm from the reference, less than 1 mm"
    " from it at the end"
)
"""The rule."""


def shortcomings(outcome: Outcome, planned_samples: int, planned_mode_changes: int) -> list[str]:
    """Return what a run lacks of a success, worst first; nothing for a success."""
    missed = []
    if outcome.fault != NO_FAULT:
        missed.append(f"fault {FAULT_NAMES[outcome.fault]}")
    elif outcome.samples != planned_samples:
        missed.append(f"{outcome.samples} of {planned_samples} samples")
    if outcome.mode_changes != planned_mode_changes:
        missed.append(f"{outcome.mode_changes} changes of assembly mode, planned {planned_mode_changes}")
    # a NaN is no success
    if not outcome.error_peak < PEAK_LIMIT:
        missed.append(f"peak error {1e3 * outcome.error_peak:.2f} mm")
    if not outcome.error_final < FINAL_LIMIT:
        missed.append(f"final error {1e3 * outcome.error_final:.2f} mm")
    return missed
