# SPDX-License-Identifier: Apache-2.0
"""The laws of a run: which sample they look at, and what they are bound to."""

from __future__ import annotations

import pytest
from bound_laws import bound_law
from scipy.optimize import brentq

from fivebar_control.laws.ctc import ctc_torque
from fivebar_control.laws.gains import RESOLUTIONS
from fivebar_control.laws.multi_model import reduced_ctc_torque
from fivebar_control.laws.reference import Reference, reference_from_platform
from fivebar_control.laws.registry import CONTROLLERS
from fivebar_control.laws.vhc_cartesian import vhc_cartesian_torque
from fivebar_control.laws.vhc_joint import vhc_joint_torque
from fivebar_control.loop.law_runner import LawRunner
from fivebar_control.loop.supervisor import Supervisor
from fivebar_control.model.kinematics import state_from_platform
from fivebar_control.model.line import Line
from fivebar_control.model.singularity import inverse_condition
from fivebar_control.model.state import Platform, State
from fivebar_control.trajectory.planner import Plan, plan_motion
from fivebar_control.trajectory.zones import ZoneRule
from fivebar_description.parameters import FiveBar

RATE_HZ = 500


@pytest.fixture(scope="module")
def plan(dextar: FiveBar) -> Plan:
    """Down in 0.5 s along x = 0, aside, and up in 2 s along x = 0.01."""
    waypoints = ((0.0, 0.15), (0.0, 0.035), (0.01, 0.035), (0.01, 0.15))
    return plan_motion(dextar, (1, -1), waypoints, (0.5, 0.5, 2.0), RATE_HZ, ZoneRule())


@pytest.fixture(scope="module")
def instant(dextar: FiveBar) -> tuple[State, Reference]:
    state = state_from_platform(dextar, (1, -1), 0.001, 0.09, 0.02, -0.3)
    return state, reference_from_platform(dextar, (1, -1), Platform(0.0, 0.0895, 0.0, -0.31, 0.0, 0.5))


def test_ctc_law_is_the_same_for_every_sample(dextar: FiveBar, plan: Plan, instant: tuple[State, Reference]) -> None:
    law = bound_law("ctc", dextar, plan, RATE_HZ)
    wanted = ctc_torque(dextar, *instant, 2500.0, 100.0)
    assert law(0, *instant) == law(777, *instant) == wanted


@pytest.mark.parametrize("resolution", ["min_norm", "full_friction", "full_inverse"])
def test_vhc_law_follows_the_line_of_its_sample(
    resolution: str, dextar: FiveBar, plan: Plan, instant: tuple[State, Reference]
) -> None:
    """The line has the direction of the segment and goes through the reference, wherever that has been held."""
    law = bound_law("vhc_cartesian", dextar, plan, RATE_HZ, resolution=resolution)
    _, reference = instant
    place = reference.state.x, reference.state.y
    directions = {
        0: (0.0, -1.0),
        249: (0.0, -1.0),
        250: (1.0, 0.0),
        499: (1.0, 0.0),
        500: (0.0, 1.0),
        1500: (0.0, 1.0),
    }
    for sample, direction in directions.items():
        line = Line(*place, *direction)
        wanted = vhc_cartesian_torque(dextar, *instant, line, 2500.0, 100.0, RESOLUTIONS[resolution])
        assert law(sample, *instant) == wanted


def test_on_the_plan_the_line_through_the_reference_is_the_segment(dextar: FiveBar, plan: Plan) -> None:
    law = bound_law("vhc_cartesian", dextar, plan, RATE_HZ)
    state = state_from_platform(dextar, (1, -1), 0.0095, 0.09, 0.02, 0.3)
    for sample in (500, 700, 1000, 1499):
        reference = reference_from_platform(dextar, (1, -1), plan.path.at(sample / RATE_HZ))
        line = Line(0.01, 0.035, 0.0, 1.0)
        wanted = vhc_cartesian_torque(dextar, state, reference, line, 2500.0, 100.0, RESOLUTIONS["full_friction"])
        assert law(sample, state, reference) == pytest.approx(wanted, rel=1e-12)


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


def test_in_time_the_supervisor_switches_around_the_planned_crossings(
    plan: Plan, instant: tuple[State, Reference]
) -> None:
    """The multi-model method looks at the clock only: 1 for 40 ms, 0 beyond 80 ms, wherever the robot is."""
    supervisor = Supervisor(plan, RATE_HZ, "sigmoid")
    state, _ = instant
    for crossing in plan.crossings:
        at = round(crossing.time * RATE_HZ)
        sigmas = [supervisor(at + offset, state).sigma for offset in (-21, -9, 0, 9, 21)]
        assert sigmas == [0.0, 1.0, 1.0, 1.0, 0.0]
        assert 0.0 < supervisor(at + 15, state).sigma < 1.0
    assert supervisor(0, state).inverse_condition == inverse_condition(state)


def joint_law(dextar: FiveBar, plan: Plan, adaptive_gain: bool, alpha: float = 1.5) -> LawRunner:
    return bound_law(
        "vhc_joint", dextar, plan, RATE_HZ, resolution="full_inverse", adaptive_gain=adaptive_gain, alpha=alpha
    )


def test_joint_law_raises_its_gains_only_inside_a_zone_and_after_a_jump(
    dextar: FiveBar, plan: Plan, instant: tuple[State, Reference]
) -> None:
    """The quick crossing's zone holds this posture at sample 100, the slow one's does not at sample 1000."""
    state, reference = instant
    tracked = state_from_platform(dextar, (1, -1), 0.0, 0.13, 0.0, -0.3)
    on_track = reference_from_platform(dextar, (1, -1), Platform(0.0, 0.13, 0.0, -0.3, 0.0, 0.0))
    place = reference.state.x, reference.state.y
    down, up = Line(*place, 0.0, -1.0), Line(*place, 0.0, 1.0)

    def torque(line: Line, factor_p: float, factor_d: float) -> object:
        gains = (2500.0 * factor_p, 100.0 * factor_d)
        return vhc_joint_torque(dextar, (1, -1), state, reference, line, *gains, RESOLUTIONS["full_inverse"])

    adaptive = joint_law(dextar, plan, adaptive_gain=True, alpha=2.0)
    adaptive(99, tracked, on_track)
    assert adaptive(100, state, reference) == torque(down, 4.0, 2.0)
    assert adaptive(1000, state, reference) == torque(up, 1.0, 1.0)
    plain = joint_law(dextar, plan, adaptive_gain=False)
    plain(99, tracked, on_track)
    assert plain(100, state, reference) == torque(down, 1.0, 1.0)


def test_joint_law_takes_the_zone_to_begin_where_it_gets_its_first_say(dextar: FiveBar, plan: Plan) -> None:
    """Just inside the edge, where sigma is still next to nothing, the jump of the error counts already."""
    epsilon = plan.epsilon_at(100 / RATE_HZ)

    def kappa(y: float) -> float:
        return inverse_condition(state_from_platform(dextar, (1, -1), 0.001, y, 0.0, 0.0))

    edge = brentq(lambda y: kappa(y) - 2.0 * epsilon, 0.086, 0.13)
    tracked = state_from_platform(dextar, (1, -1), 0.0, 0.13, 0.0, -0.3)
    on_track = reference_from_platform(dextar, (1, -1), Platform(0.0, 0.13, 0.0, -0.3, 0.0, 0.0))
    for y, in_zone in ((edge - 1e-5, True), (edge + 1e-5, False)):
        state = state_from_platform(dextar, (1, -1), 0.001, y, 0.0, -0.3)
        reference = reference_from_platform(dextar, (1, -1), Platform(0.0, y, 0.0, -0.3, 0.0, 0.0))
        sigma = Supervisor(plan, RATE_HZ, "condition")(100, state).sigma
        assert 0.0 < sigma < 0.01 if in_zone else sigma == 0.0
        adaptive, plain = (joint_law(dextar, plan, gain) for gain in (True, False))
        adaptive(99, tracked, on_track)
        assert (adaptive(100, state, reference) != plain(100, state, reference)) == in_zone


def test_every_law_on_the_locus_is_found_by_its_name(
    dextar: FiveBar, plan: Plan, instant: tuple[State, Reference]
) -> None:
    state, reference = instant
    line, resolve = Line(0.0, 0.15, 0.0, -1.0), RESOLUTIONS["min_norm"]
    gains = (2500.0, 100.0)
    wanted = {
        "reduced_ctc": reduced_ctc_torque(dextar, state, reference, *gains),
        "vhc_joint": vhc_joint_torque(dextar, (1, -1), state, reference, line, *gains, resolve),
        "vhc_cartesian": vhc_cartesian_torque(dextar, state, reference, line, *gains, resolve),
    }
    assert {one.constraint.name for one in CONTROLLERS.values() if one.constraint is not None} == set(wanted)
    for name, torque in wanted.items():
        resolution = {} if name == "reduced_ctc" else {"resolution": "min_norm"}
        law = bound_law(name, dextar, plan, RATE_HZ, **resolution)
        assert law(0, state, reference) == torque
