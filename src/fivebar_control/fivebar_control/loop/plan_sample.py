# SPDX-License-Identifier: Apache-2.0
"""The plan evaluated at a sample: reference, path line and blending parameters."""

from __future__ import annotations

from typing import NamedTuple

from fivebar_control.laws.reference import Reference
from fivebar_control.loop.supervisor import time_weight
from fivebar_control.model.state import Platform
from fivebar_control.trajectory.desired import desired_at
from fivebar_control.trajectory.path import Path
from fivebar_control.trajectory.planner import Plan
from fivebar_description.parameters import FiveBar


class PlanSample(NamedTuple):
    """The planned instant of a sample.

    Attributes:
        reference: the desired instant.
        platform: where the platform should be, and its motion.
        direction_x, direction_y: unit vector along the straight segment, NaN where it is not straight.
        epsilon: width of the blending zone in kappa.
        time_weight: blending weight in time, of the multi-model method.
        ahead: the reference of the samples that follow, None for laws that do not look ahead.
    """

    reference: Reference
    platform: Platform
    direction_x: float
    direction_y: float
    epsilon: float
    time_weight: float
    ahead: tuple[Platform, ...] | None


def reference_ahead(plan: Plan, sample: int, rate_hz: int, count: int) -> tuple[Platform, ...] | None:
    """Return the reference of the samples after one, as a law that looks ahead takes it; None for none."""
    if count == 0:
        return None
    return tuple(plan.path.at(number / rate_hz) for number in range(sample + 1, sample + count + 1))


def planned_references(plan: Plan, rate_hz: int) -> list[Platform]:
    """Return the references of a plan's samples, for a law that needs them all."""
    return references_along(plan.path, rate_hz)


def references_along(path: Path, rate_hz: int) -> list[Platform]:
    """Return the references of a path's samples, from its beginning to the rest at its end."""
    return [path.at(number / rate_hz) for number in range(path.samples(rate_hz) + 1)]


def plan_sample(
    robot: FiveBar,
    plan: Plan,
    t: float,
    ahead: tuple[Platform, ...] | None = None,
    platform: Platform | None = None,
) -> PlanSample:
    """Return the plan of a robot at time t (s).

    Args:
        robot: to be moved.
        plan: its motion.
        t: time.
        ahead: what laws see of the reference beyond it.
        platform: the reference at t where it is not the plan's, as after a motion that was requested later.
    """
    if platform is None:
        platform = plan.path.at(t)
    line = plan.path.line_at(t)
    return PlanSample(
        reference=desired_at(robot, plan, t, platform),
        platform=platform,
        direction_x=line.direction_x,
        direction_y=line.direction_y,
        epsilon=plan.epsilon_at(t),
        time_weight=time_weight(plan, t),
        ahead=ahead,
    )
