"""When a run counts as a success, and how it falls short of one."""

from __future__ import annotations

from fivebar_bringup.simulation.outcome import FAULT_NAMES, Outcome
from fivebar_control.safety.stages import NO_FAULT
from fivebar_control.scenario.scenario import KEPT_TO, PATH, TIMED
from fivebar_description.rounding import in_millimetres

PEAK_LIMIT = 2e-3
"""A success stays within this distance (m) of its reference throughout."""

FINAL_LIMIT = 1e-3
"""A success ends within this distance (m) of its reference."""


def success_rule(scale: float = 1.0, judge: str = TIMED) -> str:
    """Return the definition of a success in words, fixed before any run; distances go with the size of a robot."""
    end = "the goal" if judge == PATH else "it"
    return (
        f"all samples without a fault, the planned change of assembly mode, never {1e3 * scale * PEAK_LIMIT:.3g} mm"
        f" from the {KEPT_TO[judge]}, less than {1e3 * scale * FINAL_LIMIT:.3g} mm from {end} at the end"
    )


def judged_peak(outcome: Outcome, judge: str) -> float:
    """Return the largest distance (m) of a run from what it is judged by."""
    return outcome.path_error if judge == PATH else outcome.error_peak


def shortcomings(
    outcome: Outcome,
    planned_samples: int,
    planned_mode_changes: int,
    peak_limit: float = PEAK_LIMIT,
    judge: str = TIMED,
) -> list[str]:
    """Return how a run falls short of a success, worst first; nothing for a success.

    Args:
        outcome: of the run.
        planned_samples, planned_mode_changes: of its plan.
        peak_limit: largest distance from the reference (m); half of it is that at the end.
        judge: whether the distance from the path counts instead, but for the end.
    """
    missed = []
    if outcome.fault != NO_FAULT:
        missed.append(f"fault {FAULT_NAMES[outcome.fault]}")
    elif outcome.samples != planned_samples:
        missed.append(f"{outcome.samples} of {planned_samples} samples")
    if outcome.mode_changes != planned_mode_changes:
        missed.append(f"{outcome.mode_changes} changes of assembly mode, planned {planned_mode_changes}")
    # a NaN is no success
    peak = judged_peak(outcome, judge)
    if not peak < peak_limit:
        missed.append(f"{'peak' if judge == TIMED else 'path'} error {in_millimetres(peak)}")
    if not outcome.error_final < peak_limit * (FINAL_LIMIT / PEAK_LIMIT):
        missed.append(f"final error {in_millimetres(outcome.error_final)}")
    return missed
