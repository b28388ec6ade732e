# SPDX-License-Identifier: Apache-2.0
"""A plan at the moments of its samples as rows of numbers, from which machine code takes the plan of a sample."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_control.laws.reference import Reference, reference_from_platform
from fivebar_control.loop.cycle import CycleSettings
from fivebar_control.loop.plan_sample import PlanSample
from fivebar_control.loop.supervisor import time_weight
from fivebar_control.model.state import Platform
from fivebar_control.trajectory.desired import REFERENCE_VALUES, desired_along, reference_of
from fivebar_control.trajectory.joint_segment import JointSegment
from fivebar_control.trajectory.planner import Plan
from fivebar_description.parameters import FiveBar

FloatArray = NDArray[np.float64]

X, Y, VX, VY, AX, AY, DIRECTION_X, DIRECTION_Y, EPSILON, WEIGHT = range(10)
"""Columns of a sampled plan: the reference (m, s), the direction of its straight segment (NaN where it is none), the
zone width, and the weight in time of the multi-model method."""


class Sampled(NamedTuple):
    """A plan at the moments of its samples.

    Attributes:
        rows: float64[N + 1 + lead, 10] in the columns above; the lead is the drives' delay where there is an estimator.
        references: float64[N + 1 + lead, REFERENCE_VALUES] where the plan was made in the motors' angles in part; else
            [0, REFERENCE_VALUES], and the loop works the references out.
    """

    rows: FloatArray
    references: FloatArray


@lru_cache(maxsize=8)
def sampled(robot: FiveBar, plan: Plan, rate_hz: int, lead_samples: int = 0) -> Sampled:
    """Return the plan of a robot at the moments of its samples 0 to N and of the lead.

    It is valid for every case with this plan, rate, nominal robot and lead. The last ones are remembered, as a plan is
    predicted and tried on many robots.
    """
    moments = [number / rate_hz for number in range(plan.path.samples(rate_hz) + 1 + lead_samples)]
    rows = [plan_row(plan, t, plan.path.at(t)) for t in moments]
    by_motors = any(isinstance(segment, JointSegment) for segment in plan.path.segments)
    references = desired_along(robot, plan, moments) if by_motors else np.zeros((0, REFERENCE_VALUES))
    return Sampled(np.array(rows, dtype=np.float64), references)


def plan_row(plan: Plan, t: float, platform: Platform) -> tuple[float, ...]:
    """Return a plan at time t (s) in the columns above, for the platform's reference then."""
    return (*platform, *plan.path.line_at(t)[2:], plan.epsilon_at(t), time_weight(plan, t))


def planned_in(control: CycleSettings, row: FloatArray, references: FloatArray, moment: int) -> PlanSample:
    """Return the plan at the moment of a sample, given its row and the references of the sampled plan."""
    platform = Platform(row[X], row[Y], row[VX], row[VY], row[AX], row[AY])
    return PlanSample(
        reference=reference_at(control, references, moment, platform),
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
        return reference_from_platform(control.robot, control.mode, platform)
    return reference_of(references[moment])


def platforms_of(rows: FloatArray) -> list[Platform]:
    """Return the references in rows of a `Sampled` plan."""
    places: list[list[float]] = rows[:, X : AY + 1].tolist()
    return [Platform(*place) for place in places]
