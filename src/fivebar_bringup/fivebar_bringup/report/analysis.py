# SPDX-License-Identifier: Apache-2.0
"""A run with everything that its figures and its page show."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fivebar_bringup.recorded.series import RunSeries
from fivebar_bringup.recorded.summary import Summary
from fivebar_bringup.scenario import Scenario
from fivebar_control.laws.registry import CONDITION
from fivebar_control.trajectory.planner import Plan
from fivebar_description.parameters import FiveBar


class RunAnalysis(NamedTuple):
    """A run: its plan, its recorded series and its summary."""

    scenario: Scenario
    plan: Plan
    robot: FiveBar
    series: RunSeries
    summary: Summary

    @property
    def modes(self) -> tuple[int, int]:
        """The working mode at the start."""
        return self.plan.mode

    @property
    def blends(self) -> bool:
        """Whether the controller uses sigma."""
        return self.scenario.scheme().blended

    @property
    def zone_name(self) -> str:
        """Label of the time with sigma > 0 in a figure's legend."""
        return "blending zone, σ > 0" if self.blends else "near the locus, σ > 0"

    @property
    def blends_by_condition(self) -> bool:
        """Whether sigma follows from cond(A) and not from time."""
        return self.scenario.scheme().weighting == CONDITION

    @property
    def torque_was_limited(self) -> bool:
        """Whether the applied torque stayed noticeably below the requested one."""
        applied, requested = self.series.torque_applied, self.series.torque_requested
        if not np.any(np.isfinite(applied)) or not np.any(np.isfinite(requested)):
            return False
        return float(np.nanmax(np.abs(requested))) > 1.01 * float(np.nanmax(np.abs(applied)))


def zones_in_words(scenario: Scenario) -> str:
    """Return what the shaded times in charts of a scenario's run are."""
    if scenario.scheme().blended:
        return "The supervisor blends where it is shaded (σ > 0)."
    return "The supervisor would blend where it is shaded (σ > 0); this controller does not."
