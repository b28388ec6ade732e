# SPDX-License-Identifier: Apache-2.0
"""The stages before the drives, one by one, against figures worked out by hand or by other functions."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fivebar_control.fault import Fault
from fivebar_control.laws.torque import ZERO, Torque
from fivebar_control.model.kinematics import state_from_joints, state_from_platform
from fivebar_control.model.state import State, WorkingMode
from fivebar_control.safety.settings import Area, SafetySettings
from fivebar_control.safety.stages import (
    FORBIDDEN_POSTURE,
    NO_FAULT,
    TORQUE_EXCESSIVE,
    excess_samples,
    fastest_motor,
    fault_of,
    first_fault,
    guard_limits_of,
    within,
)
from fivebar_description.robot_file import load_robot
from fivebar_description.settings import setting_named

ROBOT = load_robot()
MODES = (1, -1)

torques = st.floats(-1e6, 1e6)


def at(x: float, y: float, vx: float = 0.0, vy: float = 0.0, modes: tuple[int, int] = MODES) -> State:
    return state_from_platform(ROBOT, modes, x, y, vx, vy)


def found(
    state: State,
    requested: Torque = ZERO,
    sigma: float = 0.0,
    modes: tuple[int, int] = MODES,
    place: tuple[float, float] = (0.0, 0.0),
    **limits: Any,
) -> Fault | None:
    """Return the first fault where only the named stages have a limit."""
    none = {"joint_speed_limit": math.inf, "type1_margin": 0.0, "tracking_error_limit": math.inf}
    allowed = guard_limits_of(SafetySettings(**{**none, **limits}), 500)
    number = first_fault(allowed, ROBOT, modes, state, *place, requested)
    if number == NO_FAULT:
        return None
    return fault_of(number, allowed, ROBOT, modes, state, *place, requested, sigma)


def undefined(torque: Torque, sigma: float) -> Fault | None:
    return found(at(0.0, 0.12), torque, sigma)


def over_speed(state: State, limit: float) -> Fault | None:
    return found(state, joint_speed_limit=limit)


def out_of_workspace(state: State, workspace: Area | None) -> Fault | None:
    return found(state, workspace=workspace)


def near_type_1(state: State, mode: WorkingMode, margin: float) -> Fault | None:
    return found(state, modes=mode, type1_margin=margin)


def tracking_lost(state: State, x: float, y: float, limit: float) -> Fault | None:
    # a reference that is not known is lost too, also without a limit
    return found(state, place=(x, y), tracking_error_limit=limit)


@given(torques, torques, st.floats(1e-3, 1e3))
def test_the_limit_cuts_each_motor_and_nothing_within_it(tau1: float, tau2: float, limit: float) -> None:
    cut = within(Torque(tau1, tau2), ZERO, limit)
    for before, after in zip((tau1, tau2), cut, strict=True):
        assert abs(after) == min(abs(before), limit)
        assert after * before >= 0.0
    assert within(cut, ZERO, limit) == cut


@given(st.lists(torques, min_size=1, max_size=30), st.floats(1e-2, 1e4))
def test_the_rate_limit_never_steps_further_and_gets_there(wanted: list[float], step: float) -> None:
    before = Torque(0.0, 0.0)
    for torque in wanted:
        after = within(Torque(torque, -torque), before, step)
        rounding = 1e-12 * (step + abs(before.tau1))
        assert abs(after.tau1 - before.tau1) <= step + rounding
        if abs(torque - before.tau1) <= step:
            assert abs(after.tau1 - torque) <= rounding
        else:
            assert (after.tau1 - before.tau1) * (torque - before.tau1) > 0.0
        assert after.tau2 == -after.tau1
        before = after


def test_without_limits_the_torque_is_untouched() -> None:
    assert within(Torque(1e9, -3.0), ZERO, math.inf) == (1e9, -3.0)
    assert within(Torque(1e9, -3.0), Torque(5.0, 5.0), math.inf) == (1e9, -3.0)


@pytest.mark.parametrize("torque", [(math.nan, 0.0), (0.0, math.inf), (-math.inf, math.nan)])
def test_what_is_not_finite_is_undefined(torque: tuple[float, float]) -> None:
    fault = undefined(Torque(*torque), 0.25)
    assert fault is not None
    assert fault.name == "torque_undefined"
    assert "sigma = 0.250" in fault.detail
    assert undefined(Torque(1e300, -1e300), 1.0) is None


def test_the_faster_motor_decides_about_speed() -> None:
    joints = (1.6573402912344397, -0.9225800732005386, 1.4842523623553534, 0.9225800732005386)
    for speeds in ((3.0, 90.0, -7.0, 0.0), (-7.0, 0.0, 3.0, -90.0)):
        state = state_from_joints(ROBOT, *joints, *speeds)
        assert fastest_motor(state) == 7.0
        assert over_speed(state, 7.0) is None
        fault = over_speed(state, 6.999)
        assert fault is not None
        assert str(fault).startswith("over_speed: motors at ")
        assert "limit 6.999 rad/s" in fault.detail


@pytest.mark.parametrize("speeds", [(math.nan, 0.0, 1.0, 0.0), (1.0, 0.0, math.nan, 0.0)])
def test_an_unknown_speed_is_too_fast(speeds: tuple[float, ...]) -> None:
    state = state_from_joints(ROBOT, 1.6, -0.9, 1.5, 0.9, *speeds)
    assert over_speed(state, 1e9) is not None


def test_the_workspace_is_a_rectangle() -> None:
    area = Area(-0.05, 0.05, 0.02, 0.13)
    for place in ((0.0, 0.1), (-0.05, 0.02), (0.05, 0.13)):
        assert out_of_workspace(at(*place), area) is None
    for place in ((-0.0501, 0.1), (0.0501, 0.1), (0.0, 0.0199), (0.0, 0.1301)):
        fault = out_of_workspace(at(*place), area)
        assert fault is not None
        assert fault.name == "out_of_workspace"
        assert "m, workspace [-0.05, 0.05, 0.02, 0.13] m" in fault.detail
        assert out_of_workspace(at(*place), None) is None


def test_joints_that_contradict_each_other_put_the_platform_out_of_reach() -> None:
    """Both legs stretched to the left: the mean of their tips is 59 mm beyond the reach of the right leg."""
    state = state_from_joints(ROBOT, math.pi, 0.0, math.pi, 0.0, 0.0, 0.0, 0.0, 0.0)
    assert state.x == pytest.approx(-0.18)
    for workspace in (None, Area(-0.2, 0.2, -0.2, 0.2)):
        fault = out_of_workspace(state, workspace)
        assert fault is not None
        assert "m, 59.0 mm out of reach" in fault.detail


@pytest.mark.parametrize(("beyond", "misread"), [(-2e-3, False), (-5e-4, False), (5e-4, False), (1.5e-3, True)])
def test_encoders_may_put_the_platform_a_millimetre_out_of_reach(beyond: float, misread: bool) -> None:
    """Leg 1 stretched, to rounding or a count too far: that is no fault yet, more of it is."""
    reach = ROBOT.leg1.proximal + ROBOT.leg1.distal + beyond
    state = at(0.0, 0.12)._replace(x=ROBOT.leg1.base_x + 0.6 * reach, y=0.8 * reach)
    fault = out_of_workspace(state, None)
    assert (fault is not None) == misread
    if fault is not None:
        assert f"m, {beyond * 1e3:.1f} mm out of reach" in fault.detail


def test_the_type_1_margin_is_that_of_the_working_mode() -> None:
    state = at(0.0, 0.15)
    clear = abs(state.leg1.sin_q2)
    assert near_type_1(state, MODES, clear - 1e-9) is None
    fault = near_type_1(state, MODES, clear + 1e-9)
    assert fault is not None
    assert fault.name == "near_type_1"
    # a leg that has gone through Type 1 since the last sample stands in the other working mode
    assert near_type_1(state, (-1, -1), 0.01) is not None
    assert near_type_1(state, (1, 1), 0.01) is not None
    assert near_type_1(state, (-1, 1), 0.0) is None


def test_a_stretched_leg_is_near_type_1() -> None:
    stretched = ROBOT.leg1.proximal + ROBOT.leg1.distal
    near = at(ROBOT.leg1.base_x, stretched - 1e-6)
    assert abs(near.leg1.sin_q2) < 0.01
    assert near_type_1(near, MODES, SafetySettings().type1_margin) is not None


def test_tracking_is_lost_beyond_the_limit() -> None:
    state = at(0.04, 0.14)
    assert tracking_lost(state, 0.01, 0.10, 0.05 + 1e-12) is None
    fault = tracking_lost(state, 0.01, 0.10, 0.0499)
    assert fault is not None
    assert str(fault) == "tracking_lost: 50.0 mm from the reference, limit 49.9 mm"
    assert tracking_lost(state, math.nan, 0.10, 1.0) is not None
    # 0.6 m to each side, so that a millimetre in a thousand shows
    assert str(tracking_lost(at(0.0, 0.12), 0.6, 0.12, 0.5)) == (
        "tracking_lost: 600.0 mm from the reference, limit 500 mm"
    )


def test_what_reaches_a_limit_has_not_passed_it() -> None:
    for x in (-0.03, 0.03):
        state = at(x, 0.15)
        clear = min(abs(state.leg1.sin_q2), abs(state.leg2.sin_q2))
        assert near_type_1(state, MODES, clear) is None
        assert near_type_1(state, MODES, math.nextafter(clear, 1.0)) is not None
        assert tracking_lost(state, 0.01, 0.10, math.hypot(x - 0.01, state.y - 0.10)) is None


def test_limits_per_sample_and_of_requests_follow_from_the_settings() -> None:
    limits = guard_limits_of(SafetySettings(torque_rate_limit=1000.0, torque_limit=1.5, request_ratio=4.0), 500)
    assert (limits.torque_step, limits.torque_request) == (2.0, 6.0)


@pytest.mark.parametrize(
    ("torque", "excessive"),
    [((6.5, 0.0), True), ((0.0, -6.5), True), ((6.5, 6.5), True), ((6.0, -6.0), False), ((0.0, 0.0), False)],
)
def test_requests_in_a_row_are_counted(torque: tuple[float, float], excessive: bool) -> None:
    limits = guard_limits_of(SafetySettings(torque_limit=1.5, request_ratio=4.0, request_samples=8), 500)
    count = excess_samples(limits, Torque(*torque), 7)
    assert count == (8 if excessive else 0)
    number = first_fault(limits, ROBOT, MODES, at(0.0, 0.12), 0.0, 0.12, Torque(*torque), count)
    assert number == (TORQUE_EXCESSIVE if excessive else NO_FAULT)


@pytest.mark.parametrize(
    ("y", "vy", "words"),
    [(0.12, -0.01, "is 2000 ms before forbidden posture 2"), (0.1, -0.01, "is in forbidden posture 2")],
)
def test_a_forbidden_posture_is_named_by_its_number(y: float, vy: float, words: str) -> None:
    elsewhere, here = (-0.1, 0.1, -0.3, -0.2), (-0.1, 0.1, -0.1, 0.1)
    limits = guard_limits_of(
        SafetySettings(forbidden=tuple(n for one in (elsewhere, here) for n in (*one, -4.0, 4.0, -4.0, 4.0))), 500
    )
    fault = fault_of(FORBIDDEN_POSTURE, limits, ROBOT, MODES, at(0.0, y, vy=vy), 0.0, y, ZERO, 0.0)
    assert fault.detail.endswith(words)


@pytest.mark.parametrize(
    ("area", "sound"),
    [
        ((0.0, 0.1, 0.0, 0.1), True),
        ((0.1, 0.1, 0.0, 0.1), False),
        ((0.0, 0.1, 0.1, 0.1), False),
        ((0.1, 0.0, 0.0, 0.1), False),
        ((0.0, 0.1, 0.1, 0.0), False),
    ],
)
def test_a_workspace_has_an_inside(area: tuple[float, ...], sound: bool) -> None:
    assert (setting_named(SafetySettings, "workspace").problem(Area(*area)) is None) == sound
