# SPDX-License-Identifier: Apache-2.0
"""The quickest time law with friction in the limit: it brakes with friction, needs less torque, meets the criterion."""

from __future__ import annotations

import numpy as np
import pytest

from fivebar_control.model.dynamics import inverse_dynamics_of_platform
from fivebar_control.model.kinematics import state_from_platform
from fivebar_control.trajectory.criterion import criterion_residual
from fivebar_control.trajectory.planner import Plan, plan_motion
from fivebar_control.trajectory.time_laws import OPTIMAL, OPTIMAL_WITH_FRICTION, QUINTIC
from fivebar_control.trajectory.zones import ZoneRule
from fivebar_description.parameters import FiveBar, friction_torque

RATE_HZ = 500
MIDDLE = ((0.0, 0.15), (0.0, 0.02))
BESIDE = ((0.0, 0.15), (0.04, 0.03))


def planned(robot: FiveBar, time_law: str, duration: float, ends: tuple[tuple[float, float], ...] = MIDDLE) -> Plan:
    return plan_motion(robot, (1, -1), ends, [duration], RATE_HZ, ZoneRule(), time_law, 0.0)


def torques(robot: FiveBar, plan: Plan) -> np.ndarray:
    """Return both torques (Nm) that a plan needs with friction, 2 ms and more from the locus."""
    found = []
    for t in np.linspace(0.0, plan.path.duration, 801).tolist():
        if any(abs(t - crossing.time) < 2e-3 for crossing in plan.crossings):
            continue
        x, y, vx, vy, ax, ay = plan.path.at(t)
        state = state_from_platform(robot, (1, -1), x, y, vx, vy)
        f1, f2 = friction_torque(robot.leg1, state.leg1.dq1), friction_torque(robot.leg2, state.leg2.dq1)
        found.append(inverse_dynamics_of_platform(robot, state, ax, ay, f1, f2))
    return np.array(found)


def frictionless(robot: FiveBar) -> FiveBar:
    legs = (leg._replace(coulomb=0.0, offset=0.0) for leg in (robot.leg1, robot.leg2))
    return FiveBar(*legs, mass=robot.mass)


@pytest.mark.parametrize(
    ("duration", "torque", "share"), [(0.75, 0.515, 0.94), (0.35, 0.85, 0.88), (0.214, 1.71, 0.92)]
)
def test_it_takes_less_torque_than_limits_beyond_friction_allow(
    duration: float, torque: float, share: float, dextar: FiveBar
) -> None:
    needed, others, quintic = (
        float(np.max(np.abs(torques(dextar, planned(dextar, law, duration)))))
        for law in (OPTIMAL_WITH_FRICTION, OPTIMAL, QUINTIC)
    )
    assert needed < torque
    assert needed < share * others < quintic


def test_it_brakes_with_as_much_torque_as_it_accelerates_with(dextar: FiveBar) -> None:
    """Under limits beyond friction, which brakes too, braking takes a third of the torque."""
    for law, ratio in ((OPTIMAL_WITH_FRICTION, 1.0), (OPTIMAL, 0.28)):
        found = np.max(np.abs(torques(dextar, planned(dextar, law, 0.35))), axis=1)
        eighth = len(found) // 8
        accelerating, braking = found[eighth : 2 * eighth], found[6 * eighth : 7 * eighth]
        assert np.max(braking) == pytest.approx(ratio * np.max(accelerating), rel=0.05)


@pytest.mark.parametrize("ends", [MIDDLE, BESIDE, ((-0.08, 0.07), (0.07, 0.06))], ids=["middle", "oblique", "two"])
@pytest.mark.parametrize("duration", [0.3, 1.5])
def test_it_meets_the_criterion_at_every_crossing(
    ends: tuple[tuple[float, float], ...], duration: float, dextar: FiveBar
) -> None:
    plan = planned(dextar, OPTIMAL_WITH_FRICTION, duration, ends)
    assert plan.crossings
    for crossing in plan.crossings:
        there = plan.path.at(crossing.time)
        assert np.hypot(there.vx, there.vy) > 0.01
        assert abs(criterion_residual(dextar, (1, -1), there)) < 1e-6


@pytest.mark.extra
def test_without_friction_it_needs_no_more_than_limits_beyond_friction(dextar: FiveBar) -> None:
    robot = frictionless(dextar)
    for ends in (MIDDLE, BESIDE):
        needed, others = (
            float(np.max(np.abs(torques(robot, planned(robot, law, 0.5, ends)))))
            for law in (OPTIMAL_WITH_FRICTION, OPTIMAL)
        )
        assert needed <= others * 1.01


@pytest.mark.extra
def test_a_rounded_path_is_passed_round_its_corner_with_less_torque(dextar: FiveBar) -> None:
    corner = ((0.0, 0.15), (0.04, 0.13), (0.03, 0.02))
    needed, others = (
        float(
            np.max(
                np.abs(
                    torques(
                        dextar,
                        plan_motion(dextar, (1, -1), corner, [0.35, 0.35], RATE_HZ, ZoneRule(), law, 0.0, (0.02,)),
                    )
                )
            )
        )
        for law in (OPTIMAL_WITH_FRICTION, OPTIMAL)
    )
    assert needed < 0.97 * others
