# SPDX-License-Identifier: Apache-2.0
"""The sampled plan in the engine's loop: the reference, and all else that a plan says of a sample."""

from __future__ import annotations

from fivebar_bringup.simulation.case import (
    AX,
    AY,
    DIRECTION_X,
    DIRECTION_Y,
    EPSILON,
    VX,
    VY,
    WEIGHT,
    EngineRun,
    FloatArray,
    X,
    Y,
)
from fivebar_control.laws.reference import Reference, reference_from_platform
from fivebar_control.loop.cycle import CycleSettings
from fivebar_control.loop.plan_sample import PlanSample
from fivebar_control.model.state import Platform
from fivebar_control.trajectory.desired import reference_of


def planned_at(run: EngineRun, moment: int) -> PlanSample:
    """Return the plan at the moment of a sample."""
    plan = run.plan
    row = plan.rows[moment]
    platform = Platform(row[X], row[Y], row[VX], row[VY], row[AX], row[AY])
    return PlanSample(
        reference=reference_at(run.case.control, plan.references, moment, platform),
        platform=platform,
        direction_x=row[DIRECTION_X],
        direction_y=row[DIRECTION_Y],
        epsilon=row[EPSILON],
        time_weight=row[WEIGHT],
        ahead=None,
    )


def reference_at(control: CycleSettings, references: FloatArray, moment: int, platform: Platform) -> Reference:
    """Return the desired instant of a sample for its platform reference; `references` are those of the sampled plan."""
    if references.shape[0] == 0:
        return reference_from_platform(control.robot, control.mode1, control.mode2, platform)
    return reference_of(references[moment])
