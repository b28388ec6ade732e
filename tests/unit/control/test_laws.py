"""The laws of a run: which sample they look at, and what they are bound to."""

from __future__ import annotations

import pytest

from fivebar_control.controllers.ctc import ctc_torque
from fivebar_control.controllers.laws import CtcLaw, Gains, Supervisor, VhcCartesianLaw
from fivebar_control.controllers.reference import Reference, reference_from_platform
from fivebar_control.controllers.resolution import RESOLUTIONS
from fivebar_control.controllers.vhc_cartesian import Line, vhc_cartesian_torque
from fivebar_control.model.kinematics import state_from_platform
from fivebar_control.model.singularity import inverse_condition
from fivebar_control.model.state import Platform, State
from fivebar_control.trajectory.planner import Plan, ZoneRule, plan_motion
from fivebar_description.parameters import FiveBar
from fivebar_description.strict_yaml import InputError

RATE_HZ = 500
GAINS = Gains(2500.0, 100.0)


@pytest.fixture(scope="module")
def plan(dextar: FiveBar) -> Plan:
    """Down in 0.5 s along x = 0, aside, and up in 2 s along x = 0.01."""
    waypoints = ((0.0, 0.15), (0.0, 0.035), (0.01, 0.035), (0.01, 0.15))
    return plan_motion(dextar, (1, -1), waypoints, (0.5, 0.5, 2.0), RATE_HZ, ZoneRule())


@pytest.fixture(scope="module")
def instant(dextar: FiveBar) -> tuple[State, Reference]:
    state = state_from_platform(dextar, 1, -1, 0.001, 0.09, 0.02, -0.3)
    return state, reference_from_platform(dextar, 1, -1, Platform(0.0, 0.0895, 0.0, -0.31, 0.0, 0.5))


def test_ctc_law_is_the_same_for_every_sample(dextar: FiveBar, instant: tuple[State, Reference]) -> None:
    law = CtcLaw(dextar, GAINS)
    wanted = ctc_torque(dextar, *instant, 2500.0, 100.0)
    assert law(0, *instant) == law(777, *instant) == wanted


@pytest.mark.parametrize("resolution", ["min_norm", "full_friction", "full_inverse"])
def test_vhc_law_follows_the_line_of_its_sample(
    resolution: str, dextar: FiveBar, plan: Plan, instant: tuple[State, Reference]
) -> None:
    law = VhcCartesianLaw(dextar, plan, RATE_HZ, GAINS, resolution)
    lines = {
        0: Line(0.0, 0.15, 0.0, -1.0),
        249: Line(0.0, 0.15, 0.0, -1.0),
        250: Line(0.0, 0.035, 1.0, 0.0),
        499: Line(0.0, 0.035, 1.0, 0.0),
        500: Line(0.01, 0.035, 0.0, 1.0),
        1500: Line(0.01, 0.035, 0.0, 1.0),
    }
    for sample, line in lines.items():
        wanted = vhc_cartesian_torque(dextar, *instant, line, 2500.0, 100.0, RESOLUTIONS[resolution])
        assert law(sample, *instant) == wanted


def test_an_unknown_resolution_is_refused_with_the_known_ones(dextar: FiveBar, plan: Plan) -> None:
    with pytest.raises(InputError, match="vhc_resolution: 'best': expected one of min_norm, full_friction, full_inv"):
        VhcCartesianLaw(dextar, plan, RATE_HZ, GAINS, "best")


def test_supervisor_uses_the_zone_of_the_nearest_crossing(
    dextar: FiveBar, plan: Plan, instant: tuple[State, Reference]
) -> None:
    """The same posture is inside the wide zone of the quick crossing and outside the narrow one of the slow one."""
    quick, slow = (crossing.epsilon for crossing in plan.crossings)
    state, _ = instant
    kappa = inverse_condition(state)
    assert 2.0 * slow < kappa < 2.0 * quick
    supervisor = Supervisor(plan, RATE_HZ, "condition")
    early, late = supervisor(100, state), supervisor(1000, state)
    assert early.inverse_condition == late.inverse_condition == kappa
    assert early.sigma == pytest.approx(min(1.0, 2.0 - kappa / quick), abs=1e-15)
    assert early.sigma > 0.0
    assert late.sigma == 0.0
