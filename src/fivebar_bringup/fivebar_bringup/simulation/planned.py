# SPDX-License-Identifier: Apache-2.0
"""The sampled plan in the engine's loop."""

from __future__ import annotations

from fivebar_bringup.simulation.case import EngineRun
from fivebar_control.loop.plan_sample import PlanSample
from fivebar_control.loop.sampled_plan import planned_in


def planned_at(run: EngineRun, moment: int) -> PlanSample:
    """Return the plan at the moment of a sample."""
    return planned_in(run.case.control, run.plan.rows[moment], run.plan.references, moment)
