# SPDX-License-Identifier: Apache-2.0
"""The package by itself: what `import fivebar` offers crosses the singularity."""

import fivebar


def test_a_planned_motion_crosses() -> None:
    summary = fivebar.simulate(fivebar.plan("dextar", goal=(0.0, 0.02), assembly_mode="-")).summary
    assert summary.outcome == "succeeded"
    assert summary.assembly_mode_changes == 1
    assert summary.tracking_error_peak_m < 2e-3
