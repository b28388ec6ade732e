# SPDX-License-Identifier: Apache-2.0
"""The guard: when it commands zero torque, what it says, and when a reset is taken."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest

from fivebar_control.fault import Fault
from fivebar_control.laws.torque import UNDEFINED, ZERO, Torque
from fivebar_control.model.kinematics import state_from_platform
from fivebar_control.model.state import State
from fivebar_control.safety.guard import ESTIMATE_FAULTS, FINAL_FAULTS, Guard
from fivebar_control.safety.settings import Area, SafetySettings
from fivebar_control.safety.stages import fastest_motor
from fivebar_description.robot_file import load_robot

AWAY, ON_LOCUS = Torque(1.0, 2.0), Torque(-1.0, 4.0)
PLACE = (0.0, 0.12)
FAR = (PLACE[0] + 0.051, PLACE[1])
"""Beyond the limit of the tracking error."""
ROBOT = load_robot()


def moving(vx: float = 0.0, vy: float = 0.0) -> State:
    return state_from_platform(ROBOT, (1, -1), *PLACE, vx, vy)


def make(**settings: object) -> Guard:
    return Guard(ROBOT, (1, -1), 500, SafetySettings(**settings))  # type: ignore[arg-type]


def applied(
    guard: Guard, sample: int = 0, away: Torque = AWAY, sigma: float = 0.0, on_locus: Torque = ON_LOCUS
) -> Torque:
    return guard.command(sample, moving(), PLACE, sigma, away, on_locus).applied


def test_without_a_fault_it_is_the_blend() -> None:
    guard = make()
    assert applied(guard, 0, AWAY, 0.0, UNDEFINED) == AWAY
    assert applied(guard, 1, UNDEFINED, 1.0, ON_LOCUS) == ON_LOCUS
    assert applied(guard, 2, AWAY, 0.5, ON_LOCUS) == (0.0, 3.0)
    assert guard.fault is None
    assert guard.limited_samples == 0


@pytest.mark.parametrize(
    ("sigma", "away", "on_locus"),
    [
        (0.0, UNDEFINED, ON_LOCUS),
        (1.0, AWAY, UNDEFINED),
        (0.3, AWAY, UNDEFINED),
        (0.3, UNDEFINED, ON_LOCUS),
        (0.0, Torque(1.0, math.inf), ON_LOCUS),
        (0.5, Torque(-math.inf, 1.0), ON_LOCUS),
        (0.0, Torque(1.0, math.nan), ON_LOCUS),
        (math.nan, AWAY, ON_LOCUS),
    ],
)
def test_an_undefined_torque_with_weight_is_a_fault(sigma: float, away: Torque, on_locus: Torque) -> None:
    # a limit must not turn what is undefined into the limit
    guard = make(torque_limit=5.0)
    assert applied(guard, 7, away, sigma, on_locus) == ZERO
    assert guard.fault is not None
    assert str(guard.fault).startswith("torque_undefined: at sample 7: ")


def test_what_was_asked_for_is_told_beside_what_is_commanded() -> None:
    guard = make(torque_limit=1.5)
    assert guard.command(0, moving(), PLACE, 0.0, AWAY, AWAY) == (AWAY, (1.0, 1.5))
    assert guard.limited_samples == 1
    assert guard.fault is None


def test_the_rate_starts_from_zero_and_again_after_a_fault() -> None:
    guard = make(torque_limit=2.5, torque_rate_limit=500.0)
    wanted = Torque(7.0, -0.4)
    assert [applied(guard, k, wanted) for k in range(4)] == [(1.0, -0.4), (2.0, -0.4), (2.5, -0.4), (2.5, -0.4)]
    guard.trip(Fault("emergency_stop", "pressed"))
    assert applied(guard, 4, wanted) == ZERO
    assert guard.reset() is None
    assert applied(guard, 5, wanted) == (1.0, -0.4)


def test_the_rate_starts_from_zero_in_a_new_run_too() -> None:
    """The drives were off in between, whatever was commanded last."""
    guard = make(torque_rate_limit=500.0)
    assert [applied(guard, k, Torque(3.0, -3.0)) for k in range(2)] == [(1.0, -1.0), (2.0, -2.0)]
    guard.begin_run()
    assert applied(guard, 0, Torque(3.0, -3.0)) == (1.0, -1.0)


def test_each_stage_stops_the_robot() -> None:
    speed = moving(vy=0.5)
    cases = {
        "over_speed": (make(joint_speed_limit=abs(speed.leg1.dq1) - 0.01), speed, PLACE),
        "out_of_workspace": (make(workspace=Area(-0.1, 0.1, 0.0, 0.119)), moving(), PLACE),
        "near_type_1": (make(type1_margin=1.0), moving(), PLACE),
        "tracking_lost": (make(), moving(), FAR),
    }
    for name, (guard, state, desired) in cases.items():
        assert guard.command(3, state, desired, 0.0, AWAY, AWAY) == (AWAY, ZERO)
        assert guard.fault is not None
        assert str(guard.fault).startswith(f"{name}: at sample 3: ")
        assert guard.command(4, state, desired, 0.0, AWAY, AWAY) == (None, ZERO)


def test_the_stages_come_in_their_order() -> None:
    """Everything is wrong at once: the fault is that of the first stage, then that of the next."""
    speed = moving(vy=0.5)
    settings: dict[str, object] = {
        "joint_speed_limit": 0.1, "workspace": Area(-0.1, 0.1, 0.0, 0.1), "type1_margin": 1.0,
    }  # fmt: skip
    order = []
    for mended in ({}, {"joint_speed_limit": 50.0}, {"workspace": None}, {"type1_margin": 0.0}):
        settings.update(mended)
        guard = make(**settings)
        guard.command(0, speed, (1.0, 1.0), 0.0, AWAY if order else UNDEFINED, AWAY)
        if not order:
            assert guard.fault is not None
            order.append(guard.fault.name)
            guard = make(**settings)
            guard.command(0, speed, (1.0, 1.0), 0.0, AWAY, AWAY)
        assert guard.fault is not None
        order.append(guard.fault.name)
    assert order == ["torque_undefined", "over_speed", "out_of_workspace", "near_type_1", "tracking_lost"]


def test_a_request_far_beyond_the_limit_stops_the_robot_after_some_samples_in_a_row() -> None:
    most = Torque(-6.0, 1.0)
    more = most._replace(tau1=-6.001)
    settings = {"torque_limit": 2.0, "request_ratio": 3.0, "request_samples": 3}
    guard = make(**settings)
    for sample, request in enumerate((more, more, most, more, more)):
        assert applied(guard, sample, request) == (-2.0, 1.0)
    assert applied(guard, 5, more) == ZERO
    assert str(guard.fault) == ("torque_excessive: at sample 5: (-6.001, 1) Nm requested, more than 6 Nm for 3 samples")
    assert applied(guard, 6, more) == ZERO
    assert "torque_excessive" in (guard.reset() or "")
    assert applied(guard, 7, most) == ZERO
    assert guard.reset() is None
    assert applied(guard, 8, most) == (-2.0, 1.0)
    unlimited = make(torque_limit=2.0, request_ratio=math.inf, request_samples=1)
    assert applied(unlimited, 0, Torque(1e9, 1.0)) == (2.0, 1.0)
    free = make(request_samples=1)
    assert applied(free, 0, Torque(1e9, 1.0)) == (1e9, 1.0)


def test_the_count_of_excessive_requests_begins_with_a_run() -> None:
    guard = make(torque_limit=1.0, request_samples=2)
    assert applied(guard, 0, Torque(4.0, 0.0)) == (1.0, 0.0)
    guard.begin_run()
    assert applied(guard, 0, Torque(4.0, 0.0)) == (1.0, 0.0)
    assert guard.fault is None


def test_a_single_excessive_request_stops_a_robot_that_may_have_none() -> None:
    for begun in (False, True):
        guard = make(torque_limit=1.0, request_samples=1)
        if begun:
            guard.begin_run()
        assert guard.command(0, moving(), PLACE, 0.0, Torque(4.0, 0.0), AWAY).applied == ZERO
        assert guard.fault is not None
        assert guard.fault.name == "torque_excessive"


def braking(samples: int) -> Guard:
    """Return a guard that has latched a fault of its own and may brake for so many samples, one of which is over."""
    guard = make(brake_duration=samples / 500)
    assert guard.command(3, moving(vx=0.5), FAR, 0.0, AWAY, AWAY).applied != ZERO
    return guard


def test_it_brakes_for_as_many_samples_as_it_may() -> None:
    guard = braking(3)
    for _ in range(2):
        assert guard.brakes
        assert guard.stop(moving(vx=0.5)) != ZERO
    assert not guard.brakes
    assert guard.stop(moving(vx=0.5)) == ZERO


@pytest.mark.parametrize("end", [Guard.stop_braking, Guard.begin_run, Guard.reset])
def test_it_does_not_brake_before_a_fault_nor_after_an_end(end: Callable[[Guard], object]) -> None:
    assert not make().brakes
    assert make().stop(moving(vx=0.5)) == ZERO
    guard = braking(9)
    guard.command(4, moving(), PLACE, 0.0, AWAY, AWAY)
    end(guard)
    assert not guard.brakes
    assert guard.stop(moving(vx=0.5)) == ZERO


def test_another_fault_from_elsewhere_ends_the_braking_and_the_same_one_does_not() -> None:
    guard = braking(9)
    assert guard.fault is not None
    guard.trip(guard.fault)
    assert guard.brakes
    guard.trip(Fault("drive_fault", "q11"))
    assert not guard.brakes
    assert guard.stop(moving(vx=0.5)) == ZERO


def test_motors_at_the_rest_speed_are_at_rest() -> None:
    state = moving(vx=0.01)
    guard = make(rest_speed=fastest_motor(state))
    guard.trip(Fault("emergency_stop", "pressed"))
    guard.command(1, state, PLACE, 0.0, AWAY, AWAY)
    assert guard.reset() is None


def test_a_fault_stays_until_reset_and_the_first_one_is_kept() -> None:
    guard = make()
    guard.command(1, moving(), (0.1, 0.1), 0.0, AWAY, AWAY)
    first = guard.fault
    assert applied(guard, 2) == ZERO
    assert applied(guard, 3, UNDEFINED) == ZERO
    guard.trip(Fault("input_stale", "something later"))
    assert guard.fault is first
    assert applied(guard, 4) == ZERO
    assert guard.reset() is None
    assert guard.fault is None
    assert applied(guard, 5) == AWAY


def test_a_reset_is_refused_while_the_cause_is_there() -> None:
    guard = make(rest_speed=0.1)
    guard.trip(Fault("emergency_stop", "pressed"))
    assert guard.reset() == "no sample has been complete since"
    speed = moving(vy=0.1)
    for sample, (state, desired, away, reason) in enumerate([
        (moving(), PLACE, UNDEFINED, "torque_undefined: "),
        (moving(), (0.1, 0.1), AWAY, "tracking_lost: "),
        (speed, PLACE, AWAY, f"the motors still turn at {abs(speed.leg1.dq1):.2f} rad/s"),
    ]):  # fmt: skip
        assert guard.command(sample, state, desired, 0.0, away, away) == (None, ZERO)
        answer = guard.reset()
        assert answer is not None
        assert answer.startswith(reason)
        assert guard.fault is not None
    assert applied(guard, 9) == ZERO
    assert guard.reset() is None


@pytest.mark.parametrize("name", FINAL_FAULTS)
def test_what_only_a_new_run_clears_is_not_reset(name: str) -> None:
    guard = make()
    guard.trip(Fault("candidate_missing", "came first"))
    guard.trip(Fault(name, "came second"))
    assert applied(guard, 1) == ZERO
    assert guard.reset() == f"only a new run clears {name}: came second"
    guard.begin_run()
    assert guard.fault is not None
    assert applied(guard, 0) == ZERO
    assert guard.reset() is None


@pytest.mark.parametrize("name", FINAL_FAULTS)
def test_a_robot_that_is_found_again_needs_no_new_run(name: str) -> None:
    guard = make()
    guard.trip(Fault(name, "lost"))
    assert applied(guard, 1) == ZERO
    guard.find_again()
    # not what was complete before: by a state that was wrong
    assert guard.reset() is not None
    assert applied(guard, 2) == ZERO
    assert (guard.reset() is None) is (name in ESTIMATE_FAULTS)


def test_a_published_fault_is_read_back() -> None:
    fault = Fault("drive_fault", "q11: statusword 0x0008, heartbeat: lost")
    assert Fault.from_text(str(fault)) == fault
    assert Fault.from_text("stop") == ("stop", "")
