# SPDX-License-Identifier: Apache-2.0
"""The closed loop on a robot of one number, which is where its command has put it."""

from __future__ import annotations

from typing import Any

import pytest

from fivebar_control.compiling import bound
from fivebar_control.laws.reference import reference_from_platform
from fivebar_control.laws.registry import CONTROLLERS, default_tuning
from fivebar_control.laws.torque import ZERO, Torque
from fivebar_control.loop.closed_loop import (
    PLANT_DIVERGED,
    Advanced,
    Answered,
    Known,
    LoopSettings,
    cycle_settings_of,
    first_memory,
    law_functions,
    run_loop,
)
from fivebar_control.loop.plan_sample import PlanSample
from fivebar_control.model.kinematics import state_from_platform
from fivebar_control.model.state import Platform
from fivebar_control.safety.brake import brake_of
from fivebar_control.safety.settings import SafetySettings
from fivebar_control.safety.stages import NO_FAULT, guard_limits_of
from fivebar_description.robot_file import load_robot

ROBOT, RATE_HZ, LAST = load_robot("dextar"), 100, 6
REST = Platform(0.0, 0.15, 0.0, 0.0, 0.0, 0.0)


class Still:
    """A robot that rests where it is to be, and notes what happens."""

    def __init__(self, missing: tuple[int, ...] = (), trip: int | None = None, lost: int | None = None) -> None:
        self.missing, self.trip, self.lost = missing, trip, lost
        self.calls: list[str] = []
        self.samples: list[tuple[int, bool, Torque, float]] = []

    def begin(self) -> tuple[None, None, None]:
        return None, None, None

    def estimate(self, number: int) -> Known:
        self.calls.append(f"estimate {number}")
        state = state_from_platform(ROBOT, (1, -1), *REST[:4])
        return Known(number not in self.missing, state, 0.5, -0.25, 7 if number == self.trip else NO_FAULT)

    def plan_at(self, moment: int) -> PlanSample:
        self.calls.append(f"plan {moment}")
        return PlanSample(reference_from_platform(ROBOT, (1, -1), REST), REST, 1.0, 0.0, 0.0, 0.0, None)

    def record(self, number: int, known: Known, planned: PlanSample, loop: Answered) -> None:
        self.samples.append((number, loop.latched, loop.cycle.command, loop.cycle.requested.tau1))

    def ended(self, fault: int) -> bool:
        return False

    def advance(self, number: int, command: Torque) -> Advanced:
        self.calls.append(f"advance {number}")
        return Advanced(number == self.lost)

    def conclude(self) -> Still:
        return self


def run(still: Still, lead: int = 0, feed_forward: bool = False, **names: Any) -> Still:
    tuned = default_tuning(CONTROLLERS["ctc"])
    safety = SafetySettings(torque_limit=1.0, type1_margin=0.0)
    control = cycle_settings_of(
        ROBOT, (1, -1), RATE_HZ, tuned, 0.04, guard_limits_of(safety, RATE_HZ), brake_of(safety, ROBOT, RATE_HZ)
    )
    loop = bound(run_loop, **law_functions(tuned.controller) | names)
    finished: Still = loop(
        still, LoopSettings(control, 1, LAST, lead, feed_forward), first_memory(tuned.controller, control, list)
    )
    return finished


def test_a_sample_is_estimated_planned_for_its_lead_answered_and_left() -> None:
    done = run(Still(), lead=2)
    assert done.calls[:3] == ["estimate 1", "plan 3", "advance 1"]
    assert done.calls[-2:] == [f"estimate {LAST}", f"plan {LAST + 2}"]
    assert [number for number, *_ in done.samples] == list(range(1, LAST + 1))


def test_a_disturbance_is_compensated_where_that_is_asked_for() -> None:
    without, compensated = (run(Still(), feed_forward=one).samples[0][3] for one in (False, True))
    assert compensated == pytest.approx(without - 0.5, abs=1e-12)


def test_a_fault_of_the_estimator_is_latched_with_its_sample_and_stops_the_torque() -> None:
    found: list[tuple[int, int]] = []

    def conclude(run: Still, log: None, robot: None, fault: int, sample: int) -> Still:
        found.append((fault, sample))
        return run

    done = run(Still(trip=3), feed_forward=True, conclude=conclude)
    assert found == [(7, 3)]
    assert [latched for _, latched, *_ in done.samples] == [False, False, True, True, True, True]
    assert {command for _, latched, command, _ in done.samples if latched} == {ZERO}
    run(Still(lost=4), conclude=conclude)
    assert found[1] == (PLANT_DIVERGED, 4)


def test_a_missing_sample_holds_the_command_and_the_law_is_told_of_the_gap() -> None:
    gaps: list[Any] = []

    def after_gap(memory: Any) -> Any:
        gaps.append(memory)
        return memory

    done = run(Still(missing=(3, 4)), nominal_after_gap=after_gap)
    assert gaps == [None]
    (_, _, before, _), *held = done.samples[1:4]
    assert [command for _, _, command, _ in held] == [before, before]
