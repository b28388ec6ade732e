# SPDX-License-Identifier: Apache-2.0
"""The reference after a fault, and that the torque which follows it starts without a bump, on the locus too."""

from __future__ import annotations

import pytest
from bound_laws import bound_law

from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_control.laws.blend import blend
from fivebar_control.laws.reference import reference_from_platform
from fivebar_control.loop.law_runner import LawRunner
from fivebar_control.loop.supervisor import Supervisor
from fivebar_control.model.kinematics import state_from_platform
from fivebar_control.trajectory.hold import Hold

SCENARIO = load_scenario("middle")
ROBOT, PLAN = SCENARIO.five_bar(), SCENARIO.plan()
CROSSING = PLAN.crossings[0]
FRICTION = max(leg.coulomb + abs(leg.offset) for leg in (ROBOT.leg1, ROBOT.leg2))


def test_the_plan_holds_until_a_fault_and_not_again_after_it() -> None:
    hold = Hold()
    assert hold.reference(0.0, 0.1) is None
    hold.release()
    assert hold.reference(0.0, 0.1) is None
    hold.stop()
    assert hold.reference(0.01, 0.1) == (0.01, 0.1, 0.0, 0.0, 0.0, 0.0)
    assert hold.reference(0.02, 0.1) == (0.02, 0.1, 0.0, 0.0, 0.0, 0.0)
    hold.release()
    for x in (0.02, 0.03):
        assert hold.reference(x, 0.1) == (0.02, 0.1, 0.0, 0.0, 0.0, 0.0)
    hold.begin_run()
    assert hold.reference(0.03, 0.1) is None


def test_after_a_reset_it_says_once_where_the_robot_was_left() -> None:
    hold = Hold()
    assert hold.left_at() is None
    hold.stop()
    hold.reference(0.01, 0.1)
    assert hold.left_at() is None
    hold.release()
    assert hold.left_at() == (0.01, 0.1)
    assert hold.left_at() is None
    assert hold.reference(0.02, 0.1) is None


def test_a_new_run_does_not_move_a_stopped_robot() -> None:
    hold = Hold()
    hold.stop()
    hold.reference(0.0, 0.1)
    hold.begin_run()
    assert hold.reference(0.01, 0.1) == (0.01, 0.1, 0.0, 0.0, 0.0, 0.0)


def bound(law: str, **settings: float) -> LawRunner:
    return bound_law(law, ROBOT, PLAN, SCENARIO.rate_hz, **settings)


@pytest.mark.parametrize("controller", ["multi_cartesian", "multi_joint", "unified"])
@pytest.mark.parametrize(
    ("x", "y"),
    [(0.004, 0.13), (0.002, CROSSING.y + 0.003), (-0.006, CROSSING.y), (0.0, CROSSING.y), (0.01, 0.05)],
    ids=["away", "in the zone", "near the locus", "on the locus", "beyond"],
)
@pytest.mark.parametrize("moment", [0.3, CROSSING.time, 1.4, 9.0])
def test_at_rest_the_torque_is_at_most_friction(controller: str, x: float, y: float, moment: float) -> None:
    """The robot stands millimetres off its path, and the plan's time has gone on."""
    sample = round(moment * SCENARIO.rate_hz)
    state = state_from_platform(ROBOT, PLAN.mode, x, y, 0.0, 0.0)
    hold = Hold()
    hold.stop()
    held = hold.reference(state.x, state.y)
    assert held is not None
    reference = reference_from_platform(ROBOT, PLAN.mode, held)
    sigma = Supervisor(PLAN, SCENARIO.rate_hz, "condition")(sample, state).sigma
    if controller == "unified":
        torque = bound("unified", observer_rate=0.0)(sample, state, reference)
    else:
        constraint = bound("vhc_cartesian") if controller == "multi_cartesian" else bound("vhc_joint")
        torque = blend(sigma, bound("ctc")(sample, state, reference), constraint(sample, state, reference))
    # at rest Coulomb friction asks for nothing, its offset does
    assert torque.tau1 == pytest.approx(ROBOT.leg1.offset, abs=1e-6)
    assert torque.tau2 == pytest.approx(ROBOT.leg2.offset, abs=1e-6)
    assert max(map(abs, torque)) < FRICTION
