# SPDX-License-Identifier: Apache-2.0
"""How long a torque may be held, against the nonlinear model under that torque."""

from __future__ import annotations

import math

import pytest

from fivebar_control.laws.registry import CONTROLLERS, default_tuning
from fivebar_control.model.kinematics import state_from_platform
from fivebar_control.planning.predicted_run import advanced
from fivebar_control.planning.reference_scan import ReferenceTorque
from fivebar_control.planning.ride_through import DISPLACEMENT, GRID_HZ, LONGEST, longest_hold
from fivebar_control.trajectory.desired import desired_at
from fivebar_control.trajectory.planner import Plan, plan_motion
from fivebar_control.trajectory.zones import ZoneSettings
from fivebar_description.robot_file import load_robot

REAL = load_robot()
ROBOT = REAL._replace(
    leg1=REAL.leg1._replace(coulomb=0.0, offset=0.0), leg2=REAL.leg2._replace(coulomb=0.0, offset=0.0)
)
"""Without friction, whose damping near a rest only reduces what a held torque does."""

FOLLOWER = default_tuning(CONTROLLERS["unified"])


def plan_of(duration: float) -> Plan:
    return plan_motion(ROBOT, (1, -1), ((0.0, 0.15), (0.0, 0.02)), (duration,), GRID_HZ, ZoneSettings().as_rule())


def simulated_hold(plan: Plan, moment: float, held: float) -> float:
    """Displacement (m) of the platform by a torque that is held, against one that follows the plan."""
    needed, first = ReferenceTorque(ROBOT, plan, GRID_HZ, FOLLOWER), round(moment * GRID_HZ)

    def planned(sample: int) -> tuple[float, float]:
        t = min(sample, plan.path.samples(GRID_HZ)) / GRID_HZ
        return needed(round(t * GRID_HZ), desired_at(ROBOT, plan, t, plan.path.at(t)))

    start = plan.path.at(moment)
    one = other = state_from_platform(ROBOT, plan.mode, *start[:4])
    for step in range(1, round(held * GRID_HZ) + 1):
        one = advanced(ROBOT, plan.mode, one, planned(first), 1.0 / GRID_HZ, 1)
        other = advanced(ROBOT, plan.mode, other, planned(first + step), 1.0 / GRID_HZ, 1)
    return math.hypot(one.x - other.x, one.y - other.y)


@pytest.mark.parametrize("duration", [0.15, 0.3])
def test_simulated_holds(duration: float) -> None:
    """The estimate is of the first order, and on the safe side."""
    plan = plan_of(duration)
    found = longest_hold(ROBOT, plan, FOLLOWER)
    last = plan.path.samples(GRID_HZ) - round(found.time * GRID_HZ)
    simulated = [simulated_hold(plan, sample / GRID_HZ, found.time) for sample in range(0, last, 4)]
    assert max(simulated) <= found.displacement <= DISPLACEMENT
    assert simulated_hold(plan, found.worst, found.time) > 0.7 * found.displacement


def test_the_limits() -> None:
    """A fast motion bears less than a slow one, which is bounded by the longest time, and less torque harms less."""
    fast, slow = plan_of(0.15), plan_of(1.0)
    held = longest_hold(REAL, fast, FOLLOWER)
    assert 0.0 < held.time < LONGEST
    assert longest_hold(REAL, slow, FOLLOWER).time == LONGEST
    assert longest_hold(REAL, fast, FOLLOWER, torque_limit=0.1).time > held.time
    assert longest_hold(REAL, slow, FOLLOWER, displacement=1e-5).time < LONGEST
